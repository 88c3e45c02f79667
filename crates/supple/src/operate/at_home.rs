//! `supple at-home`: the operator confirms that an arm that has lost its position reference is in its home pose.

use super::system_request::running;
use crate::cli::AtHomeArgs;
use core::time::Duration;
use std::time::Instant;
use supple_cli::console::{confirm, print_json, print_line};
use supple_cli::exit::Failure;
use supple_ipc::message::Drives;
use supple_realtime::pause;

/// Timeout for the arm to wait for the confirmation: its motors must first wake up after the power has returned.
const REQUEST_TIMEOUT: Duration = Duration::from_secs(15);
/// Timeout for the arm to set its positions and to reply again.
const RECOVERY_TIMEOUT: Duration = Duration::from_secs(5);
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// Runs `supple at-home`.
///
/// # Errors
/// [`Failure::NotRunning`] without a system; [`Failure::NoArmWaits`] if no arm waits for the confirmation, or not any more;
/// [`Failure::NotConfirmed`] if the operator declines, or without both a terminal and `--yes`.
pub fn at_home(args: &AtHomeArgs) -> Result<(), Failure> {
    let (domain, mut reader, _) = running(&args.system)?;
    let files = domain.home_pose_confirmation();
    let mut pose = None;
    poll_until(REQUEST_TIMEOUT, || {
        pose = files.requested_pose();
        pose.is_some()
    });
    let pose = pose.ok_or(Failure::NoArmWaits)?;
    let question = format!(
        "is the arm supported in its home pose, {pose}? Its positions are then set to that pose; an arm in another pose falls or \
         hits its surroundings."
    );
    if !(args.yes || confirm(&question)) {
        return Err(Failure::NotConfirmed);
    }
    // The request is removed if the power is lost again.
    files.confirm().map_err(|_| Failure::NoArmWaits)?;
    let mut back = false;
    let mut failed = None;
    poll_until(RECOVERY_TIMEOUT, || {
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
        files.remove_request();
        return Err(Failure::NoArmWaits);
    }
    match args.system.json {
        true => print_json(&serde_json::json!({ "confirmed": true })),
        false => print_line("confirmed: the positions are set to the home pose"),
    }
}

/// Polls the condition; returns false if it does not hold within this time.
fn poll_until(within: Duration, mut holds: impl FnMut() -> bool) -> bool {
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
