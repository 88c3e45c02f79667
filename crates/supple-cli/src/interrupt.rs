//! Signal handling: removes partial output when a run is interrupted.

use rustix::process::{Pid, PidfdFlags, Signal, pidfd_open, pidfd_send_signal};
use std::os::fd::OwnedFd;
use std::path::PathBuf;
use std::process::Child;
use std::sync::{Mutex, OnceLock};
use supple_realtime::Stop;

/// Exit code after an interrupt, as shells define it.
const INTERRUPTED: i32 = 130;

/// Folder of the results that are being written.
static PARTIAL: Mutex<Option<PathBuf>> = Mutex::new(None);

/// Shutdown request, if a caller handles interrupts itself.
static SHUTDOWN_REQUEST: OnceLock<Stop> = OnceLock::new();

/// Child process to which interrupts are forwarded immediately.
static FORWARD_SIGNAL_TO: Mutex<Option<OwnedFd>> = Mutex::new(None);

/// Makes every further interrupt also end this child at once, before the ordered shutdown reaches the child.
pub fn forward_interrupts_to(child: &Child) {
    let process = i32::try_from(child.id()).ok().and_then(Pid::from_raw);
    // A pidfd refers to this exact process even if its PID is reused. Without a pidfd, the child is terminated during
    // the ordered shutdown.
    let process = process.and_then(|pid| pidfd_open(pid, PidfdFlags::empty()).ok());
    *FORWARD_SIGNAL_TO
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner()) = process;
}

fn forward_interrupt() {
    let first = FORWARD_SIGNAL_TO
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner());
    if let Some(process) = first.as_ref() {
        // Ignore errors: the process may have exited already.
        let _ = pidfd_send_signal(process, Signal::TERM);
    }
}

/// Makes every further interrupt only set the returned shutdown request; the caller shuts down.
pub fn shutdown_on_interrupt() -> Stop {
    SHUTDOWN_REQUEST.get_or_init(Stop::default).clone()
}

/// Sets the folder that is removed if the program is interrupted; `None` removes nothing.
pub fn set_partial_folder(partial: Option<PathBuf>) {
    *PARTIAL
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner()) = partial;
}

/// Installs the signal handler: on SIGINT or SIGTERM it removes the partial folder and exits. Call once.
#[expect(
    clippy::disallowed_methods,
    reason = "an interrupt ends the program immediately, after removing the partial folder"
)]
pub fn install() {
    supple_realtime::ignore_file_size_and_tty_signals();
    supple_realtime::listen_for_support();
    // If the handler cannot be installed, the signal still ends the program, but the folder remains.
    let _ = ctrlc::set_handler(|| {
        if let Some(stop) = SHUTDOWN_REQUEST.get() {
            stop.request_shutdown();
            return forward_interrupt();
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
