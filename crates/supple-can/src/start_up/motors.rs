//! Motor pucks: what they are, whether they fit the description, and the few settings they need.

use super::always;
use crate::error::CanError;
use crate::host::Host;
use supple_bus::Bus;
use supple_model::Description;
use supple_puck::status::{Role, RoleType};
use supple_puck::{
    GroupId, NodeId, PositionScale, Property, PropertyId, PropertyTable, PuckKind, TorqueScale,
};

/// Groups of the pucks of joints 1 to 4, and of 5 to 7, as libbarrett and OWD have them.
pub const ARM_GROUPS: [[GroupId; 3]; 2] = [
    [GroupId::ACTUATORS, GroupId::LOWER_TORQUES, GroupId::ARM],
    [GroupId::ACTUATORS, GroupId::UPPER_TORQUES, GroupId::ARM],
];
/// How often a node that answered before is asked as one that may not be there is. An emulated one is held up
/// with the machine that it runs on.
const ROUNDS: u32 = 4;
/// By how much a puck's torque units may differ from the description's: the rounding of its quantum.
const UNITS_TOLERANCE: f64 = 1e-3;

/// A motor puck as it was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorPuck {
    /// Its node.
    pub node: NodeId,
    /// Firmware version.
    pub version: i32,
    /// Its list of ids.
    pub table: PropertyTable,
    /// Id of its position.
    pub position: PropertyId,
    /// Id of its torque.
    pub torque: PropertyId,
    /// Its replies carry a joint encoder's position too.
    pub joint_encoder: bool,
    /// Encoder counts per revolution; known after the start-up has compared roles, 4096 before.
    pub counts_per_revolution: i32,
}

/// Refuses an arm of which a motor puck is missing, or that has more.
pub fn all_present(stats: &[Option<i32>; 32], description: &Description) -> Result<(), CanError> {
    let joints = description.dof();
    for (number, stat) in stats.iter().enumerate().take(8).skip(1) {
        let node = number as u8;
        match stat {
            None if number <= joints => {
                return Err(CanError::Missing {
                    what: "a motor puck",
                    node,
                    remedy: "check its cable, then switch the arm off and on",
                });
            }
            Some(_) if number > joints => {
                return Err(CanError::Surplus {
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

/// Reads role and version, which a sleeping puck tells too.
pub fn identify<B: Bus>(host: &mut Host<'_, B>, node: NodeId) -> Result<MotorPuck, CanError> {
    let role = Role::from_value(must(host, node, always(Property::ROLE)?)?);
    let number = node.number();
    if role.role_type() != Ok(RoleType::Tater) {
        return Err(CanError::Role {
            node: number,
            role: role.0,
            expected: "a motor of the arm (type 0 in the low five bits)",
        });
    }
    let version = must(host, node, always(Property::VERS)?)?;
    let table = PropertyTable::of_firmware(PuckKind::Motor, version).map_err(|source| {
        CanError::Firmware {
            node: number,
            source,
        }
    })?;
    let listed = |property| {
        table.id(property).ok_or(CanError::Property {
            node: number,
            version,
            property,
        })
    };
    Ok(MotorPuck {
        node,
        version,
        table,
        position: listed(Property::P)?,
        torque: listed(Property::T)?,
        joint_encoder: role.joint_encoder(),
        counts_per_revolution: 4096,
    })
}

/// One byte names the torque for all pucks of a group, and one id the position for all pucks.
pub fn share_torque_ids(pucks: &[MotorPuck]) -> Result<(), CanError> {
    for puck in pucks {
        let first = pucks[0];
        for (found, expected) in [(puck.torque, first.torque), (puck.position, first.position)] {
            if found != expected {
                return Err(CanError::Mixed {
                    node: puck.node.number(),
                    found: found.number(),
                    expected: expected.number(),
                });
            }
        }
    }
    Ok(())
}

/// Id of a property of this puck.
pub fn listed(puck: &MotorPuck, property: Property) -> Result<PropertyId, CanError> {
    puck.table.id(property).ok_or(CanError::Property {
        node: puck.node.number(),
        version: puck.version,
        property,
    })
}

/// The value of a property of a node that has to be there.
pub fn must<B: Bus>(
    host: &mut Host<'_, B>,
    node: NodeId,
    property: PropertyId,
) -> Result<i32, CanError> {
    for _ in 0..ROUNDS {
        if let Some(value) = host.ask(node, property)? {
            return Ok(value);
        }
    }
    Err(CanError::Missing {
        what: "a node that answered before",
        node: node.number(),
        remedy: "check its cable, then switch the arm off and on",
    })
}

/// Refuses another value than the one that was set.
pub fn expect<B: Bus>(
    host: &mut Host<'_, B>,
    node: NodeId,
    property: Property,
    id: PropertyId,
    expected: i32,
) -> Result<(), CanError> {
    let found = must(host, node, id)?;
    if found == expected {
        return Ok(());
    }
    Err(CanError::NotTaken {
        property,
        node: node.number(),
        found,
        expected,
    })
}

/// Groups and slot of the puck at `index`, set where they differ.
pub fn configure<B: Bus>(
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
        let id = listed(puck, property)?;
        if must(host, puck.node, id)? != value {
            host.tell(puck.node, id, value)?;
            expect(host, puck.node, property, id, value)?;
        }
    }
    Ok(())
}

/// Compares counts, torque units, motor and temperature with the description, and sets the torque limit to
/// the description's.
pub fn compare<B: Bus>(
    host: &mut Host<'_, B>,
    puck: &MotorPuck,
    index: usize,
    description: &Description,
) -> Result<(PositionScale, TorqueScale), CanError> {
    let node = puck.node.number();
    let motors = description.motors();
    let described = |key| CanError::Described {
        arm: description.name().to_owned(),
        key,
    };
    let counts_per_revolution = must(host, puck.node, listed(puck, Property::CTS)?)?;
    let expected = motors.counts_per_revolution;
    let expected = expected.ok_or_else(|| described("counts_per_revolution"))?;
    if i64::from(counts_per_revolution) != i64::from(expected) {
        return Err(CanError::Contradiction {
            property: Property::CTS,
            node,
            found: counts_per_revolution,
            key: "[motors] counts_per_revolution",
            expected: f64::from(expected),
        });
    }
    let units_per_nm = must(host, puck.node, listed(puck, Property::IPNM)?)?;
    let quanta = motors.torque_quantum_nm.as_ref();
    let quanta = quanta.ok_or_else(|| described("torque_quantum_nm"))?;
    let expected = 1.0 / quanta[index];
    if (f64::from(units_per_nm) - expected).abs() > UNITS_TOLERANCE * expected {
        return Err(CanError::Contradiction {
            property: Property::IPNM,
            node,
            found: units_per_nm,
            key: "[motors] torque_quantum_nm",
            expected,
        });
    }
    let position = PositionScale::new(counts_per_revolution)
        .map_err(|source| CanError::Counts { node, source })?;
    let torque = TorqueScale::new(f64::from(units_per_nm))
        .map_err(|source| CanError::Units { node, source })?;
    let most = torque
        .puck_torque(motors.torque_nm[index])
        .map_err(|source| CanError::Units { node, source })?;
    let limit = listed(puck, Property::MT)?;
    let wanted = i32::from(most.units());
    if must(host, puck.node, limit)? != wanted {
        host.tell(puck.node, limit, wanted)?;
        expect(host, puck.node, Property::MT, limit, wanted)?;
    }
    cool(host, puck)?;
    Ok((position, torque))
}

fn cool<B: Bus>(host: &mut Host<'_, B>, puck: &MotorPuck) -> Result<(), CanError> {
    let found = must(host, puck.node, listed(puck, Property::TEMP)?)?;
    let limit = must(host, puck.node, listed(puck, Property::OTEMP)?)?;
    if found < limit {
        return Ok(());
    }
    Err(CanError::Hot {
        node: puck.node.number(),
        found,
        limit,
    })
}
