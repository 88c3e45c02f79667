//! The helper's thread: the ports to the outside. It waits for nobody: disks and standard error have threads of their
//! own.

use crate::error::RtError;
use crate::fault_file::{FaultFiles, LastCycles};
use crate::options::Options;
use crate::rings::Outside;
use core::fmt::Display;
use core::time::Duration;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::{Builder, JoinHandle};
use supple_core::Vector;
use supple_core::controller::{Controller, Mode, Refusal, plan};
use supple_ipc::message::{MAX_DOF, OperatorReply, OperatorRequest, Outcome, Text};
use supple_ipc::{Domain, Full, IpcError, OutsideLink, pause};
use supple_realtime::diagnostics;

/// How often the helper looks.
const LOOK_EVERY: Duration = Duration::from_millis(1);
/// Most of one kind that is done before the others have their turn.
const MOST: usize = 256;
/// Folder for faults beside the system's sockets.
const FAULTS: &str = "faults";
/// How long the end waits for a disk.
const DISK_WITHIN: Duration = Duration::from_secs(2);

/// Looks along a motion that is asked for, from the pose that the arm is in: whether it can be carried out over its
/// whole length ([`supple_core::controller::plan()`]).
pub type Planner = Box<dyn Fn(&OperatorRequest, &[f64; MAX_DOF]) -> Result<(), Refusal> + Send>;

/// A planner for an arm of `N` joints. What is no request is left to the loop, which says so.
pub fn planner<const N: usize>(controller: Controller<N>) -> Planner {
    Box::new(move |message, from_rad| match message.request::<N>() {
        Ok(Some(request)) => {
            let from_rad = Vector::from_fn(|i, _| from_rad[i]);
            plan(&controller, &from_rad, &request)
        }
        _ => Ok(()),
    })
}

/// The helper at work.
#[derive(Debug)]
pub struct Helper {
    thread: JoinHandle<Result<(), IpcError>>,
}

impl Helper {
    /// Starts it and waits until it has its ports. `planner` looks along the motions that are asked for.
    ///
    /// # Errors
    /// [`RtError::Ipc`] where the ports are not to be had, [`RtError::Thread`].
    pub fn start(
        domain: &Domain,
        outside: Outside,
        options: &Options,
        planner: Planner,
    ) -> Result<Helper, RtError> {
        let full = match options.virtual_time {
            true => Full::Wait,
            false => Full::Lose,
        };
        let folder = options.fault_dir.clone();
        let folder = folder.unwrap_or_else(|| domain.folder().join(FAULTS));
        let files = FaultFiles::start(folder).map_err(RtError::Thread)?;
        let domain = domain.clone();
        let (ready, is_ready) = sync_channel(1);
        let thread = Builder::new()
            .name("supple-rt-helper".to_owned())
            .spawn(move || work(&domain, full, outside, files, planner, &ready))
            .map_err(RtError::Thread)?;
        let helper = Helper { thread };
        match is_ready.recv() {
            Ok(()) => Ok(helper),
            // It ended before it was ready, and says why.
            Err(_) => helper.finish().and(Err(RtError::Helper)),
        }
    }

    /// Waits until everything of a loop that has ended is told.
    ///
    /// # Errors
    /// [`RtError::Ipc`] where it never had its ports, [`RtError::Helper`] where it ended by a defect.
    pub fn finish(self) -> Result<(), RtError> {
        match self.thread.join() {
            Ok(worked) => Ok(worked?),
            Err(_) => Err(RtError::Helper),
        }
    }
}

fn work(
    domain: &Domain,
    full: Full,
    outside: Outside,
    files: FaultFiles,
    planner: Planner,
    ready: &SyncSender<()>,
) -> Result<(), IpcError> {
    let link = OutsideLink::new(domain, full)?;
    // Nobody waits for it any more only where the start was given up.
    let _ = ready.send(());
    let mut desk = Desk {
        link,
        outside,
        last_cycles: LastCycles::new(files),
        planner,
        position_rad: None,
        failed: false,
        told_of_states: false,
    };
    loop {
        desk.outside.pulse.beat();
        let ended = desk.outside.ended();
        desk.requests();
        desk.telemetry();
        desk.replies();
        if ended {
            desk.last_cycles.finish(DISK_WITHIN);
            return Ok(());
        }
        pause(LOOK_EVERY);
    }
}

/// The ports with what is handed over at them. A port that fails ends nothing: the next message tries it again.
struct Desk {
    link: OutsideLink,
    outside: Outside,
    last_cycles: LastCycles,
    planner: Planner,
    /// Where the arm was last.
    position_rad: Option<[f64; MAX_DOF]>,
    failed: bool,
    told_of_states: bool,
}

impl Desk {
    fn requests(&mut self) {
        for _ in 0..MOST {
            let request = match self.link.request() {
                Ok(Some(request)) => request,
                Ok(None) => break,
                Err(error) => return self.port_failed(&error),
            };
            // One that waits for its cycle begins from a pose that nobody knows yet.
            if let (Some(from_rad), 0) = (&self.position_rad, request.has_at_cycle)
                && let Err(refusal) = (self.planner)(&request, from_rad)
            {
                let text = refusal.to_string();
                self.reply(&early(&request, Outcome::Refused, &text));
                continue;
            }
            let handed_in = self.outside.request(request);
            match (handed_in, request.has_at_cycle != 0) {
                // The loop hears it before the step of its cycle, whenever that is.
                (true, true) => self.reply(&early(&request, Outcome::Queued, "")),
                (true, false) => {}
                (false, _) => {
                    let text = "refused: too many requests at once";
                    self.reply(&early(&request, Outcome::Refused, text));
                }
            }
        }
    }

    fn telemetry(&mut self) {
        for _ in 0..MOST {
            let Some(telemetry) = self.outside.telemetry() else {
                break;
            };
            if let Err(error) = self.link.publish(&telemetry) {
                self.port_failed(&error);
            }
            self.last_cycles.add(&telemetry);
            self.position_rad = Some(telemetry.position_rad);
        }
        if self.outside.states_dropped() > 0 && !self.told_of_states {
            self.told_of_states = true;
            diagnostics::post(
                "supple-rt: warning: arm states are dropped: they are of another arm, or another program than this \
                 system's plant writes them; start every process with the same --arm, and one plant",
            );
        }
    }

    fn replies(&mut self) {
        for _ in 0..MOST {
            let Some(reply) = self.outside.reply() else {
                break;
            };
            self.reply(&reply);
        }
    }

    fn reply(&mut self, reply: &OperatorReply) {
        if let Err(error) = self.link.reply(reply) {
            self.port_failed(&error);
        }
    }

    /// Says so once.
    fn port_failed(&mut self, error: &dyn Display) {
        if !self.failed {
            self.failed = true;
            diagnostics::post(format_args!("supple-rt: warning: {error}"));
        }
    }
}

/// A reply that the loop knows nothing of.
fn early(request: &OperatorRequest, outcome: Outcome, text: &str) -> OperatorReply {
    OperatorReply::new(request, 0, Mode::Idle, outcome, Text::of(&text))
}
