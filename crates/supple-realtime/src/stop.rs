//! Shutdown request: SIGINT, SIGTERM or SIGHUP, or the end of the parent process.

use crate::supported::listen_for_support;
use rustix::process::{Signal, set_parent_process_death_signal};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Error: the signal handlers cannot be installed.
#[derive(Debug, thiserror::Error)]
#[error("the signal handlers cannot be installed: {0}")]
pub struct StopError(#[from] ctrlc::Error);

/// Shutdown flag. Clones share the same flag.
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Installs signal handlers that request shutdown. Call it once per process.
    ///
    /// # Errors
    /// [`StopError`] if it was called before or the system refuses.
    pub fn on_signals() -> Result<Stop, StopError> {
        ignore_file_size_and_tty_signals();
        listen_for_support();
        let stop = Stop::default();
        let flag = stop.clone();
        ctrlc::set_handler(move || flag.request_shutdown())?;
        Ok(stop)
    }

    /// Requests shutdown.
    pub fn request_shutdown(&self) {
        self.0.store(true, Ordering::Release);
    }

    /// Whether shutdown was requested.
    pub fn shutdown_requested(&self) -> bool {
        self.0.load(Ordering::Acquire)
    }
}

/// Ignores SIGXFSZ, so that exceeding the file size limit is a write error and does not end the process, and SIGTTOU,
/// so that a background process may write to its terminal. Child processes inherit both.
pub fn ignore_file_size_and_tty_signals() {
    for signal in [libc::SIGXFSZ, libc::SIGTTOU] {
        // SAFETY: ignoring a signal runs none of our code.
        unsafe { libc::signal(signal, libc::SIG_IGN) };
    }
}

/// Requests a SIGTERM for this process when its parent process ends for any reason.
pub fn die_with_parent() {
    // If this fails, the process continues after its parent is killed; the next start then reports a second writer.
    let _ = set_parent_process_death_signal(Some(Signal::TERM));
}
