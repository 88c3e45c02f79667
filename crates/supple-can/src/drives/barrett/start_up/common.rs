//! Functions that the start-up of the motors and that of the safety module use.

use crate::drives::barrett::error::CanError;
use supple_puck::{Property, PropertyId, PropertyTable};

/// Id of a property whose id is the same in every firmware version.
pub(super) fn common_property_id(property: Property) -> Result<PropertyId, CanError> {
    PropertyTable::MONITOR
        .id(property)
        .ok_or(CanError::Property {
            node: 0,
            version: 0,
            property,
        })
}
