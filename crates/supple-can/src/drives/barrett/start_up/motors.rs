//! The motor pucks during start-up: identification, comparison with the description, and settings.

use super::common::common_property_id;
use crate::drives::barrett::error::CanError;
use crate::drives::barrett::host::Host;
use supple_bus::Bus;
use supple_model::Description;
use supple_puck::status::{Role, RoleType};
use supple_puck::{
    GroupId, NodeId, PositionScale, Property, PropertyId, PropertyTable, PuckKind, TorqueScale,
};

/// Groups of the pucks of joints 1 to 4, and of joints 5 to 7, as in libbarrett and OWD.
pub const ARM_GROUPS: [[GroupId; 3]; 2] = [
    [GroupId::ACTUATORS, GroupId::LOWER_TORQUES, GroupId::ARM],
    [GroupId::ACTUATORS, GroupId::UPPER_TORQUES, GroupId::ARM],
];
/// Number of requests to a node before it counts as missing. The machine may delay the answer of an emulated node.
const ATTEMPTS: u32 = 4;
/// Relative tolerance of a puck's torque units, which allows for the rounding of the torque quantum in the description.
const UNITS_TOLERANCE: f64 = 1e-3;

/// An identified motor puck.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorPuck {
    /// Node id.
    pub node: NodeId,
    /// Firmware version.
    pub version: i32,
    /// Property ids of its firmware version.
    pub table: PropertyTable,
    /// Property id of the position.
    pub position: PropertyId,
    /// Property id of the torque.
    pub torque: PropertyId,
    /// Whether its replies also contain the position of a joint encoder.
    pub joint_encoder: bool,
    /// Encoder counts per revolution: 4096 until start-up has read the value of the puck.
    pub counts_per_revolution: i32,
}

/// Rejects an arm on whose bus a motor puck is missing or additional.
pub fn check_nodes(
    status_by_node: &[Option<i32>; 32],
    description: &Description,
) -> Result<(), CanError> {
    let joints = description.dof();
    for (number, status) in status_by_node.iter().enumerate().take(8).skip(1) {
        let node = number as u8;
        match status {
            None if number <= joints => {
                return Err(CanError::Missing {
                    what: "a motor puck",
                    node,
                    remedy: "check its cable, then switch the arm off and on",
                });
            }
            Some(_) if number > joints => {
                return Err(CanError::UnexpectedMotor {
                    node,
                    arm: description.name().to_owned(),
                    joints,
                });
            }
            _ => {}
        }
    }
    Ok(())
}

/// Reads role and firmware version of a puck; a puck that has not been woken reports them too.
pub fn identify<B: Bus>(host: &mut Host<'_, B>, node: NodeId) -> Result<MotorPuck, CanError> {
    let role = Role::from_value(get_required(
        host,
        node,
        common_property_id(Property::ROLE)?,
    )?);
    let number = node.number();
    if role.role_type() != Ok(RoleType::Tater) {
        return Err(CanError::Role {
            node: number,
            role: role.0,
            expected: "a motor of the arm (type 0 in the low five bits)",
        });
    }
    let version = get_required(host, node, common_property_id(Property::VERS)?)?;
    let table = PropertyTable::of_firmware(PuckKind::Motor, version).map_err(|source| {
        CanError::FirmwareTooOld {
            node: number,
            source,
        }
    })?;
    let property_id = |property| {
        table.id(property).ok_or(CanError::UnsupportedProperty {
            node: number,
            version,
            property,
        })
    };
    Ok(MotorPuck {
        node,
        version,
        table,
        position: property_id(Property::P)?,
        torque: property_id(Property::T)?,
        joint_encoder: role.joint_encoder(),
        counts_per_revolution: 4096,
    })
}

/// Checks that all pucks use the same property ids for torque and position, because a torque frame and a position request
/// to a group of pucks each contain one id.
pub fn check_same_property_ids(pucks: &[MotorPuck]) -> Result<(), CanError> {
    for puck in pucks {
        let first = pucks[0];
        let pairs = [
            ("torque", puck.torque, first.torque),
            ("position", puck.position, first.position),
        ];
        for (property, found, expected) in pairs {
            if found != expected {
                return Err(CanError::MixedPropertyIds {
                    node: puck.node.number(),
                    property,
                    found: found.number(),
                    expected: expected.number(),
                });
            }
        }
    }
    Ok(())
}

/// Returns the id of a property of this puck.
pub fn property_id(puck: &MotorPuck, property: Property) -> Result<PropertyId, CanError> {
    puck.table
        .id(property)
        .ok_or(CanError::UnsupportedProperty {
            node: puck.node.number(),
            version: puck.version,
            property,
        })
}

/// Reads a property of a node; fails if the node does not answer.
pub fn get_required<B: Bus>(
    host: &mut Host<'_, B>,
    node: NodeId,
    property: PropertyId,
) -> Result<i32, CanError> {
    for _ in 0..ATTEMPTS {
        if let Some(value) = host.get_property(node, property)? {
            return Ok(value);
        }
    }
    Err(CanError::Missing {
        what: "a node that answered before",
        node: node.number(),
        remedy: "check its cable, then switch the arm off and on",
    })
}

/// Reads a setting back; fails if it differs from the value set.
pub fn verify_setting<B: Bus>(
    host: &mut Host<'_, B>,
    node: NodeId,
    property: Property,
    id: PropertyId,
    expected: i32,
) -> Result<(), CanError> {
    let found = get_required(host, node, id)?;
    if found == expected {
        return Ok(());
    }
    Err(CanError::SettingIgnored {
        property,
        node: node.number(),
        found,
        expected,
    })
}

/// Sets the groups of the puck of joint `index` and its slot in the torque frame, unless they are already set.
pub fn set_groups_and_slot<B: Bus>(
    host: &mut Host<'_, B>,
    puck: &MotorPuck,
    index: usize,
) -> Result<(), CanError> {
    let [a, b, c] = ARM_GROUPS[index / 4];
    for (property, value) in [
        (Property::GRPA, i32::from(a.number())),
        (Property::GRPB, i32::from(b.number())),
        (Property::GRPC, i32::from(c.number())),
        (Property::PIDX, index as i32 % 4 + 1),
    ] {
        let id = property_id(puck, property)?;
        if get_required(host, puck.node, id)? != value {
            host.set_property(puck.node, id, value)?;
            verify_setting(host, puck.node, property, id, value)?;
        }
    }
    Ok(())
}

/// Compares counts per revolution and torque units with the description, rejects a puck that is too hot, and sets its torque
/// limit to the value in the description. Returns the scales of its position counts and torque units.
pub fn check_and_set_torque_limit<B: Bus>(
    host: &mut Host<'_, B>,
    puck: &MotorPuck,
    index: usize,
    description: &Description,
) -> Result<(PositionScale, TorqueScale), CanError> {
    let node = puck.node.number();
    let motors = description.motors();
    let missing_key = |key| CanError::MissingKey {
        arm: description.name().to_owned(),
        key,
    };
    let counts_per_revolution = get_required(host, puck.node, property_id(puck, Property::CTS)?)?;
    let expected = motors.counts_per_revolution;
    let expected = expected.ok_or_else(|| missing_key("counts_per_revolution"))?;
    if i64::from(counts_per_revolution) != i64::from(expected) {
        return Err(CanError::DescriptionMismatch {
            property: Property::CTS,
            node,
            found: counts_per_revolution,
            key: "[motors] counts_per_revolution",
            expected: f64::from(expected),
        });
    }
    let units_per_nm = get_required(host, puck.node, property_id(puck, Property::IPNM)?)?;
    let quanta = motors.torque_quantum_nm.as_ref();
    let quanta = quanta.ok_or_else(|| missing_key("torque_quantum_nm"))?;
    let expected = 1.0 / quanta[index];
    if (f64::from(units_per_nm) - expected).abs() > UNITS_TOLERANCE * expected {
        return Err(CanError::DescriptionMismatch {
            property: Property::IPNM,
            node,
            found: units_per_nm,
            key: "[motors] torque_quantum_nm",
            expected,
        });
    }
    let position = PositionScale::new(counts_per_revolution)
        .map_err(|source| CanError::InvalidCountsPerRevolution { node, source })?;
    let torque = TorqueScale::new(f64::from(units_per_nm))
        .map_err(|source| CanError::InvalidTorqueUnits { node, source })?;
    let max_torque = torque
        .puck_torque(motors.torque_nm[index])
        .map_err(|source| CanError::InvalidTorqueUnits { node, source })?;
    let limit = property_id(puck, Property::MT)?;
    let max_units = i32::from(max_torque.units());
    if get_required(host, puck.node, limit)? != max_units {
        host.set_property(puck.node, limit, max_units)?;
        verify_setting(host, puck.node, Property::MT, limit, max_units)?;
    }
    check_temperature(host, puck)?;
    Ok((position, torque))
}

fn check_temperature<B: Bus>(host: &mut Host<'_, B>, puck: &MotorPuck) -> Result<(), CanError> {
    let found = get_required(host, puck.node, property_id(puck, Property::TEMP)?)?;
    let limit = get_required(host, puck.node, property_id(puck, Property::OTEMP)?)?;
    if found < limit {
        return Ok(());
    }
    Err(CanError::OverTemperature {
        node: puck.node.number(),
        found,
        limit,
    })
}
