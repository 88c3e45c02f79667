//! An interrupted run leaves no half-written folder.

use rustix::process::{Pid, PidfdFlags, Signal, pidfd_open, pidfd_send_signal};
use std::os::fd::OwnedFd;
use std::path::PathBuf;
use std::process::Child;
use std::sync::{Mutex, OnceLock};
use supple_realtime::Stop;

/// Exit code after an interrupt, as shells give it.
const INTERRUPTED: i32 = 130;

/// The folder that is being written.
static PARTIAL: Mutex<Option<PathBuf>> = Mutex::new(None);

/// Somebody ends in order when asked to.
static CAUGHT: OnceLock<Stop> = OnceLock::new();

/// The process that is asked to end at once, whatever this one waits for just then.
static FIRST: Mutex<Option<OwnedFd>> = Mutex::new(None);

/// From now on an interrupt that is caught asks this child to end as well, before whoever ends in order comes to it.
pub fn pass_on_to(child: &Child) {
    let process = i32::try_from(child.id()).ok().and_then(Pid::from_raw);
    // A descriptor means this very process, even when its number is somebody else's. Without one the child is asked to
    // end in its turn.
    let process = process.and_then(|pid| pidfd_open(pid, PidfdFlags::empty()).ok());
    *FIRST
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner()) = process;
}

fn pass_on() {
    let first = FIRST
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner());
    if let Some(process) = first.as_ref() {
        // One that has ended needs no signal.
        let _ = pidfd_send_signal(process, Signal::TERM);
    }
}

/// From now on an interrupt ends nothing by itself: it is asked for, and whoever called this ends in order.
pub fn catch() -> Stop {
    CAUGHT.get_or_init(Stop::default).clone()
}

/// Removes `partial` if the program is interrupted from now on; `None` removes nothing.
pub fn guard(partial: Option<PathBuf>) {
    *PARTIAL
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner()) = partial;
}

/// Ends the program on interrupt and on termination, without what is half written. To be called once.
#[expect(
    clippy::disallowed_methods,
    reason = "an interrupt ends the program at once; what it would leave is removed first"
)]
pub fn install() {
    supple_realtime::keep_running();
    // Without the handler the system ends the program as well, only the folder stays.
    let _ = ctrlc::set_handler(|| {
        if let Some(stop) = CAUGHT.get() {
            stop.ask();
            return pass_on();
        }
        let partial = PARTIAL
            .lock()
            .unwrap_or_else(|poisoned| poisoned.into_inner());
        if let Some(partial) = partial.as_ref() {
            // Runs may still be adding files to it.
            while std::fs::remove_dir_all(partial)
                .is_err_and(|error| error.kind() == std::io::ErrorKind::DirectoryNotEmpty)
            {
            }
        }
        std::process::exit(INTERRUPTED);
    });
}
