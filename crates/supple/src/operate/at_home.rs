//! `supple at-home`: the operator confirms that an arm which has lost its positions is in its home pose.

use crate::cli::AtHomeArgs;
use core::time::Duration;
use std::time::Instant;
use supple_cli::console::{confirms, print_json, print_line};
use supple_cli::exit::Failure;
use supple_ipc::Domain;
use supple_realtime::pause;

/// Time within which a process that waits for the confirmation takes it.
const TAKEN_WITHIN: Duration = Duration::from_secs(3);
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// Runs `supple at-home`.
///
/// # Errors
/// [`Failure::NoArmWaits`] if nobody waits for the confirmation; [`Failure::NotConfirmed`] without `--yes` where nobody
/// can be asked, or if the operator declines.
pub fn at_home(args: &AtHomeArgs) -> Result<(), Failure> {
    let question = "is the arm supported in its home pose? Its positions are set to that pose; if it is elsewhere, the arm \
                    falls or strikes.";
    if !(args.yes || confirms(question)) {
        return Err(Failure::NotConfirmed);
    }
    let domain = Domain::new(args.system.prefix.as_deref()).map_err(Failure::system)?;
    let file = domain.home_confirmation();
    std::fs::write(&file, "").map_err(|error| Failure::file("write", &file, error))?;
    let start = Instant::now();
    while file.exists() {
        if start.elapsed() > TAKEN_WITHIN {
            // If it was taken at this moment, the arm starts all the same.
            return match std::fs::remove_file(&file) {
                Ok(()) => Err(Failure::NoArmWaits),
                Err(_) => break,
            };
        }
        pause(POLL_INTERVAL);
    }
    match args.system.json {
        true => print_json(&serde_json::json!({ "confirmed": true })),
        false => print_line("the arm starts with its positions set to the home pose"),
    }
}
