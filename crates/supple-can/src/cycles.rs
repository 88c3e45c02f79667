//! Opens the bus and runs cycles, for every type of drives.

use core::time::Duration;
use supple_bus::virtual_time::LockstepBus;
use supple_bus::{Address, Bus, BusError, OwnerFolder, PacedBus, SocketCan};
use supple_core::controller::NamesJoints;
use supple_core::record::Text;
use supple_drive::{
    Counters, Drive, Drives, LoopError, LossReason, PlantLoop, SharedMemoryLink, Stage,
    TemperatureWarning, TorqueOffBehaviour,
};
use supple_realtime::{
    Stop, diagnostics, forget_support, monotonic_ns, pause, support_is_declared,
};

/// Timeout of the search for an emulated arm \[ns\].
const EMULATOR_TIMEOUT_NS: u64 = 5_000_000_000;
/// Time without a reply from any motor after which start-up is repeated \[ns\].
const ARM_LOST_AFTER_NS: u64 = 500_000_000;
/// Maximum time for ending the torque at shutdown if the motors brake without torque \[ns\].
const BRAKE_TIMEOUT_NS: u64 = 250_000_000;
/// Maximum time for laying the arm down and ending the torque at shutdown if it falls without torque \[ns\].
const STOW_TIMEOUT_NS: u64 = 60_000_000_000;
/// Maximum number of motors of an arm.
const MAX_MOTORS: usize = 8;
/// Interval between attempts to reach a lost arm, or an emulator that has not started yet.
pub const SEARCH_INTERVAL: Duration = Duration::from_millis(200);

/// Why a run of cycles ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EndReason {
    /// A shutdown was requested, or all cycles are done; the motors are idle.
    ShutDown,
    /// No motor has replied for [`ARM_LOST_AFTER_NS`].
    ArmLost,
}

/// Runs cycles until a shutdown is requested, all `cycles` are done, or the arm has lost its power.
///
/// # Errors
/// If the bus itself or the link to the controller fails.
pub fn run_until_shutdown<const N: usize, D: Drive<N>>(
    plant: &mut PlantLoop<N, D, SharedMemoryLink>,
    cycles: Option<u64>,
    stop: &Stop,
    joint_names: &[Text],
) -> Result<EndReason, LoopError> {
    let mut last_reply_ns = plant.drive().now_ns();
    let mut stages = StageReporter::default();
    let all_cycles_done = |done: u64| cycles.is_some_and(|max| done >= max);
    while !stop.shutdown_requested() && !all_cycles_done(plant.counters().cycles) {
        plant.run()?;
        let now_ns = plant.drive().now_ns();
        if plant.drive().motors_replied() {
            last_reply_ns = now_ns;
        }
        if now_ns > last_reply_ns + ARM_LOST_AFTER_NS {
            return Ok(EndReason::ArmLost);
        }
        stages.report(plant, joint_names);
    }
    plant.begin_shutdown();
    forget_support();
    let timeout_ns = match plant.drive().torque_off_behaviour() {
        TorqueOffBehaviour::Brakes => BRAKE_TIMEOUT_NS,
        TorqueOffBehaviour::Falls => STOW_TIMEOUT_NS,
    };
    let mut until_ns = plant.drive().now_ns() + timeout_ns;
    if plant.drive().torque_off_behaviour() == TorqueOffBehaviour::Falls {
        // Motors that are being enabled are not active yet: this cycle ends their enabling.
        plant.run()?;
        stages.report(plant, joint_names);
    }
    while plant.drives() == Drives::Active && plant.drive().now_ns() < until_ns {
        if support_is_declared() {
            plant.declare_supported();
        }
        plant.run()?;
        stages.report(plant, joint_names);
        // Motors that do not reply hold nothing.
        if plant.guard().waits_for_support() && plant.drive().motors_replied() {
            until_ns = plant.drive().now_ns() + timeout_ns;
        }
    }
    Ok(EndReason::ShutDown)
}

/// Posts the changes of the loss and of the stage of the safe action; holds those last posted.
struct StageReporter {
    loss: Option<(LossReason, u64)>,
    stage: Stage,
    waits_for_support: bool,
    temperature: [TemperatureReport; MAX_MOTORS],
}

impl Default for StageReporter {
    fn default() -> StageReporter {
        StageReporter {
            loss: None,
            stage: Stage::Resting,
            waits_for_support: false,
            temperature: Default::default(),
        }
    }
}

impl StageReporter {
    /// Posts a message if the loss or the stage has changed; posts nothing in steady operation.
    fn report<const N: usize, D: Drive<N>>(
        &mut self,
        plant: &PlantLoop<N, D, SharedMemoryLink>,
        joint_names: &[Text],
    ) {
        let drive = plant.drive();
        let now_ns = drive.now_ns();
        for (motor, report) in self.temperature.iter_mut().enumerate() {
            let Some(warning) = drive.temperature_warning(motor) else {
                continue;
            };
            if report.is_new(&warning, now_ns) {
                let joint = joint_names.get(motor).copied().unwrap_or(Text::EMPTY);
                let limit = 100.0 * warning.torque_share;
                diagnostics::post(format_args!(
                    "supple-can: warning: motor {} ({joint}) is at {} degrees Celsius; it has {limit:.0} % of its torque limit: let it cool",
                    motor + 1,
                    warning.celsius
                ));
            }
        }
        let in_words = |reason: &LossReason| reason.with_names(joint_names).to_string();
        let guard = plant.guard();
        let falls = plant.drive().torque_off_behaviour() == TorqueOffBehaviour::Falls;
        if guard.last_loss() != self.loss {
            self.loss = guard.last_loss();
            if let (Some((reason, _)), false) = (self.loss, falls) {
                let reason = in_words(&reason);
                diagnostics::post(format_args!("supple-can: set to idle: {reason}"));
            }
        }
        if guard.waits_for_support() && !self.waits_for_support {
            diagnostics::post(format_args!(
                "supple-can: the arm is held: support it, then run `supple stop --supported` or `kill -USR1 {}`",
                std::process::id()
            ));
        }
        self.waits_for_support = guard.waits_for_support();
        if guard.stage() == self.stage {
            return;
        }
        let time_s = drive.monotonic_ns(drive.now_ns()) as f64 * 1e-9;
        match (guard.stage(), self.stage) {
            (Stage::Active, _) => diagnostics::post(format_args!("supple-can: active")),
            (Stage::Holding(reason, _), _) => diagnostics::post(format_args!(
                "supple-can: {time_s:.4} s: holding the arm: {}",
                in_words(&reason)
            )),
            (Stage::Releasing(..), _) => diagnostics::post(format_args!(
                "supple-can: {time_s:.4} s: the arm is supported: its torque fades"
            )),
            (Stage::Stowing(reason, _), _) => diagnostics::post(format_args!(
                "supple-can: {time_s:.4} s: laying the arm down: {}",
                in_words(&reason)
            )),
            (Stage::Damping(reason, _), _) => diagnostics::post(format_args!(
                "supple-can: {time_s:.4} s: ending the torque, the motors damp: {}",
                in_words(&reason)
            )),
            (Stage::Lowering(reason, _), _) if falls => diagnostics::post(format_args!(
                "supple-can: {time_s:.4} s: disabling the motors: {}",
                in_words(&reason)
            )),
            (Stage::Resting, _) if falls => {
                diagnostics::post(format_args!("supple-can: {time_s:.4} s: disabled"));
            }
            _ => {}
        }
        self.stage = guard.stage();
    }
}

/// What has been reported of a hot motor.
#[derive(Default)]
struct TemperatureReport {
    /// The last report.
    last: Option<TemperatureWarning>,
    /// Time of the last warning, reported or not \[ns\].
    last_ns: u64,
}

impl TemperatureReport {
    /// Time without a warning after which the next one is reported again \[ns\].
    const AGAIN_NS: u64 = 60_000_000_000;
    /// Increase of the temperature that is reported \[degrees Celsius\].
    const STEP_CELSIUS: u8 = 5;

    /// Whether a warning is reported: the first one, and each increase by [`TemperatureReport::STEP_CELSIUS`].
    fn is_new(&mut self, warning: &TemperatureWarning, now_ns: u64) -> bool {
        let paused = now_ns.saturating_sub(self.last_ns) > TemperatureReport::AGAIN_NS;
        self.last_ns = now_ns;
        let last = self.last.filter(|_| !paused);
        let is_new = last.is_none_or(|last| {
            warning.celsius >= last.celsius.saturating_add(TemperatureReport::STEP_CELSIUS)
        });
        if is_new {
            self.last = Some(*warning);
        }
        is_new
    }
}

/// Opens a bus; waits for an emulator that has not started yet.
///
/// # Errors
/// If the interface or folder cannot be used, or no emulator appears.
pub fn open(address: Address, virtual_time: bool, stop: &Stop) -> Result<Box<dyn Bus>, BusError> {
    diagnostics::post(format_args!("supple-can: bus {address}"));
    match address {
        Address::Interface(name) => Ok(Box::new(SocketCan::open(&name)?)),
        Address::Folder(folder) => {
            let folder = OwnerFolder::open(folder)?;
            let until_ns = monotonic_ns() + EMULATOR_TIMEOUT_NS;
            loop {
                let opened: Result<Box<dyn Bus>, BusError> = match virtual_time {
                    true => LockstepBus::open(&folder).map(|bus| Box::new(bus) as _),
                    false => PacedBus::open(&folder).map(|bus| Box::new(bus) as _),
                };
                match opened {
                    Err(BusError::NoPeer { .. })
                        if monotonic_ns() < until_ns && !stop.shutdown_requested() =>
                    {
                        pause(SEARCH_INTERVAL);
                    }
                    opened => return opened,
                }
            }
        }
    }
}

/// Adds the counters of two runs; takes timing and bus load from the later run `b`.
pub fn sum_counters(a: &Counters, b: &Counters) -> Counters {
    Counters {
        cycles: a.cycles + b.cycles,
        missed: a.missed + b.missed,
        late_answers: a.late_answers + b.late_answers,
        skipped: a.skipped + b.skipped,
        tx_lost: a.tx_lost + b.tx_lost,
        unusable: a.unusable + b.unusable,
        replies_lost: a.replies_lost + b.replies_lost,
        overruns: a.overruns + b.overruns,
        ..*b
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND_NS: u64 = 1_000_000_000;

    #[test]
    fn a_hot_motor_is_reported_once_per_five_degrees_and_again_after_a_pause() {
        let mut report = TemperatureReport::default();
        let mut is_new = |celsius, second| {
            let warning = TemperatureWarning {
                celsius,
                torque_share: 1.0,
            };
            report.is_new(&warning, second * SECOND_NS)
        };
        assert!(is_new(70, 1));
        assert!(!is_new(71, 2) && !is_new(70, 30) && !is_new(74, 80));
        assert!(is_new(75, 81));
        assert!(!is_new(72, 82));
        assert!(is_new(70, 150));
    }
}
