//! Runs computations without the interpreter lock, so that Ctrl-C interrupts them.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::Duration;

/// Interval between two checks for signals.
const SIGNAL_INTERVAL: Duration = Duration::from_millis(50);
/// Stack of the worker: a controller of seven joints and its plant are values of tens of kilobytes.
const STACK_BYTES: usize = 16 << 20;

/// Runs `work` in a thread. If a signal handler raises, this sets the flag passed to `work` and returns the exception at
/// once; work that does not read the flag ends later, and its result is dropped.
pub fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&Arc<AtomicBool>) -> T + Send + 'static,
) -> PyResult<T> {
    let cancelled = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&cancelled);
    let (sender, receiver) = sync_channel(1);
    let thread = std::thread::Builder::new()
        .name("supple".to_owned())
        .stack_size(STACK_BYTES)
        // Nobody receives the result of work that was interrupted.
        .spawn(move || drop(sender.send(work(&flag))))?;
    let mut receiver = receiver;
    loop {
        let waiting = &mut receiver;
        match py.detach(move || waiting.recv_timeout(SIGNAL_INTERVAL)) {
            Ok(done) => return Ok(done),
            Err(RecvTimeoutError::Timeout) => py
                .check_signals()
                .inspect_err(|_| cancelled.store(true, Ordering::Relaxed))?,
            Err(RecvTimeoutError::Disconnected) => {
                let panicked = thread.join().is_err();
                return Err(PyRuntimeError::new_err(format!(
                    "supple: a calculation ended without a result (panic: {panicked}); please report it"
                )));
            }
        }
    }
}
