//! The process with an arm of Damiao motors.

use super::arm::{DamiaoArm, MotorEvent};
use super::config::DamiaoConfig;
use crate::error::EmulatorError;
use crate::options::{Options, StartPose};
use crate::process::{ArmProcess, serve};
use crate::real_time::EmulatedArm;
use supple_bus::Address;
use supple_bus::virtual_time::EmulatedNodes;
use supple_can_frame::CanFrame;
use supple_core::Vector;
use supple_damiao::Status;
use supple_model::Description;
use supple_plant::{Sample, TraceFile};
use supple_process::Program;
use supple_realtime::{Stop, diagnostics, monotonic_ns};

impl<const N: usize> EmulatedArm for DamiaoArm<N> {
    fn next_ns(&self) -> u64 {
        DamiaoArm::next_ns(self)
    }

    fn shift_clock(&mut self, gap_ns: u64) {
        DamiaoArm::shift_clock(self, gap_ns);
    }

    fn set_offset_ns(&mut self, offset_ns: u64) {
        DamiaoArm::set_offset_ns(self, offset_ns);
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
    let plant = options.simulation.config::<N>(description)?;
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
    let start_ns = if options.process.virtual_time {
        0
    } else {
        monotonic_ns()
    };
    let stow = stow_rad.map(|stow_rad| (stow_rad, soft_zone_rad));
    let mut arm = DamiaoArm::new(config, plant, start_rad, stow, start_ns)?;
    arm.inject(
        &options.simulation.inject,
        description.config::<N>()?.period_s,
    )?;
    arm.misbehave(&options.misbehave)?;
    let trace = match &options.simulation.trace {
        Some(path) => Some(TraceFile::create(path, N)?),
        None => None,
    };
    let own = Address::of_system(&options.process.prefix)?;
    let address = options.bus.clone().unwrap_or_else(|| own.clone());
    diagnostics::post(format_args!(
        "supple-emu: {} on {address}",
        description.name()
    ));
    options
        .process
        .apply_realtime(Options::NAME, options.priority);
    let mut process = Process {
        arm,
        trace,
        reported: 0,
    };
    serve(&mut process, &address, options.process.virtual_time, stop)?;
    match process.trace.take() {
        Some(trace) => Ok(trace.finish()?),
        None => Ok(()),
    }
}

struct Process<const N: usize> {
    arm: DamiaoArm<N>,
    trace: Option<TraceFile>,
    /// Number of events that were reported on standard error.
    reported: usize,
}

impl<const N: usize> ArmProcess for Process<N> {
    type Arm = DamiaoArm<N>;

    /// The host lays the arm down first.
    const SHUTDOWN_TIMEOUT_NS: u64 = 30_000_000_000;

    fn arm(&mut self) -> &mut DamiaoArm<N> {
        &mut self.arm
    }

    fn has_torque(&self) -> bool {
        self.enabled() > 0
    }

    fn attend(&mut self) {
        self.write_trace();
        self.report_events();
    }
}

impl<const N: usize> Process<N> {
    fn enabled(&self) -> usize {
        let motors = self.arm.motors().iter();
        motors
            .filter(|motor| motor.status() == Status::Enabled)
            .count()
    }

    /// Reports the events since the last call.
    fn report_events(&mut self) {
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
}
