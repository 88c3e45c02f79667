//! The process: runs the emulated arm in real time, or as its host advances it.

use crate::config::EmulatorConfig;
use crate::emulator::Emulator;
use crate::error::EmulatorError;
use crate::options::Options;
use crate::pendant::PendantSocket;
use crate::puck::Puck;
use crate::real_time::{ArmBus, EmulatedArm, advance_to_bus_time, receive_host_frame};
use clap::Parser;
use std::process::ExitCode;
use supple_bus::virtual_time::{EmulatedNodes, LockstepResponder};
use supple_bus::{Address, OwnerFolder, PacedResponder, SocketCan};
use supple_can_frame::CanFrame;
use supple_model::{Description, with_dof};
use supple_plant::{PlantConfig, PlantOptions, Sample, Scene, TraceFile};
use supple_puck::status::MotorMode;
use supple_puck::{MessageId, NodeId};
use supple_realtime::{Stop, apply_realtime_settings, diagnostics, die_with_parent, monotonic_ns};

/// Maximum wait in virtual time, which pauses while the host is silent \[ns\].
const IDLE_NS: u64 = 10_000_000;

/// Maximum time until the motors are idle at shutdown \[ns\].
const SHUTDOWN_TIMEOUT_NS: u64 = 300_000_000;

/// Time for which it continues after that \[ns\].
const FINAL_REPORT_NS: u64 = 50_000_000;

/// The whole program, from its arguments to its exit code.
pub fn main() -> ExitCode {
    let options = Options::parse();
    diagnostics::start();
    match start(&options) {
        Ok(()) => {
            diagnostics::flush();
            ExitCode::SUCCESS
        }
        Err(error) => {
            diagnostics::post(format_args!("supple-emu: error: {error}"));
            diagnostics::flush();
            ExitCode::from(error.code())
        }
    }
}

fn start(options: &Options) -> Result<(), EmulatorError> {
    let stop = Stop::on_signals()?;
    if options.supervised() {
        die_with_parent();
    }
    let description = options.description()?;
    // The supervising process has already printed the warnings.
    for warning in description
        .warnings()
        .iter()
        .filter(|_| !options.supervised())
    {
        diagnostics::post(format_args!("supple-emu: warning: {warning}"));
    }
    with_dof!(description.dof(), N => match description.bus() {
        Some(_) => crate::damiao::run::<N>(&description, options, &stop),
        None => run::<N>(&description, options, &stop),
    })?
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
    let effects = PlantOptions::chosen(
        description,
        options.plant_options.as_deref(),
        options.realistic,
    )?;
    let mut plant = effects.apply(PlantConfig::<N>::from_description(description)?)?;
    if let Some(face_m) = options.block_m {
        plant.scene = Scene::with_block_at(face_m);
    }
    let start_ns = if options.virtual_time {
        0
    } else {
        monotonic_ns()
    };
    let mut emulator = Emulator::new(config, plant, description.home::<N>()?, start_ns)?;
    emulator.inject(&options.inject, description.config::<N>()?.period_s)?;
    for scheduled in &options.press {
        scheduled.schedule(&mut emulator, start_ns);
    }
    let trace = match &options.trace {
        Some(path) => Some(TraceFile::create(path, N)?),
        None => None,
    };
    let own = Address::of_system(&options.prefix)?;
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
    for realtime_warning in apply_realtime_settings(&options.realtime()) {
        diagnostics::post(format_args!("supple-emu: warning: {realtime_warning}"));
    }
    let mut arm = Arm {
        emulator,
        pendant,
        trace,
        deadline_ns: None,
        at_rest: false,
    };
    let result = match (&address, options.virtual_time) {
        (Address::Folder(_), true) => arm.run_in_lockstep(LockstepResponder::open(&folder)?, stop),
        (Address::Folder(_), false) => {
            let now_ns = arm.emulator.now_ns();
            arm.run_on_sockets(PacedResponder::open(&folder, now_ns)?, stop)
        }
        (Address::Interface(name), false) => arm.run_on_can(SocketCan::open(name)?, stop),
        (Address::Interface(_), true) => Err(EmulatorError::VirtualInterface),
    };
    result?;
    match arm.trace.take() {
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

    fn is_from_host(&self, frame: &CanFrame) -> bool {
        MessageId::of(frame).is_none_or(|id| id.from() == NodeId::HOST)
    }
}

struct Arm<const N: usize> {
    emulator: Emulator<N>,
    pendant: PendantSocket,
    trace: Option<TraceFile>,
    /// Deadline of the shutdown, once requested \[ns\].
    deadline_ns: Option<u64>,
    /// Whether the motors have become idle during shutdown.
    at_rest: bool,
}

impl<const N: usize> Arm<N> {
    fn serve_pendant(&mut self) {
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

    /// Whether to end: shutdown was requested, and the motors are idle or the timeout has passed, so that the
    /// host can complete its own shutdown first.
    fn is_finished(&mut self, stop: &Stop) -> bool {
        if !stop.shutdown_requested() {
            return false;
        }
        let now_ns = monotonic_ns();
        let until_ns = self.deadline_ns.get_or_insert(now_ns + SHUTDOWN_TIMEOUT_NS);
        let mut pucks = self.emulator.pucks().iter();
        if pucks.all(|puck| puck.mode() != MotorMode::Torque) && !self.at_rest {
            // The host must still receive the idle mode.
            self.at_rest = true;
            *until_ns = (*until_ns).min(now_ns + FINAL_REPORT_NS);
        }
        now_ns > *until_ns
    }

    /// Runs in real time on a CAN interface.
    fn run_on_can(&mut self, mut bus: impl ArmBus, stop: &Stop) -> Result<(), EmulatorError> {
        while !self.is_finished(stop) {
            advance_to_bus_time(&mut self.emulator, &mut bus)?;
            self.serve_pendant();
            receive_host_frame(&mut self.emulator, &mut bus)?;
        }
        Ok(())
    }

    /// Runs in real time on sockets.
    fn run_on_sockets(
        &mut self,
        mut responder: PacedResponder,
        stop: &Stop,
    ) -> Result<(), EmulatorError> {
        while !self.is_finished(stop) {
            responder.serve(&mut self.emulator)?;
            self.emulator.set_offset_ns(responder.offset_ns());
            self.serve_pendant();
        }
        Ok(())
    }

    /// Runs in lockstep with the host.
    fn run_in_lockstep(
        &mut self,
        mut responder: LockstepResponder,
        stop: &Stop,
    ) -> Result<(), EmulatorError> {
        while !self.is_finished(stop) {
            responder.serve(&mut self.emulator, IDLE_NS)?;
            self.serve_pendant();
        }
        Ok(())
    }
}
