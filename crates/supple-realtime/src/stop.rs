//! The word to end: SIGINT, SIGTERM or SIGHUP, or the parent's end.

use rustix::process::{Signal, set_parent_process_death_signal};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The handlers could not be installed.
#[derive(Debug, thiserror::Error)]
#[error("signals cannot be handled: {0}")]
pub struct StopError(#[from] ctrlc::Error);

/// Whether to end. Clones speak of the same.
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Asked for by signals from now on. To be called once a process.
    ///
    /// # Errors
    /// [`StopError`] where it was called before or the system refuses.
    pub fn on_signals() -> Result<Stop, StopError> {
        keep_running();
        let stop = Stop::default();
        let asked = stop.clone();
        ctrlc::set_handler(move || asked.ask())?;
        Ok(stop)
    }

    /// Asks to end.
    pub fn ask(&self) {
        self.0.store(true, Ordering::Release);
    }

    /// Somebody has asked to end.
    pub fn asked(&self) -> bool {
        self.0.load(Ordering::Acquire)
    }
}

/// From now on a file that may not grow any more is an error of its write, not the end of the process, and a
/// terminal is written by a process in the background too, which would be stopped. Programs that are started
/// have it so as well.
pub fn keep_running() {
    for signal in [libc::SIGXFSZ, libc::SIGTTOU] {
        // SAFETY: to ignore a signal runs no code of ours.
        unsafe { libc::signal(signal, libc::SIG_IGN) };
    }
}

/// Asks the system for a SIGTERM when the process that started this one ends, however it ends.
pub fn die_with_parent() {
    // Without it the process outlives a parent that was killed, and is found by the next start.
    let _ = set_parent_process_death_signal(Some(Signal::TERM));
}
