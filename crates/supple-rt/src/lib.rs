//! The controller as a realtime process: waits for an arm state, runs `step`, publishes torques.
//!
//! The loop thread has only the ports to the plant; after its start it allocates nothing, locks nothing and logs
//! nothing ([`ControlLoop`]). The helper thread has the ports to the clients: telemetry, requests, replies
//! ([`Helper`]); it also refines the model from the telemetry ([`learning()`]). A third thread receives only idle requests ([`IdleRequestThread`]). Separate threads write to the disk
//! and to standard error; no other thread waits for them. The threads exchange data through lock-free queues of fixed
//! size. If the helper or the idle-request thread ends, no request can be received any more: the loop sets the drives
//! to idle and ends, and the process exits with an error. If a service manager supervises the process, one more thread
//! reports to it that the loop and the helper are alive ([`supple_realtime::Heartbeat`]).
//!
//! It does not depend on a bus, a log format or a simulator. The plant owns the clock; in virtual time the loop waits
//! for the plant without a timeout. The computed torques never depend on a clock.

mod control_loop;
mod deferred;
mod error;
mod fault_file;
mod helper;
mod idle_thread;
mod learning;
mod options;
mod queues;
mod request_queue;
mod timing;

pub use control_loop::{ControlLoop, PLANT_TIMEOUT};
pub use error::RtError;
pub use fault_file::{FaultFiles, FaultRecorder, KEPT_CYCLES, KEPT_FILES};
pub use helper::{Helper, MotionCheck, motion_check};
pub use idle_thread::IdleRequestThread;
pub use learning::{Learning, learning};
pub use options::Options;
pub use queues::{
    HelperQueues, IdleThreadChannel, LoopIdleChannel, LoopQueues, idle_channel, loop_queues,
};
pub use request_queue::{QueueFull, RequestQueue};
pub use timing::{Percentiles, Timing};

use std::process::ExitCode;
use supple_core::Controller;
use supple_ipc::{ControllerLink, Domain};
use supple_model::{Description, with_dof};
use supple_process::{Failure, ProcessOptions, Program, RateOption};
use supple_realtime::{Heartbeat, ManagerVariables, Notifier, Stop};

/// Runs the program: parses the arguments and returns the exit code.
pub fn main() -> ExitCode {
    supple_process::main::<Options>()
}

impl Program for Options {
    const NAME: &'static str = "supple-rt";

    fn process(&self) -> &ProcessOptions {
        &self.process
    }

    fn rate(&self) -> RateOption {
        self.rate
    }

    fn run(&self, description: &Description, stop: &Stop) -> Result<Option<String>, Failure> {
        let timing = with_dof!(description.dof(), N => run::<N>(description, self, stop))?;
        Ok(Some(timing?.to_string()))
    }
}

/// Runs until shutdown is requested; returns the timing statistics.
///
/// # Errors
/// [`RtError`]: an invalid arm, shared memory that cannot be used, an arm state of another arm.
pub fn run<const N: usize>(
    description: &Description,
    options: &Options,
    stop: &Stop,
) -> Result<Timing, RtError> {
    let controller = Controller::new(description.config::<N>()?)?;
    let domain = Domain::new(Some(&options.process.prefix))?;
    let notifier = Notifier::new(&ManagerVariables::from_environment())?;
    let link = ControllerLink::new(&domain)?;
    let (queues, helper_queues) = loop_queues();
    let counters = [queues.liveness(), helper_queues.liveness()];
    let learning = learning::<N>(controller.config(), description, &domain);
    let learning = learning.map_err(RtError::Thread)?;
    let checks = motion_check(controller);
    let helper = Helper::start(&domain, helper_queues, options, checks, learning)?;
    let (loop_channel, thread_channel) = idle_channel();
    let idle_thread = IdleRequestThread::start(
        &domain,
        thread_channel,
        options.process.realtime(options.priority),
    )?;
    let mut control = ControlLoop::new(controller, queues, options.process.virtual_time);
    let heartbeat = notifier.map(|notifier| Heartbeat::start(notifier, &counters));
    let heartbeat = heartbeat.transpose()?;
    control.set_idle_channel(loop_channel);
    options
        .process
        .apply_realtime(Options::NAME, options.priority);
    let result = control.run(&link, stop);
    // In virtual time the plant waits for a controller that exists.
    drop(link);
    drop(heartbeat);
    let timing = control.into_timing();
    helper.finish()?;
    idle_thread.finish()?;
    result.map(|()| timing)
}
