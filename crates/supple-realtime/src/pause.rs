//! A sleep that a signal ends early.

use core::time::Duration;
use rustix::thread::{NanosleepRelativeResult, Timespec, nanosleep};

/// Sleeps for `duration`; a signal ends the sleep early.
pub fn pause(duration: Duration) {
    let Ok(request) = Timespec::try_from(duration) else {
        return;
    };
    match nanosleep(&request) {
        NanosleepRelativeResult::Ok
        | NanosleepRelativeResult::Interrupted(_)
        | NanosleepRelativeResult::Err(_) => {}
    }
}
