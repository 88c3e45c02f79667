//! The monotonic clock, and the time of day.

use rustix::io::Errno;
use rustix::thread::clock_nanosleep_absolute;
use rustix::time::{ClockId, Timespec, clock_gettime};

const NS_PER_S: u64 = 1_000_000_000;

/// Current time of the system's monotonic clock \[ns\].
pub fn monotonic_ns() -> u64 {
    let now = clock_gettime(ClockId::Monotonic);
    now.tv_sec.unsigned_abs() * NS_PER_S + now.tv_nsec.unsigned_abs()
}

/// Current time of day since the epoch \[ns\], for logs and viewers; no control depends on it.
pub fn since_epoch_ns() -> u64 {
    let now = clock_gettime(ClockId::Realtime);
    now.tv_sec.unsigned_abs() * NS_PER_S + now.tv_nsec.unsigned_abs()
}

/// Sleeps until `time_ns` of the monotonic clock; returns at once if it has passed. Returns false if a signal ended the
/// sleep early.
pub fn sleep_until_ns(time_ns: u64) -> bool {
    let until = Timespec {
        tv_sec: (time_ns / NS_PER_S) as i64,
        tv_nsec: (time_ns % NS_PER_S) as i64,
    };
    clock_nanosleep_absolute(ClockId::Monotonic, &until) != Err(Errno::INTR)
}
