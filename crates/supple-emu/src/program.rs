//! The program: a WAM with its pendant, or an arm of Damiao motors.

use crate::config::EmulatorConfig;
use crate::emulator::Emulator;
use crate::error::EmulatorError;
use crate::options::Options;
use crate::pendant::PendantSocket;
use crate::process::{ArmProcess, serve};
use crate::puck::Puck;
use crate::real_time::EmulatedArm;
use std::process::ExitCode;
use supple_bus::{Address, OwnerFolder};
use supple_can_frame::CanFrame;
use supple_model::{Description, with_dof};
use supple_plant::{Sample, TraceFile};
use supple_process::{Failure, ProcessOptions, Program};
use supple_puck::status::MotorMode;
use supple_puck::{MessageId, NodeId};
use supple_realtime::{Stop, diagnostics, monotonic_ns};

/// Runs the program: parses the arguments and returns the exit code.
pub fn main() -> ExitCode {
    supple_process::main::<Options>()
}

impl Program for Options {
    const NAME: &'static str = "supple-emu";

    fn process(&self) -> &ProcessOptions {
        &self.process
    }

    fn run(&self, description: &Description, stop: &Stop) -> Result<Option<String>, Failure> {
        with_dof!(description.dof(), N => match description.bus() {
            Some(_) => crate::damiao::run::<N>(description, self, stop),
            None => run::<N>(description, self, stop),
        })??;
        Ok(None)
    }
}

/// Runs until a shutdown is requested.
fn run<const N: usize>(
    description: &Description,
    options: &Options,
    stop: &Stop,
) -> Result<(), EmulatorError> {
    let mut config = EmulatorConfig::wam(N);
    config.zeroed = options.zeroed;
    config.force_sensor = !options.no_sensor;
    let plant = options.simulation.config::<N>(description)?;
    let start_ns = if options.process.virtual_time {
        0
    } else {
        monotonic_ns()
    };
    let mut emulator = Emulator::new(config, plant, description.home::<N>()?, start_ns)?;
    let period_s = description.config::<N>()?.period_s;
    emulator.inject(&options.simulation.inject, period_s)?;
    for scheduled in &options.press {
        scheduled.schedule(&mut emulator, start_ns);
    }
    let trace = match &options.simulation.trace {
        Some(path) => Some(TraceFile::create(path, N)?),
        None => None,
    };
    let own = Address::of_system(&options.process.prefix)?;
    let address = options.bus.clone().unwrap_or_else(|| own.clone());
    let folder = OwnerFolder::open(match (&address, &own) {
        (Address::Folder(folder), _) | (_, Address::Folder(folder)) => folder.clone(),
        (Address::Interface(name), _) => name.into(),
    })?;
    let pendant = PendantSocket::open(&folder)?;
    diagnostics::post(format_args!(
        "supple-emu: {} on {address}, pendant at {}",
        description.name(),
        pendant.path().display()
    ));
    options
        .process
        .apply_realtime(Options::NAME, options.priority);
    let mut process = Process {
        emulator,
        pendant,
        trace,
    };
    serve(&mut process, &address, options.process.virtual_time, stop)?;
    match process.trace.take() {
        Some(trace) => Ok(trace.finish()?),
        None => Ok(()),
    }
}

impl<const N: usize> EmulatedArm for Emulator<N> {
    fn next_ns(&self) -> u64 {
        Emulator::next_ns(self)
    }

    fn shift_clock(&mut self, gap_ns: u64) {
        Emulator::shift_clock(self, gap_ns);
    }

    fn set_offset_ns(&mut self, offset_ns: u64) {
        Emulator::set_offset_ns(self, offset_ns);
    }

    fn is_from_host(&self, frame: &CanFrame) -> bool {
        MessageId::of(frame).is_none_or(|id| id.from() == NodeId::HOST)
    }
}

struct Process<const N: usize> {
    emulator: Emulator<N>,
    pendant: PendantSocket,
    trace: Option<TraceFile>,
}

impl<const N: usize> ArmProcess for Process<N> {
    type Arm = Emulator<N>;

    const SHUTDOWN_TIMEOUT_NS: u64 = 300_000_000;

    fn arm(&mut self) -> &mut Emulator<N> {
        &mut self.emulator
    }

    fn has_torque(&self) -> bool {
        let mut pucks = self.emulator.pucks().iter();
        pucks.any(|puck| puck.mode() == MotorMode::Torque)
    }

    fn attend(&mut self) {
        self.pendant.answer(&mut self.emulator);
        if let Some(trace) = &mut self.trace {
            let arm = &mut self.emulator;
            let modes = arm.pucks().iter().map(Puck::mode);
            let sample = Sample {
                time_ns: arm.monotonic_ns(),
                active: modes.filter(|mode| *mode == MotorMode::Torque).count(),
                torque_nm: arm.motor_torque_nm().into(),
                mode: None,
                fault: None,
                injections: arm.injections_begun(),
            };
            trace.write_sample(&sample, arm.plant_mut());
        }
    }
}
