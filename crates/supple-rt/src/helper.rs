//! The helper's thread: everything of the controller's process that may wait for somebody.

use crate::error::RtError;
use crate::fault_file::LastCycles;
use crate::options::Options;
use crate::rings::Outside;
use core::time::Duration;
use std::path::PathBuf;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::{Builder, JoinHandle};
use supple_core::controller::Mode;
use supple_ipc::message::{OperatorReply, OperatorRequest, Outcome, Text};
use supple_ipc::{Domain, Full, IpcError, OutsideLink, pause};

/// How often the helper looks.
const LOOK_EVERY: Duration = Duration::from_millis(1);
/// Folder for faults beside the system's sockets.
const FAULTS: &str = "faults";

/// The helper at work.
#[derive(Debug)]
pub struct Helper {
    thread: JoinHandle<Result<(), IpcError>>,
}

impl Helper {
    /// Starts it and waits until it has its ports.
    ///
    /// # Errors
    /// [`RtError::Ipc`] where the ports are not to be had, [`RtError::Thread`].
    pub fn start(domain: &Domain, outside: Outside, options: &Options) -> Result<Helper, RtError> {
        let full = match options.virtual_time {
            true => Full::Wait,
            false => Full::Lose,
        };
        let folder = options.fault_dir.clone();
        let folder = folder.unwrap_or_else(|| domain.folder().join(FAULTS));
        let domain = domain.clone();
        let (ready, is_ready) = sync_channel(1);
        let thread = Builder::new()
            .name("supple-rt-helper".to_owned())
            .spawn(move || work(&domain, full, outside, folder, &ready))
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
    /// [`RtError::Ipc`] where something could not be told.
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
    mut outside: Outside,
    folder: PathBuf,
    ready: &SyncSender<()>,
) -> Result<(), IpcError> {
    let link = OutsideLink::new(domain, full)?;
    let mut last_cycles = LastCycles::new(folder);
    // Nobody waits for it any more only where the start was given up.
    let _ = ready.send(());
    loop {
        outside.pulse.beat();
        let ended = outside.ended();
        while let Some(telemetry) = outside.telemetry() {
            link.publish(&telemetry)?;
            last_cycles.add(&telemetry);
        }
        while let Some(reply) = outside.reply() {
            link.reply(&reply)?;
        }
        while let Some(request) = link.request()? {
            let handed_in = outside.request(request);
            match (handed_in, request.has_at_cycle != 0) {
                // The loop hears it before the step of its cycle, whenever that is.
                (true, true) => link.reply(&early(&request, Outcome::Queued, ""))?,
                (true, false) => {}
                (false, _) => {
                    let text = "refused: too many requests at once";
                    link.reply(&early(&request, Outcome::Refused, text))?;
                }
            }
        }
        if ended {
            return Ok(());
        }
        pause(LOOK_EVERY);
    }
}

/// A reply that the loop knows nothing of.
fn early(request: &OperatorRequest, outcome: Outcome, text: &str) -> OperatorReply {
    OperatorReply::new(request, 0, Mode::Idle, outcome, Text::of(&text))
}
