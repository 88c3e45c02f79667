//! The controller as a realtime process: waits for an arm state, runs `step`, publishes torques.
//!
//! The loop's thread has only the ports to the plant; after its start it allocates nothing, locks nothing and logs
//! nothing ([`ControlLoop`]). Its helper has the ports to the outside: telemetry, requests, replies ([`Helper`]). A third
//! thread hears requests for idle and nothing else ([`IdleWatch`]). Disk and standard error have threads of their own,
//! which the others never wait for. Between them are rings of fixed size. Where the helper or the watch is gone, nobody
//! is heard any more: the loop leaves in order, and the process ends with an error. Where
//! a service manager watches the process, one thread more tells it that loop and helper go on
//! ([`supple_realtime::Heartbeat`]).
//!
//! It knows no bus, no log format, no simulator. The plant owns the clock; in virtual time the loop waits for
//! the plant however long it takes, and nothing it computes depends on a clock in either case.

mod control_loop;
mod error;
mod fault_file;
mod helper;
mod idle_watch;
mod options;
mod queue;
mod rings;
mod timing;

pub use control_loop::{ControlLoop, PLANT_LOST_AFTER};
pub use error::RtError;
pub use fault_file::{FaultFiles, KEPT_CYCLES, KEPT_FILES, LastCycles};
pub use helper::{Helper, Planner, planner};
pub use idle_watch::IdleWatch;
pub use options::Options;
pub use queue::{NoPlace, Queue};
pub use rings::{IdleInside, IdleOutside, Inside, Outside, idle_path, rings};
pub use timing::{Spread, Timing};

use clap::Parser;
use std::process::ExitCode;
use supple_core::Controller;
use supple_ipc::{ControllerLink, Domain};
use supple_model::{Description, with_dof};
use supple_realtime::{
    Heartbeat, ManagerVariables, Notifier, Stop, diagnostics, die_with_parent, enter,
};

/// The whole program, from its arguments to its exit code.
pub fn main() -> ExitCode {
    let options = Options::parse();
    diagnostics::start();
    let stop = match Stop::on_signals() {
        Ok(stop) => stop,
        Err(error) => return complain(&error.into()),
    };
    if options.supervised() {
        die_with_parent();
    }
    let description = match options.description() {
        Ok(description) => description,
        Err(error) => return complain(&error.into()),
    };
    // Who supervises has said them.
    for warning in description
        .warnings()
        .iter()
        .filter(|_| !options.supervised())
    {
        eprintln!("supple-rt: warning: {warning}");
    }
    let ran = with_dof!(description.dof(), N => run::<N>(&description, &options, &stop));
    match ran.map_err(RtError::from).and_then(|ran| ran) {
        Ok(timing) => {
            diagnostics::post(format_args!("supple-rt: {timing}"));
            diagnostics::flush();
            ExitCode::SUCCESS
        }
        Err(error) => complain(&error),
    }
}

fn complain(error: &RtError) -> ExitCode {
    diagnostics::post(format_args!("supple-rt: error: {error}"));
    diagnostics::flush();
    ExitCode::from(error.code())
}

/// Runs until it is asked to end; gives how it kept its time.
///
/// # Errors
/// [`RtError`]: an arm that is not sound, shared memory that cannot be used, an arm state of another arm.
pub fn run<const N: usize>(
    description: &Description,
    options: &Options,
    stop: &Stop,
) -> Result<Timing, RtError> {
    let controller = Controller::new(description.config::<N>()?)?;
    let domain = Domain::new(options.prefix.as_deref())?;
    let notifier = Notifier::new(&ManagerVariables::of_process())?;
    let link = ControllerLink::new(&domain)?;
    let (inside, outside) = rings();
    let pulses = [inside.pulse(), outside.pulse()];
    let helper = Helper::start(&domain, outside, options, planner(controller))?;
    let (idle_inside, idle_outside) = idle_path();
    let watch = IdleWatch::start(&domain, idle_outside, options.realtime())?;
    let mut control = ControlLoop::new(controller, inside, options.virtual_time);
    let heartbeat = notifier.map(|notifier| Heartbeat::start(notifier, &pulses));
    let heartbeat = heartbeat.transpose()?;
    control.hear_idle(idle_inside);
    for shortfall in enter(&options.realtime()) {
        diagnostics::post(format_args!("supple-rt: warning: {shortfall}"));
    }
    let ended = control.run(&link, stop);
    drop(heartbeat);
    let timing = control.into_timing();
    helper.finish()?;
    watch.finish()?;
    ended.map(|()| timing)
}
