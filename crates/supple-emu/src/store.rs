//! Stored property values, and the mapping from ids to properties.

use std::collections::BTreeMap;
use supple_puck::property::Slot;
use supple_puck::{Property, PropertyId, PropertyTable};

/// Stored property values.
#[derive(Clone, Debug, Default)]
pub struct PropertyStore(BTreeMap<Property, i32>);

impl PropertyStore {
    /// Returns the value of a property; `None` if it was never set.
    pub fn get(&self, property: Property) -> Option<i32> {
        self.0.get(&property).copied()
    }

    /// Stores a value.
    pub fn set(&mut self, property: Property, value: i32) {
        self.0.insert(property, value);
    }
}

/// Returns the property that an id has in a firmware.
pub fn property_of(table: &PropertyTable, id: PropertyId) -> Option<Property> {
    match table.slot(id) {
        Slot::Property(property) => Some(property),
        Slot::PlaceHolder(_) | Slot::Unused => None,
    }
}
