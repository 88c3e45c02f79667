//! Values of properties, and which property an id stands for.

use std::collections::BTreeMap;
use supple_puck::property::Slot;
use supple_puck::{Property, PropertyId, PropertyTable};

/// Values that are kept and given back.
#[derive(Clone, Debug, Default)]
pub struct PropertyStore(BTreeMap<Property, i32>);

impl PropertyStore {
    /// Its value; `None` for one that was never set.
    pub fn get(&self, property: Property) -> Option<i32> {
        self.0.get(&property).copied()
    }

    /// Keeps a value.
    pub fn set(&mut self, property: Property, value: i32) {
        self.0.insert(property, value);
    }
}

/// The property that an id stands for in a firmware.
pub fn property_of(table: &PropertyTable, id: PropertyId) -> Option<Property> {
    match table.slot(id) {
        Slot::Property(property) => Some(property),
        Slot::PlaceHolder(_) | Slot::Unused => None,
    }
}
