//! From power-up to an arm that may be polled: whom there is, what they are, whether they fit the
//! description, where the arm stands.
//!
//! ```text
//! safety module -> (operator: Shift-Idle) -> enumerate -> roles, versions -> wake -> motors idle
//!   -> groups, slots, limits -> limits of the safety module -> positions by the home pose -> sensor
//! ```
//!
//! The host puts the motors to idle and never to torque: the operator does, at the pendant. Order and
//! times are libbarrett's.

mod module;
mod motors;

use crate::error::CanError;
use crate::host::{Host, MS};
use crate::transmission::Transmission;
pub use motors::{ARM_GROUPS, MotorPuck};
use supple_bus::Bus;
use supple_core::Vector;
use supple_model::Description;
use supple_puck::safety::{SafetyLimits, SafetyMode};
use supple_puck::status::Stat;
use supple_puck::{NodeId, Property, PropertyId, PropertyTable, Value, force_torque, property};

/// Silence after the wake-up: transceivers drop off the bus and return.
const WAKE_QUIET_NS: u64 = 1_000 * MS;
/// Time that taring the sensor takes, with a margin.
const TARE_NS: u64 = 1_200 * MS;
/// How often the operator's mode is asked for while it is waited for.
const OPERATOR_NS: u64 = 100 * MS;
/// Velocity faults that the safety module ignores once positions are redefined: more than its history.
const IGNORED_FAULTS: i32 = 8;

/// What the operator decides before the start.
#[derive(Clone, Debug, PartialEq)]
pub struct StartUp<const N: usize> {
    /// The arm stands in this pose now \[rad\]; `None` where it is not known to.
    pub zero_at_rad: Option<Vector<N>>,
    /// Limits of the safety module.
    pub limits: SafetyLimits,
    /// Tare the force/torque sensor, where there is one. Without, it reads what it last had.
    pub tare: bool,
}

/// How far the start-up has come, for the operator to see.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// The operator has to act.
    WaitingForIdle,
    /// Looking for nodes.
    Enumerating,
    /// Waking this many pucks.
    Waking(usize),
    /// Comparing pucks with the description.
    Checking,
    /// Defining positions by the home pose.
    Zeroing,
    /// Taring the sensor.
    Taring,
    /// Done.
    Ready,
}

/// An arm that may be polled.
#[derive(Clone, Debug, PartialEq)]
pub struct Ready<const N: usize> {
    /// Motor pucks, in the order of the joints.
    pub pucks: [MotorPuck; N],
    /// Between motors and joints.
    pub transmission: Transmission<N>,
    /// Id lists of the safety module.
    pub module: PropertyTable,
    /// There is a force/torque sensor.
    pub sensor: bool,
}

/// Brings an arm from power-up to where it may be polled. The safety module is in idle at the end.
///
/// # Errors
/// [`CanError`] says what does not fit and what to do.
pub fn start_up<const N: usize, B: Bus>(
    bus: &mut B,
    description: &Description,
    wishes: &StartUp<N>,
    stop: &dyn Fn() -> bool,
    progress: &mut dyn FnMut(Progress),
) -> Result<Ready<N>, CanError> {
    if (N != 4 && N != 7) || description.dof() != N {
        return Err(CanError::Joints {
            arm: description.name().to_owned(),
            found: description.dof(),
        });
    }
    wishes.limits.validate()?;
    let mut host = Host { bus, stop };
    let module = module::find(&mut host)?;
    wait_for_idle(&mut host, &module, progress)?;

    progress(Progress::Enumerating);
    let stats = enumerate(&mut host)?;
    motors::all_present(&stats, description)?;
    let mut pucks = Vec::with_capacity(N);
    for node in (1..=N as u8).filter_map(NodeId::joint) {
        pucks.push(motors::identify(&mut host, node)?);
    }
    motors::share_torque_ids(&pucks)?;
    wake(&mut host, &pucks, &stats, progress)?;

    progress(Progress::Checking);
    let mode = motors::listed(&pucks[0], Property::MODE)?;
    for puck in &pucks {
        host.tell(puck.node, mode, 0)?;
    }
    let mut scales = Vec::with_capacity(N);
    for (index, puck) in pucks.iter().enumerate() {
        motors::configure(&mut host, puck, index)?;
        scales.push(motors::compare(&mut host, puck, index, description)?);
    }
    module::set_limits(&mut host, &module, &wishes.limits)?;
    let joints = || CanError::Joints {
        arm: description.name().to_owned(),
        found: description.dof(),
    };
    let transmission = Transmission::new(
        description,
        core::array::from_fn(|i| scales[i].0),
        core::array::from_fn(|i| scales[i].1),
    );
    let transmission = transmission.ok_or_else(joints)?;
    zero(
        &mut host,
        &module,
        &pucks,
        &transmission,
        description,
        wishes,
        progress,
    )?;
    let sensor = stats[usize::from(NodeId::FORCE_TORQUE.number())].is_some();
    if sensor && wishes.tare {
        progress(Progress::Taring);
        host.bus.send(&force_torque::tare())?;
        host.quiet(TARE_NS)?;
    }
    let pucks: [MotorPuck; N] = pucks.try_into().map_err(|_| joints())?;
    progress(Progress::Ready);
    Ok(Ready {
        pucks,
        transmission,
        module,
        sensor,
    })
}

/// STAT by node number; `None` where nobody answers.
fn enumerate<B: Bus>(host: &mut Host<'_, B>) -> Result<[Option<i32>; 32], CanError> {
    let stat = always(Property::STAT)?;
    let mut stats = [None; 32];
    for number in 1..32u8 {
        if let Ok(node) = NodeId::new(number) {
            stats[usize::from(number)] = host.ask(node, stat)?;
        }
    }
    Ok(stats)
}

fn wait_for_idle<B: Bus>(
    host: &mut Host<'_, B>,
    module: &PropertyTable,
    progress: &mut dyn FnMut(Progress),
) -> Result<(), CanError> {
    let mut told = false;
    loop {
        match module::mode(host, module)? {
            SafetyMode::Idle => return Ok(()),
            SafetyMode::Active => module::lower(host, module)?,
            SafetyMode::EStop => {
                if !told {
                    progress(Progress::WaitingForIdle);
                    told = true;
                }
                host.quiet(OPERATOR_NS)?;
            }
        }
    }
}

fn wake<B: Bus>(
    host: &mut Host<'_, B>,
    pucks: &[MotorPuck],
    stats: &[Option<i32>; 32],
    progress: &mut dyn FnMut(Progress),
) -> Result<(), CanError> {
    let ready = i32::from(Stat::Ready.value());
    let stat = always(Property::STAT)?;
    let asleep = |puck: &&MotorPuck| stats[usize::from(puck.node.number())] != Some(ready);
    let asleep: Vec<&MotorPuck> = pucks.iter().filter(asleep).collect();
    if asleep.is_empty() {
        return Ok(());
    }
    progress(Progress::Waking(asleep.len()));
    for puck in &asleep {
        host.tell(puck.node, stat, ready)?;
    }
    host.quiet(WAKE_QUIET_NS)?;
    for puck in &asleep {
        let found = motors::must(host, puck.node, stat)?;
        if found != ready {
            return Err(CanError::Asleep {
                node: puck.node.number(),
                stat: found,
            });
        }
    }
    Ok(())
}

/// Gives the positions their meaning, unless the safety module says that they have it.
fn zero<const N: usize, B: Bus>(
    host: &mut Host<'_, B>,
    module: &PropertyTable,
    pucks: &[MotorPuck],
    transmission: &Transmission<N>,
    description: &Description,
    wishes: &StartUp<N>,
    progress: &mut dyn FnMut(Progress),
) -> Result<(), CanError> {
    let zero = module::listed(module, Property::ZERO)?;
    let found = motors::must(host, NodeId::SAFETY, zero)?;
    if found == 1 {
        return Ok(());
    }
    let Some(home) = wishes.zero_at_rad else {
        return Err(CanError::NotZeroed {
            zero: found,
            home: format!("{:?}", description.home_rad()),
        });
    };
    progress(Progress::Zeroing);
    let counts = transmission.counts(&home)?;
    let ignore = module::listed(module, Property::IFAULT)?;
    host.tell(NodeId::SAFETY, ignore, IGNORED_FAULTS)?;
    for (puck, counts) in pucks.iter().zip(counts) {
        let set = property::set(puck.node, puck.position, Value::Wide(counts.get()));
        host.bus.send(&set)?;
        host.quiet(MS)?;
    }
    // The safety module sees them on the bus too.
    let replies = host.positions(pucks[0].position, N)?;
    for (puck, expected) in pucks.iter().zip(counts) {
        let node = puck.node.number();
        let reply = replies.iter().find(|(from, _)| *from == puck.node);
        let found = reply.map(|(_, counts)| *counts).ok_or(CanError::Missing {
            what: "a motor puck",
            node,
            remedy: "check its cable, then switch the arm off and on",
        })?;
        // The arm may sag a little in between; a puck that ignored the setting is far off.
        if (found - expected.get()).abs() > puck.counts_per_revolution / 8 {
            return Err(CanError::NotTaken {
                property: Property::P,
                node,
                found,
                expected: expected.get(),
            });
        }
    }
    host.tell(NodeId::SAFETY, zero, 1)?;
    motors::expect(host, NodeId::SAFETY, Property::ZERO, zero, 1)
}

/// Id of a property that every firmware has in the same place.
fn always(property: Property) -> Result<PropertyId, CanError> {
    PropertyTable::MONITOR
        .id(property)
        .ok_or(CanError::Property {
            node: 0,
            version: 0,
            property,
        })
}
