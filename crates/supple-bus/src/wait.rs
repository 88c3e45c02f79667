//! Waiting for a descriptor until a time on the monotonic clock.

use crate::error::BusError;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::AsFd;
use rustix::io::Errno;
use supple_realtime::monotonic_ns;

const NS_PER_S: u64 = 1_000_000_000;

/// Waits until `fd` can be read and returns `true`, or `false` once the monotonic clock has reached `until_ns`. A signal
/// ends the wait early with `false`.
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
