//! The monotonic clock.

use rustix::io::Errno;
use rustix::thread::clock_nanosleep_absolute;
use rustix::time::{ClockId, Timespec, clock_gettime};

const NS_PER_S: u64 = 1_000_000_000;

/// Now, by the system's monotonic clock \[ns\].
pub fn monotonic_ns() -> u64 {
    let now = clock_gettime(ClockId::Monotonic);
    now.tv_sec.unsigned_abs() * NS_PER_S + now.tv_nsec.unsigned_abs()
}

/// Sleeps until the monotonic clock shows `time_ns`; returns at once where it is past. False where a signal
/// woke it before.
pub fn sleep_until_ns(time_ns: u64) -> bool {
    let until = Timespec {
        tv_sec: (time_ns / NS_PER_S) as i64,
        tv_nsec: (time_ns % NS_PER_S) as i64,
    };
    clock_nanosleep_absolute(ClockId::Monotonic, &until) != Err(Errno::INTR)
}
