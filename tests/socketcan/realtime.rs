//! Realtime settings of the host's and the arm's threads.

use supple_realtime::{Settings, apply_realtime_settings};

/// Priorities of host and arm thread; the arm is higher, like real hardware.
pub(super) const HOST_PRIORITY: u8 = 79;

pub(super) const ARM_PRIORITY: u8 = 80;

pub(super) fn realtime(priority: u8) {
    let settings = Settings {
        priority: Some(priority),
        ..Settings::NONE
    };
    for realtime_warning in apply_realtime_settings(&settings) {
        eprintln!("{realtime_warning}");
    }
}
