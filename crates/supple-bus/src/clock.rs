//! The monotonic clock, and waiting for a descriptor until a time on it.

use crate::error::BusError;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::AsFd;
use rustix::io::Errno;
use rustix::thread::clock_nanosleep_absolute;
use rustix::time::{ClockId, clock_gettime};

const NS_PER_S: u64 = 1_000_000_000;

/// The machine's monotonic clock \[ns\].
pub fn monotonic_ns() -> u64 {
    let now = clock_gettime(ClockId::Monotonic);
    now.tv_sec as u64 * NS_PER_S + now.tv_nsec as u64
}

/// Sleeps until the monotonic clock reaches `time_ns` or a signal arrives.
pub(crate) fn sleep_until_ns(time_ns: u64) {
    let until = Timespec {
        tv_sec: (time_ns / NS_PER_S) as i64,
        tv_nsec: (time_ns % NS_PER_S) as _,
    };
    // A signal ends the sleep early; the caller checks the clock.
    let _ = clock_nanosleep_absolute(ClockId::Monotonic, &until);
}

/// Whether `fd` can be read before the monotonic clock reaches `until_ns`. A signal ends the wait early
/// with `false`.
///
/// # Errors
/// If the system call fails.
pub fn wait_readable_until(fd: impl AsFd, until_ns: u64) -> Result<bool, BusError> {
    let left = until_ns.saturating_sub(monotonic_ns());
    let timeout = Timespec {
        tv_sec: (left / NS_PER_S) as i64,
        tv_nsec: (left % NS_PER_S) as _,
    };
    let mut fds = [PollFd::new(&fd, PollFlags::IN)];
    match poll(&mut fds, Some(&timeout)) {
        Ok(ready) => Ok(ready > 0),
        Err(Errno::INTR) => Ok(false),
        Err(errno) => Err(BusError::io("waiting for the bus")(errno)),
    }
}
