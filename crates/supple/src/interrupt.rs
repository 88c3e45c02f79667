//! An interrupted run leaves no half-written folder.

use std::path::PathBuf;
use std::sync::{Mutex, OnceLock};
use supple_realtime::Stop;

/// Exit code after an interrupt, as shells give it.
const INTERRUPTED: i32 = 130;

/// The folder that is being written.
static PARTIAL: Mutex<Option<PathBuf>> = Mutex::new(None);

/// Somebody ends in order when asked to.
static CAUGHT: OnceLock<Stop> = OnceLock::new();

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
            return stop.ask();
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
