//! The process with an arm of Damiao motors: in real time, or as its host advances it.

use super::arm::{DamiaoArm, MotorEvent};
use super::config::DamiaoConfig;
use crate::error::EmulatorError;
use crate::options::{Options, StartPose};
use crate::real_time::{EmulatedArm, advance_to_bus_time, receive_host_frame};
use supple_bus::virtual_time::{EmulatedNodes, LockstepResponder};
use supple_bus::{Address, OwnerFolder, PacedResponder, SocketCan};
use supple_can_frame::CanFrame;
use supple_core::Vector;
use supple_damiao::Status;
use supple_model::Description;
use supple_plant::{PlantConfig, PlantOptions, Sample, Scene, TraceFile};
use supple_realtime::{Stop, apply_realtime_settings, diagnostics, monotonic_ns};

/// Maximum wait in virtual time, which pauses while the host is silent \[ns\].
const IDLE_NS: u64 = 10_000_000;
/// Time for which the process serves its host after a shutdown was requested \[ns\]: the host lays the arm down first.
const SHUTDOWN_TIMEOUT_NS: u64 = 30_000_000_000;
/// Time for which it continues after all motors are disabled \[ns\].
const FINAL_REPORT_NS: u64 = 50_000_000;

impl<const N: usize> EmulatedArm for DamiaoArm<N> {
    fn next_ns(&self) -> u64 {
        DamiaoArm::next_ns(self)
    }

    fn shift_clock(&mut self, gap_ns: u64) {
        DamiaoArm::shift_clock(self, gap_ns);
    }

    fn is_from_host(&self, _: &CanFrame) -> bool {
        true
    }
}

/// Runs until a shutdown is requested.
pub(crate) fn run<const N: usize>(
    description: &Description,
    options: &Options,
    stop: &Stop,
) -> Result<(), EmulatorError> {
    for (given, option) in [
        (options.zeroed, "--zeroed"),
        (!options.press.is_empty(), "--press"),
        (options.no_sensor, "--no-sensor"),
    ] {
        if given {
            return Err(EmulatorError::NotForThisArm { option });
        }
    }
    let missing = |section| EmulatorError::Missing {
        arm: description.name().to_owned(),
        section,
    };
    let bus = description.bus().ok_or(missing("[bus]"))?;
    let mut config = DamiaoConfig::expected(bus);
    config.allow_flash = options.allow_flash;
    let effects = PlantOptions::chosen(
        description,
        options.plant_options.as_deref(),
        options.realistic,
    )?;
    let mut plant = effects.apply(PlantConfig::<N>::from_description(description)?)?;
    if let Some(face_m) = options.block_m {
        plant.scene = Scene::with_block_at(face_m);
    }
    let soft_zone_rad = description.settings().limits.soft_zone_rad;
    let stow_rad = description.stow_rad().map(Vector::from_column_slice);
    let start_rad = match options.start {
        StartPose::Home => description.home::<N>()?,
        StartPose::Stow => {
            // On its stops nothing needs to hold the arm.
            config.supported = false;
            stow_rad.ok_or(missing("stow_rad"))?
        }
    };
    let start_ns = if options.virtual_time {
        0
    } else {
        monotonic_ns()
    };
    let stow = stow_rad.map(|stow_rad| (stow_rad, soft_zone_rad));
    let mut arm = DamiaoArm::new(config, plant, start_rad, stow, start_ns)?;
    arm.inject(&options.inject, description.config::<N>()?.period_s)?;
    arm.misbehave(&options.misbehave)?;
    let trace = match &options.trace {
        Some(path) => Some(TraceFile::create(path, N)?),
        None => None,
    };
    let own = Address::of_system(&options.prefix)?;
    let address = options.bus.clone().unwrap_or_else(|| own.clone());
    diagnostics::post(format_args!(
        "supple-emu: {} on {address}",
        description.name()
    ));
    for realtime_warning in apply_realtime_settings(&options.realtime()) {
        diagnostics::post(format_args!("supple-emu: warning: {realtime_warning}"));
    }
    let mut process = Process {
        arm,
        trace,
        until_ns: None,
        disabled: false,
        reported: 0,
    };
    match (&address, options.virtual_time) {
        (Address::Folder(folder), true) => {
            let mut responder = LockstepResponder::open(&OwnerFolder::open(folder.clone())?)?;
            while !process.is_finished(stop) {
                responder.serve(&mut process.arm, IDLE_NS)?;
                process.report();
            }
        }
        (Address::Folder(folder), false) => {
            let folder = OwnerFolder::open(folder.clone())?;
            let mut responder = PacedResponder::open(&folder, start_ns)?;
            while !process.is_finished(stop) {
                responder.serve(&mut process.arm)?;
                process.arm.set_offset_ns(responder.offset_ns());
                process.report();
            }
        }
        (Address::Interface(name), false) => {
            let mut can = SocketCan::open(name)?;
            while !process.is_finished(stop) {
                advance_to_bus_time(&mut process.arm, &mut can)?;
                process.report();
                receive_host_frame(&mut process.arm, &mut can)?;
            }
        }
        (Address::Interface(_), true) => return Err(EmulatorError::VirtualInterface),
    }
    match process.trace.take() {
        Some(trace) => Ok(trace.finish()?),
        None => Ok(()),
    }
}

struct Process<const N: usize> {
    arm: DamiaoArm<N>,
    trace: Option<TraceFile>,
    /// End of the shutdown, once requested \[ns\].
    until_ns: Option<u64>,
    /// Whether all motors were disabled during the shutdown.
    disabled: bool,
    /// Number of events that were reported on standard error.
    reported: usize,
}

impl<const N: usize> Process<N> {
    fn enabled(&self) -> usize {
        let motors = self.arm.motors().iter();
        motors
            .filter(|motor| motor.status() == Status::Enabled)
            .count()
    }

    /// Writes the trace, and reports new events.
    fn report(&mut self) {
        self.write_trace();
        let events = self.arm.events();
        // By the machine's clock, as the trace.
        let offset_ns = self.arm.monotonic_ns() - self.arm.now_ns();
        for (number, (time_ns, event)) in events.iter().enumerate().skip(self.reported) {
            let time_s = (*time_ns + offset_ns) as f64 * 1e-9;
            match event {
                MotorEvent::Status(index, Status::CommunicationLost) => {
                    let commanded_ns = self.arm.motors()[*index].commanded_ns();
                    let since_ms = (*time_ns - commanded_ns) as f64 * 1e-6;
                    diagnostics::post(format_args!(
                        "supple-emu: {time_s:.4} s: motor {}: no torque, {since_ms:.1} ms after its last command",
                        index + 1
                    ));
                }
                MotorEvent::Status(index, status) if status.is_error() => diagnostics::post(
                    format_args!("supple-emu: {time_s:.4} s: motor {}: {status}", index + 1),
                ),
                MotorEvent::Status(_, status) => {
                    let mut motors = self.arm.motors().iter();
                    if number + 1 == events.len() && motors.all(|motor| motor.status() == *status) {
                        diagnostics::post(format_args!(
                            "supple-emu: {time_s:.4} s: all motors {status}"
                        ));
                    }
                }
                MotorEvent::Flash(index, request) => diagnostics::post(format_args!(
                    "supple-emu: {time_s:.4} s: motor {} writes flash: {request:?}",
                    index + 1
                )),
                MotorEvent::Misbehaves(misbehaviour) => diagnostics::post(format_args!(
                    "supple-emu: {time_s:.4} s: misbehaves: {misbehaviour}"
                )),
            }
        }
        self.reported = self.arm.events().len();
    }

    fn write_trace(&mut self) {
        let active = self.enabled();
        if let Some(trace) = &mut self.trace {
            let sample = Sample {
                time_ns: self.arm.monotonic_ns(),
                active,
                torque_nm: self.arm.motor_torque_nm().into(),
                mode: None,
                fault: None,
                injections: self.arm.injections_begun(),
            };
            trace.write_sample(&sample, self.arm.plant_mut());
        }
    }

    fn is_finished(&mut self, stop: &Stop) -> bool {
        if !stop.shutdown_requested() {
            return false;
        }
        let now_ns = monotonic_ns();
        let none_enabled = self.enabled() == 0;
        let until_ns = self.until_ns.get_or_insert(now_ns + SHUTDOWN_TIMEOUT_NS);
        if none_enabled && !self.disabled {
            // The host must still receive the last replies.
            self.disabled = true;
            *until_ns = (*until_ns).min(now_ns + FINAL_REPORT_NS);
        }
        now_ns > *until_ns
    }
}
