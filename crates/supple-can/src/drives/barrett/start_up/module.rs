//! The safety module during start-up: identification, mode and limits. The host never activates it.

use super::common::common_property_id;
use super::motors;
use crate::drives::barrett::error::CanError;
use crate::drives::barrett::host::Host;
use supple_bus::Bus;
use supple_puck::safety::{SafetyLimits, SafetyMode};
use supple_puck::status::{Role, RoleType};
use supple_puck::{NodeId, Property, PropertyId, PropertyTable, PuckKind};

/// Identifies the module and returns its property ids.
pub fn find<B: Bus>(host: &mut Host<'_, B>) -> Result<PropertyTable, CanError> {
    let node = NodeId::SAFETY;
    let missing = CanError::Missing {
        what: "the safety module",
        node: node.number(),
        remedy: "switch the arm on, check the CAN cable and that the interface is up at 1 Mbit/s",
    };
    let version = host
        .get_property(node, common_property_id(Property::VERS)?)?
        .ok_or(missing)?;
    let role = Role::from_value(motors::get_required(
        host,
        node,
        common_property_id(Property::ROLE)?,
    )?);
    if role.role_type() != Ok(RoleType::Safety) {
        return Err(CanError::Role {
            node: node.number(),
            role: role.0,
            expected: "a safety module (type 2 in the low five bits)",
        });
    }
    PropertyTable::of_firmware(PuckKind::Safety, version).map_err(|source| {
        CanError::FirmwareTooOld {
            node: node.number(),
            source,
        }
    })
}

/// Returns the id of a property of the module.
pub fn property_id(module: &PropertyTable, property: Property) -> Result<PropertyId, CanError> {
    module.id(property).ok_or(CanError::UnsupportedProperty {
        node: NodeId::SAFETY.number(),
        version: 0,
        property,
    })
}

/// Reads the mode of the module.
pub fn mode<B: Bus>(
    host: &mut Host<'_, B>,
    module: &PropertyTable,
) -> Result<SafetyMode, CanError> {
    let id = property_id(module, Property::MODE)?;
    let found = motors::get_required(host, NodeId::SAFETY, id)?;
    SafetyMode::from_value(found).map_err(|_| CanError::UnknownPropertyValue {
        property: Property::MODE,
        node: NodeId::SAFETY.number(),
        found,
    })
}

/// Switches the module to idle if it is active.
pub fn set_idle<B: Bus>(host: &mut Host<'_, B>, module: &PropertyTable) -> Result<(), CanError> {
    let id = property_id(module, Property::MODE)?;
    let idle = i32::from(SafetyMode::Idle.value());
    host.set_property(NodeId::SAFETY, id, idle)?;
    match mode(host, module)? {
        SafetyMode::Active => Err(CanError::Mode {
            found: SafetyMode::Active,
            expected: SafetyMode::Idle,
        }),
        _ => Ok(()),
    }
}

/// Sets the limits of the module, which are reset at power-up, and reads them back.
pub fn set_limits<B: Bus>(
    host: &mut Host<'_, B>,
    module: &PropertyTable,
    limits: &SafetyLimits,
) -> Result<(), CanError> {
    for (property, value) in limits.settings() {
        let id = property_id(module, property)?;
        host.set_property(NodeId::SAFETY, id, value.get())?;
        motors::verify_setting(host, NodeId::SAFETY, property, id, value.get())?;
    }
    Ok(())
}
