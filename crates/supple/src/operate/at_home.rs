//! `supple at-home`: the operator confirms that an arm that has lost its position reference is in its home pose.

use super::system_request::running;
use crate::cli::AtHomeArgs;
use core::time::Duration;
use std::time::Instant;
use supple_cli::console::{confirm, print_json, print_line};
use supple_cli::exit::Failure;
use supple_ipc::message::{ArmState, Drives};
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
    let (domain, mut reader, newest) = running(&args.system)?;
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
    // No state is sent while the arm waits. The newest telemetry repeats the last state from before, in which the drives may be
    // idle.
    let mut before_ns = newest.state.stamp_ns;
    while let Some(telemetry) = reader.receive().map_err(Failure::system)? {
        before_ns = telemetry.state.stamp_ns;
    }
    // The request is removed if the power is lost again.
    files.confirm().map_err(|_| Failure::NoArmWaits)?;
    let mut back = false;
    let mut failed = None;
    poll_until(RECOVERY_TIMEOUT, || {
        match reader.wait(POLL_INTERVAL) {
            Ok(telemetry) => back = telemetry.is_some_and(|t| is_back(&t.state, before_ns)),
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

/// Returns whether the arm sent this state after `before_ns`, with power.
fn is_back(state: &ArmState, before_ns: u64) -> bool {
    state.stamp_ns > before_ns && state.drives() != Drives::Off
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

#[cfg(test)]
mod tests {
    use super::*;

    /// While the power is off, telemetry repeats the last state from before, which may have been sent between Shift-Idle and the end
    /// of the loop.
    #[test]
    fn a_state_from_before_the_confirmation_does_not_count() {
        let state = |stamp_ns, drives| {
            ArmState::new::<4>(
                7,
                stamp_ns,
                &[Some(0.0); 4],
                None,
                drives,
                Default::default(),
            )
        };
        assert!(!is_back(&state(1_000, Drives::Idle), 1_000));
        assert!(!is_back(&state(2_000, Drives::Off), 1_000));
        assert!(is_back(&state(2_000, Drives::Idle), 1_000));
    }
}
