//! Start-up of Barrett's drives: enumerates and identifies the nodes, compares them with the description, and sets the
//! positions of the motor pucks.
//!
//! ```text
//! safety module -> (operator: Shift-Idle) -> enumerate -> roles, versions -> wake -> motors idle
//!   -> bus groups, torque slots, torque limits -> limits of the safety module
//!   -> encoder positions from the home pose -> tare the sensor
//! ```
//!
//! The host sets the motors to idle. It never activates them: the operator activates them on the pendant. Order and
//! times follow libbarrett.

mod common;
mod module;
mod motors;

use common::common_property_id;

use crate::drives::barrett::error::CanError;
use crate::drives::barrett::host::{Host, MS};
use crate::drives::barrett::transmission::Transmission;
pub use motors::{ARM_GROUPS, MotorPuck};
use supple_bus::Bus;
use supple_core::Vector;
use supple_ipc::HomePoseConfirmation;
use supple_model::Description;
use supple_puck::safety::{SafetyLimits, SafetyMode};
use supple_puck::status::Stat;
use supple_puck::{NodeId, Property, PropertyTable, Value, force_torque, property};

/// Time after the wake-up in which the host sends nothing, because the pucks' transceivers restart \[ns\].
const WAKE_QUIET_NS: u64 = 1_000 * MS;
/// Time that taring the sensor takes, with a margin \[ns\].
const TARE_NS: u64 = 1_200 * MS;
/// Poll interval of the safety module's mode while start-up waits for the operator \[ns\].
const OPERATOR_POLL_NS: u64 = 100 * MS;
/// Number of velocity faults that the safety module ignores after positions are redefined: more than the cycles of
/// positions from which it computes the speed.
const IGNORED_FAULTS: i32 = 8;

/// Start-up configuration from the command line.
#[derive(Clone, Debug, PartialEq)]
pub struct StartupConfig<const N: usize> {
    /// Current pose of the arm \[rad\]; `None` if unknown.
    pub zero_at_rad: Option<Vector<N>>,
    /// Files through which start-up asks the operator to confirm the home pose if the current pose is unknown; with `None`
    /// an unknown pose is an error.
    pub confirmation: Option<HomePoseConfirmation>,
    /// Limits of the safety module.
    pub limits: SafetyLimits,
    /// Whether to tare the force/torque sensor, if the arm has one; otherwise the sensor keeps its last tare.
    pub tare: bool,
}

/// Progress of the start-up, for display.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Waiting for the operator to select idle.
    WaitingForIdle,
    /// Searching for nodes.
    Enumerating,
    /// Waking this many pucks.
    Waking(usize),
    /// Comparing pucks with the description.
    Checking,
    /// Waiting for the operator to confirm the home pose.
    WaitingForHome,
    /// Setting the positions to the home pose.
    Zeroing,
    /// Taring the sensor.
    Taring,
    /// The arm is ready for the polling cycle.
    Ready,
}

/// An arm that is ready for the polling cycle.
#[derive(Clone, Debug, PartialEq)]
pub struct Ready<const N: usize> {
    /// Motor pucks, in the order of the joints.
    pub pucks: [MotorPuck; N],
    /// Transmission between motors and joints.
    pub transmission: Transmission<N>,
    /// Property ids of the safety module.
    pub module: PropertyTable,
    /// Whether there is a force/torque sensor.
    pub sensor: bool,
}

/// Prepares an arm for polling after power-up. The safety module is in idle at the end.
///
/// # Errors
/// [`CanError`] with the mismatch and the remedy.
pub fn start_up<const N: usize, B: Bus>(
    bus: &mut B,
    description: &Description,
    startup_config: &StartupConfig<N>,
    stop: &dyn Fn() -> bool,
    progress: &mut dyn FnMut(Progress),
) -> Result<Ready<N>, CanError> {
    if (N != 4 && N != 7) || description.dof() != N {
        return Err(CanError::Joints {
            arm: description.name().to_owned(),
            found: description.dof(),
        });
    }
    startup_config.limits.validate()?;
    let mut host = Host { bus, stop };
    let module = module::find(&mut host)?;
    wait_for_idle(&mut host, &module, progress)?;

    progress(Progress::Enumerating);
    let stats = enumerate(&mut host)?;
    motors::check_nodes(&stats, description)?;
    let mut pucks = Vec::with_capacity(N);
    for node in (1..=N as u8).filter_map(NodeId::joint) {
        pucks.push(motors::identify(&mut host, node)?);
    }
    motors::check_same_property_ids(&pucks)?;
    wake(&mut host, &pucks, &stats, progress)?;

    progress(Progress::Checking);
    let mode = motors::property_id(&pucks[0], Property::MODE)?;
    for puck in &pucks {
        host.set_property(puck.node, mode, 0)?;
    }
    let mut scales = Vec::with_capacity(N);
    for (index, puck) in pucks.iter().enumerate() {
        motors::set_groups_and_slot(&mut host, puck, index)?;
        scales.push(motors::check_and_set_torque_limit(
            &mut host,
            puck,
            index,
            description,
        )?);
    }
    module::set_limits(&mut host, &module, &startup_config.limits)?;
    let joints_error = || CanError::Joints {
        arm: description.name().to_owned(),
        found: description.dof(),
    };
    let transmission = Transmission::new(
        description,
        core::array::from_fn(|i| scales[i].0),
        core::array::from_fn(|i| scales[i].1),
    );
    let transmission = transmission.ok_or_else(joints_error)?;
    set_home_positions(
        &mut host,
        &module,
        &pucks,
        &transmission,
        description,
        startup_config,
        progress,
    )?;
    let sensor = stats[usize::from(NodeId::FORCE_TORQUE.number())].is_some();
    if sensor && startup_config.tare {
        progress(Progress::Taring);
        host.bus.send(&force_torque::tare())?;
        host.wait_silently(TARE_NS)?;
    }
    let pucks: [MotorPuck; N] = pucks.try_into().map_err(|_| joints_error())?;
    progress(Progress::Ready);
    Ok(Ready {
        pucks,
        transmission,
        module,
        sensor,
    })
}

/// Requests the status ([`Property::STAT`]) of every node; returns it by node number, `None` for a node that does not
/// answer.
fn enumerate<B: Bus>(host: &mut Host<'_, B>) -> Result<[Option<i32>; 32], CanError> {
    let stat = common_property_id(Property::STAT)?;
    let mut stats = [None; 32];
    for number in 1..32u8 {
        if let Ok(node) = NodeId::new(number) {
            stats[usize::from(number)] = host.get_property(node, stat)?;
        }
    }
    Ok(stats)
}

fn wait_for_idle<B: Bus>(
    host: &mut Host<'_, B>,
    module: &PropertyTable,
    progress: &mut dyn FnMut(Progress),
) -> Result<(), CanError> {
    let mut prompted = false;
    loop {
        match module::mode(host, module)? {
            SafetyMode::Idle => return Ok(()),
            SafetyMode::Active => module::set_idle(host, module)?,
            SafetyMode::EStop => {
                if !prompted {
                    progress(Progress::WaitingForIdle);
                    prompted = true;
                }
                host.wait_silently(OPERATOR_POLL_NS)?;
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
    let stat = common_property_id(Property::STAT)?;
    let is_asleep = |puck: &&MotorPuck| stats[usize::from(puck.node.number())] != Some(ready);
    let asleep: Vec<&MotorPuck> = pucks.iter().filter(is_asleep).collect();
    if asleep.is_empty() {
        return Ok(());
    }
    progress(Progress::Waking(asleep.len()));
    for puck in &asleep {
        host.set_property(puck.node, stat, ready)?;
    }
    host.wait_silently(WAKE_QUIET_NS)?;
    for puck in &asleep {
        let found = motors::get_required(host, puck.node, stat)?;
        if found != ready {
            return Err(CanError::NotAwake {
                node: puck.node.number(),
                stat: found,
            });
        }
    }
    Ok(())
}

/// Waits until the operator confirms that the arm is in its home pose. If the safety module leaves idle meanwhile, the power
/// was lost again and the arm has sunk: start-up then fails, and an answer of the operator is ignored.
fn wait_for_home<const N: usize, B: Bus>(
    host: &mut Host<'_, B>,
    module: &PropertyTable,
    description: &Description,
    files: &HomePoseConfirmation,
) -> Result<Vector<N>, CanError> {
    let joints = description.joint_names().iter().zip(description.home_rad());
    let pose: Vec<String> = joints
        .map(|(name, angle_rad)| format!("{name} {angle_rad} rad"))
        .collect();
    files
        .request(&pose.join(", "))
        .map_err(CanError::HomePoseQuestion)?;
    loop {
        host.wait_silently(OPERATOR_POLL_NS)?;
        let answered = files.take_answer();
        let mode = module::mode(host, module)?;
        if mode != SafetyMode::Idle {
            return Err(CanError::Mode {
                found: mode,
                expected: SafetyMode::Idle,
            });
        }
        if answered {
            let home = description.home::<N>();
            return home.map_err(|_| CanError::Joints {
                arm: description.name().to_owned(),
                found: description.dof(),
            });
        }
    }
}

/// Sets the motor positions from the home pose, unless the safety module reports that they are already set.
fn set_home_positions<const N: usize, B: Bus>(
    host: &mut Host<'_, B>,
    module: &PropertyTable,
    pucks: &[MotorPuck],
    transmission: &Transmission<N>,
    description: &Description,
    startup_config: &StartupConfig<N>,
    progress: &mut dyn FnMut(Progress),
) -> Result<(), CanError> {
    let zero_id = module::property_id(module, Property::ZERO)?;
    let found = motors::get_required(host, NodeId::SAFETY, zero_id)?;
    if found == 1 {
        return Ok(());
    }
    let home = match (startup_config.zero_at_rad, &startup_config.confirmation) {
        (Some(home), _) => home,
        (None, Some(files)) => {
            progress(Progress::WaitingForHome);
            let confirmed = wait_for_home(host, module, description, files);
            files.remove_request();
            confirmed?
        }
        (None, None) => {
            return Err(CanError::NotZeroed {
                zero: found,
                home: format!("{:?}", description.home_rad()),
            });
        }
    };
    progress(Progress::Zeroing);
    let counts = transmission.counts(&home)?;
    let ifault_id = module::property_id(module, Property::IFAULT)?;
    host.set_property(NodeId::SAFETY, ifault_id, IGNORED_FAULTS)?;
    for (puck, counts) in pucks.iter().zip(counts) {
        let set_position = property::set(puck.node, puck.position, Value::Wide(counts.get()));
        host.bus.send(&set_position)?;
        host.wait_silently(MS)?;
    }
    // The safety module also receives these replies and takes the new positions from them.
    let replies = host.positions(pucks[0].position, N)?;
    for (puck, expected) in pucks.iter().zip(counts) {
        let node = puck.node.number();
        let reply = replies.iter().find(|(from, _)| *from == puck.node);
        let found = reply.map(|(_, counts)| *counts).ok_or(CanError::Missing {
            what: "a motor puck",
            node,
            remedy: "check its cable, then switch the arm off and on",
        })?;
        // The arm may sag slightly before the reply; the position of a puck that ignored the setting differs far more.
        if (found - expected.get()).abs() > puck.counts_per_revolution / 8 {
            return Err(CanError::SettingIgnored {
                property: Property::P,
                node,
                found,
                expected: expected.get(),
            });
        }
    }
    host.set_property(NodeId::SAFETY, zero_id, 1)?;
    motors::verify_setting(host, NodeId::SAFETY, Property::ZERO, zero_id, 1)
}
