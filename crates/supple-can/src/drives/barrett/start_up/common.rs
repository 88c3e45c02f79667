//! What the motors' and the safety module's part of the start-up share.

use crate::drives::barrett::error::CanError;
use supple_puck::{Property, PropertyId, PropertyTable};

/// Id of a property that is the same in every firmware.
pub(super) fn common_property_id(property: Property) -> Result<PropertyId, CanError> {
    PropertyTable::MONITOR
        .id(property)
        .ok_or(CanError::Property {
            node: 0,
            version: 0,
            property,
        })
}
