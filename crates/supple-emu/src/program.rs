//! The process: an arm held to the wall clock, or advanced by its host.

use crate::config::EmulatorConfig;
use crate::emulator::Emulator;
use crate::error::EmulatorError;
use crate::options::Options;
use crate::pendant::PendantSocket;
use crate::puck::Puck;
use clap::Parser;
use std::process::ExitCode;
use supple_bus::virtual_time::{Peer, Responder};
use supple_bus::{
    Address, Bus, BusError, BusFault, DatagramBus, Event, OwnerFolder, Pacer, SocketCan,
    monotonic_ns,
};
use supple_model::{Description, with_dof};
use supple_plant::{PlantConfig, Sample, Scene, TraceFile};
use supple_puck::NodeId;
use supple_puck::status::MotorMode;
use supple_realtime::{Stop, diagnostics, die_with_parent, enter};

/// A stretch of the wall clock in which this process did not run; the arm stood still in it \[ns\].
const GAP_NS: u64 = 50_000_000;
/// The longest wait before the pendant's socket is looked at \[ns\].
const LOOK_NS: u64 = 1_000_000;
/// The same in virtual time, where nothing happens while the host is silent \[ns\].
const IDLE_NS: u64 = 10_000_000;

/// How long the motors may take to come to rest at the end \[ns\].
const REST_WITHIN_NS: u64 = 300_000_000;

/// How long it goes on once they have \[ns\].
const HEARD_WITHIN_NS: u64 = 50_000_000;

/// The whole program, from its arguments to its exit code.
pub fn main() -> ExitCode {
    let options = Options::parse();
    diagnostics::start();
    match start(&options) {
        Ok(()) => ExitCode::SUCCESS,
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
    let description = Description::find(&options.arm)?.strict_if(options.strict)?;
    // Who supervises has said them.
    for warning in description
        .warnings()
        .iter()
        .filter(|_| !options.supervised())
    {
        eprintln!("supple-emu: warning: {warning}");
    }
    with_dof!(description.dof(), N => run::<N>(&description, options, &stop))?
}

/// Runs until it is asked to end.
fn run<const N: usize>(
    description: &Description,
    options: &Options,
    stop: &Stop,
) -> Result<(), EmulatorError> {
    let mut config = EmulatorConfig::wam(N);
    config.zeroed = options.zeroed;
    config.force_sensor = !options.no_sensor;
    let mut plant = PlantConfig::<N>::from_description(description)?;
    if let Some(face_m) = options.block_m {
        plant.scene = Scene::beneath(face_m);
    }
    let start_ns = if options.virtual_time {
        0
    } else {
        monotonic_ns()
    };
    let mut emulator = Emulator::new(config, plant, description.home::<N>()?, start_ns)?;
    emulator.inject(&options.inject, description.config::<N>()?.period_s)?;
    for later in &options.press {
        later.plan(&mut emulator, start_ns);
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
    for shortfall in enter(&options.realtime()) {
        diagnostics::post(format_args!("supple-emu: warning: {shortfall}"));
    }
    let mut arm = Arm {
        emulator,
        pendant,
        trace,
        ends_ns: None,
        at_rest: false,
    };
    let ran = match (&address, options.virtual_time) {
        (Address::Folder(_), true) => arm.follow(Responder::open(&folder)?, stop),
        (Address::Folder(_), false) => {
            let now_ns = arm.emulator.now_ns();
            arm.pace(Pacer::open(&folder, now_ns)?, stop)
        }
        (Address::Interface(name), false) => arm.keep_pace(SocketCan::open(name)?, stop),
        (Address::Interface(_), true) => Err(EmulatorError::VirtualInterface),
    };
    ran?;
    match arm.trace.take() {
        Some(trace) => Ok(trace.finish()?),
        None => Ok(()),
    }
}

/// The arm's end of a bus by the wall clock.
pub trait ArmsEnd: Bus {
    /// The host is to see an error frame.
    ///
    /// # Errors
    /// Where the bus is gone.
    fn fault(&mut self, fault: BusFault) -> Result<(), BusError>;
}

impl ArmsEnd for DatagramBus {
    fn fault(&mut self, fault: BusFault) -> Result<(), BusError> {
        self.send_fault(fault)
    }
}

impl ArmsEnd for SocketCan {
    fn fault(&mut self, fault: BusFault) -> Result<(), BusError> {
        self.send_fault(fault)
    }
}

/// Lets an arm catch up with its bus's clock, and hands what it says to the bus. A time in which the
/// process stood still is left out: the arm stood still with it.
///
/// # Errors
/// Where the bus is gone.
pub fn catch_up<const N: usize>(
    emulator: &mut Emulator<N>,
    bus: &mut impl ArmsEnd,
) -> Result<(), BusError> {
    let now_ns = bus.now_ns();
    let behind_ns = now_ns.saturating_sub(emulator.now_ns());
    if behind_ns > GAP_NS {
        emulator.skip(behind_ns);
    }
    while let Some(event) = emulator.run_until(now_ns) {
        match event {
            // A host that does not read loses what it is told, as on a cable.
            Event::Frame(frame) => match bus.send(&frame) {
                Ok(()) | Err(BusError::Full) => {}
                Err(error) => return Err(error),
            },
            Event::Fault(fault) => bus.fault(fault)?,
            Event::Sent(_) => {}
        }
    }
    Ok(())
}

/// Waits for a frame of the host until the arm has something to do by itself, at most for a millisecond.
///
/// # Errors
/// Where the bus is gone.
pub fn listen<const N: usize>(
    emulator: &mut Emulator<N>,
    bus: &mut impl ArmsEnd,
) -> Result<(), BusError> {
    let until_ns = emulator.next_ns().min(bus.now_ns() + LOOK_NS);
    if let Some(Event::Frame(frame)) = bus.receive_until(until_ns)?
        && frame.id().from() == NodeId::HOST
    {
        catch_up(emulator, bus)?;
        emulator.host_sends(&frame);
    }
    Ok(())
}

struct Arm<const N: usize> {
    emulator: Emulator<N>,
    pendant: PendantSocket,
    trace: Option<TraceFile>,
    /// When it ends at the latest, once asked to \[ns\].
    ends_ns: Option<u64>,
    /// Its motors were at rest when it was to end.
    at_rest: bool,
}

impl<const N: usize> Arm<N> {
    fn look(&mut self) {
        self.pendant.answer(&mut self.emulator);
        if let Some(trace) = &mut self.trace {
            let arm = &mut self.emulator;
            let modes = arm.pucks().iter().map(Puck::mode);
            let sample = Sample {
                time_ns: arm.wall_ns(),
                active: modes.filter(|mode| *mode == MotorMode::Torque).count(),
                torque_nm: arm.motor_torque_nm().into(),
                mode: None,
                fault: None,
                injections: arm.injections_begun(),
            };
            trace.note(&sample, arm.plant_mut());
        }
    }

    /// It is asked to end, and its motors have come to rest or had the time for it: an arm does not go away
    /// from under those who are lowering it.
    fn ends(&mut self, stop: &Stop) -> bool {
        if !stop.asked() {
            return false;
        }
        let now_ns = monotonic_ns();
        let until_ns = self.ends_ns.get_or_insert(now_ns + REST_WITHIN_NS);
        let mut pucks = self.emulator.pucks().iter();
        if pucks.all(|puck| puck.mode() != MotorMode::Torque) && !self.at_rest {
            // Their host is still to hear of it.
            self.at_rest = true;
            *until_ns = (*until_ns).min(now_ns + HEARD_WITHIN_NS);
        }
        now_ns > *until_ns
    }

    /// By the wall clock, on a CAN interface.
    fn keep_pace(&mut self, mut bus: impl ArmsEnd, stop: &Stop) -> Result<(), EmulatorError> {
        while !self.ends(stop) {
            catch_up(&mut self.emulator, &mut bus)?;
            self.look();
            listen(&mut self.emulator, &mut bus)?;
        }
        Ok(())
    }

    /// By the wall clock, on sockets.
    fn pace(&mut self, mut pacer: Pacer, stop: &Stop) -> Result<(), EmulatorError> {
        while !self.ends(stop) {
            pacer.turn(&mut self.emulator)?;
            self.emulator.set_offset_ns(pacer.offset_ns());
            self.look();
        }
        Ok(())
    }

    /// As far as the host says.
    fn follow(&mut self, mut responder: Responder, stop: &Stop) -> Result<(), EmulatorError> {
        while !self.ends(stop) {
            responder.serve(&mut self.emulator, IDLE_NS)?;
            self.look();
        }
        Ok(())
    }
}
