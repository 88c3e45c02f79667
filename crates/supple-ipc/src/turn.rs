//! Joining and leaving take turns, on a lock file in the system's folder.
//!
//! Whoever has the turn opens and makes services, and nobody else does. A process that is killed while it makes
//! one may leave a shared-memory object without a size, for which the library waits without end wherever it
//! meets it (iceoryx2 0.9.3, `MappingSizeIsZero`). So the first thing done with a turn is to take these away.

use crate::domain::Domain;
use crate::outside::pause;
use crate::shared_memory;
use core::time::Duration;
use rustix::fs::{FlockOperation, Mode, OFlags, flock, open};
use rustix::io::Errno;
use std::fs;
use std::io;
use std::os::fd::OwnedFd;
use std::path::PathBuf;
use std::time::Instant;

/// Name of its lock.
const TURN: &str = "turn";
/// A turn is over after milliseconds, unless its process was stopped in the middle.
const LONGEST_TURN: Duration = Duration::from_secs(10);
/// How long one who leaves waits for it.
const LEAVES_WITHIN: Duration = Duration::from_secs(1);
/// A process that starts another shares its locks with it for a moment, given back ones too.
const HELD_BY_A_FORK: Duration = Duration::from_millis(200);
/// How often it is looked whether another's turn is over, and whether an object got its size.
const LOOK_EVERY: Duration = Duration::from_millis(1);
/// An object without a size that is older than this gets none any more. Its maker takes microseconds.
const UNFINISHED_AFTER: Duration = Duration::from_millis(200);

/// The turn, until it is dropped; waits for those of others.
pub(crate) fn wait(domain: &Domain) -> io::Result<OwnedFd> {
    let turn = lock_within(domain, TURN, LONGEST_TURN)?;
    turn.ok_or_else(|| {
        let cause = format!(
            "another process has been joining or leaving for {} s (`fuser {}` shows which)",
            LONGEST_TURN.as_secs(),
            path(domain, TURN).display()
        );
        io::Error::new(io::ErrorKind::TimedOut, cause)
    })
}

/// The turn of one who leaves, and who does not wait for long.
pub(crate) fn to_leave(domain: &Domain) -> io::Result<Option<OwnedFd>> {
    lock_within(domain, TURN, LEAVES_WITHIN)
}

/// A lock of the system, where nobody else has it. The kernel gives it back when its process is gone, however
/// that ended.
pub(crate) fn lock(domain: &Domain, name: &str) -> io::Result<Option<OwnedFd>> {
    lock_within(domain, name, HELD_BY_A_FORK)
}

fn lock_within(domain: &Domain, name: &str, longest: Duration) -> io::Result<Option<OwnedFd>> {
    let file = lock_file(domain, name)?;
    let start = Instant::now();
    loop {
        match flock(&file, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => return Ok(Some(file)),
            Err(Errno::WOULDBLOCK) if start.elapsed() < longest => pause(LOOK_EVERY),
            Err(Errno::WOULDBLOCK) => return Ok(None),
            Err(error) => return Err(error.into()),
        }
    }
}

/// The file of a lock, made where it is not there yet.
pub(crate) fn lock_file(domain: &Domain, name: &str) -> io::Result<OwnedFd> {
    let flags = OFlags::CREATE | OFlags::RDWR | OFlags::CLOEXEC;
    Ok(open(path(domain, name), flags, Mode::RUSR | Mode::WUSR)?)
}

fn path(domain: &Domain, lock: &str) -> PathBuf {
    let name = format!("{}.{lock}.lock", domain.prefix());
    domain.folder().join(name)
}

/// Takes away the objects whose makers died before they gave them a size. To be called with the turn. Who is
/// connecting to another's ports has no turn: its objects are given the time to get their size.
pub(crate) fn remove_unfinished(domain: &Domain) -> io::Result<()> {
    for object in shared_memory::objects(domain)?.ours {
        let first_seen = Instant::now();
        while fs::metadata(&object).is_ok_and(|found| found.len() == 0) {
            if first_seen.elapsed() > UNFINISHED_AFTER {
                fs::remove_file(&object)?;
                break;
            }
            pause(LOOK_EVERY);
        }
    }
    Ok(())
}
