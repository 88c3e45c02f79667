//! `supple at-home`: the operator confirms that an arm which has lost its positions is in its home pose.

use super::ask::running;
use crate::cli::AtHomeArgs;
use core::time::Duration;
use std::time::Instant;
use supple_cli::console::{confirms, print_json, print_line};
use supple_cli::exit::Failure;
use supple_ipc::message::Drives;
use supple_realtime::pause;

/// Time for the motors to wake after the power is back: the arm asks only then.
const ASKED_WITHIN: Duration = Duration::from_secs(15);
/// Time within which an arm that waits has its positions, and replies again.
const BACK_WITHIN: Duration = Duration::from_secs(5);
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// Runs `supple at-home`.
///
/// # Errors
/// [`Failure::NotRunning`] without a system; [`Failure::NoArmWaits`] if no arm asks for its home pose, or no longer;
/// [`Failure::NotConfirmed`] if the operator declines, or without `--yes` where nobody can be asked.
pub fn at_home(args: &AtHomeArgs) -> Result<(), Failure> {
    let (domain, mut reader, _) = running(&args.system)?;
    let files = domain.home_files();
    let mut pose = None;
    until(ASKED_WITHIN, || {
        pose = files.question();
        pose.is_some()
    });
    let pose = pose.ok_or(Failure::NoArmWaits)?;
    let question = format!(
        "is the arm supported in its home pose, {pose}? Its positions are set to that pose; an arm that is elsewhere falls or \
         strikes."
    );
    if !(args.yes || confirms(&question)) {
        return Err(Failure::NotConfirmed);
    }
    // The question is withdrawn if the power is lost once more.
    files.answer().map_err(|_| Failure::NoArmWaits)?;
    let mut back = false;
    let mut failed = None;
    until(BACK_WITHIN, || {
        match reader.wait(POLL_INTERVAL) {
            Ok(telemetry) => back = telemetry.is_some_and(|t| t.state.drives() != Drives::Off),
            Err(error) => failed = Some(error),
        }
        back || failed.is_some()
    });
    if let Some(error) = failed {
        return Err(Failure::system(error));
    }
    if !back {
        files.withdraw();
        return Err(Failure::NoArmWaits);
    }
    match args.system.json {
        true => print_json(&serde_json::json!({ "confirmed": true })),
        false => print_line("confirmed: the positions are set to the home pose"),
    }
}

/// Polls the condition; false if it does not hold within this time.
fn until(within: Duration, mut holds: impl FnMut() -> bool) -> bool {
    let start = Instant::now();
    loop {
        if holds() {
            return true;
        }
        if start.elapsed() > within {
            return false;
        }
        pause(POLL_INTERVAL);
    }
}
