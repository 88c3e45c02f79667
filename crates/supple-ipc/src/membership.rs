//! Membership lock: only one process at a time joins or leaves a system.
//!
//! Only the holder of the lock creates and opens services. A process that is killed while it creates one may leave a
//! shared-memory object of size zero, on which iceoryx2 0.9.3 waits forever (`MappingSizeIsZero`). The holder therefore
//! removes such objects first.

use crate::domain::Domain;
use crate::shared_memory;
use core::time::Duration;
use rustix::fs::{FlockOperation, Mode, OFlags, flock, open};
use rustix::io::Errno;
use std::fs;
use std::io;
use std::os::fd::OwnedFd;
use std::path::PathBuf;
use std::time::Instant;
use supple_realtime::pause;

/// Name of the lock file.
const MEMBERSHIP_LOCK: &str = "membership";
/// Timeout for the lock on joining. Other processes hold the lock for milliseconds, unless they are stopped (SIGSTOP).
const MEMBERSHIP_LOCK_TIMEOUT: Duration = Duration::from_secs(10);
/// Timeout for the lock on leaving.
const LEAVE_LOCK_TIMEOUT: Duration = Duration::from_secs(1);
/// Time for which a busy lock is retried: between fork and exec a child process shares its parent's locks, so a lock
/// may stay held for a moment after its release.
const FORK_LOCK_GRACE: Duration = Duration::from_millis(200);
/// Poll interval for the lock and for the size of an object.
const POLL_INTERVAL: Duration = Duration::from_millis(1);
/// Age after which an object of size zero counts as abandoned; a live creator sets the size within microseconds.
const UNSIZED_OBJECT_TIMEOUT: Duration = Duration::from_millis(200);

/// Acquires the membership lock, waiting for other holders; dropping it releases the lock.
pub(crate) fn lock_to_join(domain: &Domain) -> io::Result<OwnedFd> {
    let membership_lock = lock_within(domain, MEMBERSHIP_LOCK, MEMBERSHIP_LOCK_TIMEOUT)?;
    membership_lock.ok_or_else(|| {
        let cause = format!(
            "another process has been joining or leaving for {} s (`fuser {}` shows which)",
            MEMBERSHIP_LOCK_TIMEOUT.as_secs(),
            path(domain, MEMBERSHIP_LOCK).display()
        );
        io::Error::new(io::ErrorKind::TimedOut, cause)
    })
}

/// Acquires the membership lock on leaving, with the short timeout.
pub(crate) fn try_lock_to_leave(domain: &Domain) -> io::Result<Option<OwnedFd>> {
    lock_within(domain, MEMBERSHIP_LOCK, LEAVE_LOCK_TIMEOUT)
}

/// Acquires a named lock of the system, or returns `None` if another process holds it. The kernel releases it when the
/// process ends for any reason.
pub(crate) fn lock(domain: &Domain, name: &str) -> io::Result<Option<OwnedFd>> {
    lock_within(domain, name, FORK_LOCK_GRACE)
}

fn lock_within(domain: &Domain, name: &str, timeout: Duration) -> io::Result<Option<OwnedFd>> {
    let file = lock_file(domain, name)?;
    let start = Instant::now();
    loop {
        match flock(&file, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => return Ok(Some(file)),
            Err(Errno::WOULDBLOCK) if start.elapsed() < timeout => pause(POLL_INTERVAL),
            Err(Errno::WOULDBLOCK) => return Ok(None),
            Err(error) => return Err(error.into()),
        }
    }
}

/// Opens the file of a lock; creates it if it does not exist.
pub(crate) fn lock_file(domain: &Domain, name: &str) -> io::Result<OwnedFd> {
    let flags = OFlags::CREATE | OFlags::RDWR | OFlags::CLOEXEC;
    Ok(open(path(domain, name), flags, Mode::RUSR | Mode::WUSR)?)
}

fn path(domain: &Domain, lock: &str) -> PathBuf {
    let name = format!("{}.{lock}.lock", domain.prefix());
    domain.folder().join(name)
}

/// Removes the objects whose creators died before they set the size. Call it with the membership lock held. A process
/// that connects to an existing port creates objects without the lock, so every object gets
/// [`UNSIZED_OBJECT_TIMEOUT`] to reach its size.
pub(crate) fn remove_unsized_objects(domain: &Domain) -> io::Result<()> {
    for object in shared_memory::objects(domain)?.owned {
        let first_seen = Instant::now();
        while fs::metadata(&object).is_ok_and(|found| found.len() == 0) {
            if first_seen.elapsed() > UNSIZED_OBJECT_TIMEOUT {
                fs::remove_file(&object)?;
                break;
            }
            pause(POLL_INTERVAL);
        }
    }
    Ok(())
}
