//! Functions shared by the start-up of the motors and the start-up of the safety module.

use crate::drives::barrett::error::CanError;
use supple_puck::{Property, PropertyId, PropertyTable};

/// Returns the id of a property that has the same id in every firmware, as in the monitor, the program of a puck that is not awake:
/// ROLE, VERS and STAT.
pub(super) fn common_property_id(property: Property) -> Result<PropertyId, CanError> {
    PropertyTable::MONITOR
        .id(property)
        .ok_or(CanError::UnsupportedProperty {
            // Does not occur for these properties; node and version are not known here.
            node: 0,
            version: 0,
            property,
        })
}
