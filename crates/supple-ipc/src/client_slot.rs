//! Client slots: a fixed number for each kind of client. A client holds its slot by a file lock, which the kernel releases
//! when the process ends.
//!
//! iceoryx2 has one pool of subscriber and publisher slots, which hung clients could exhaust. Therefore general
//! clients get one part of the pool, and the programs that run the system get the other. If a part is exhausted, the error
//! names the processes that hold its slots.

use crate::domain::Domain;
use crate::error::IpcError;
use crate::error::failed;
use crate::membership;
use core::time::Duration;
use rustix::fs::{FlockOperation, flock};
use rustix::io::Errno;
use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use supple_realtime::pause;

/// Delay before busy slots are tried again: between fork and exec a child process shares its parent's locks, so a lock
/// may stay held for a moment after its release.
const FORK_LOCK_GRACE: Duration = Duration::from_millis(100);
/// Maximum number of digits of a process id.
const DIGITS: usize = 10;

/// A kind of client slot.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SlotKind {
    /// Part of the names of the lock files.
    pub name: &'static str,
    /// Description for error messages.
    pub description: &'static str,
    /// Number of slots.
    pub slots: usize,
}

/// A client slot; dropping it releases the slot.
#[derive(Debug)]
pub(crate) struct ClientSlot {
    _lock: File,
}

impl ClientSlot {
    /// Acquires a free slot.
    ///
    /// # Errors
    /// [`IpcError::NoFreeSlot`] if all slots of the kind are in use.
    pub fn acquire(domain: &Domain, kind: &SlotKind) -> Result<ClientSlot, IpcError> {
        let free = || first_free(domain, kind).map_err(|error| failed(kind.name, &error));
        if let Some(slot) = free()? {
            return Ok(slot);
        }
        pause(FORK_LOCK_GRACE);
        free()?.ok_or_else(|| IpcError::NoFreeSlot {
            kind: kind.description,
            slots: kind.slots,
            holders: holders(domain, kind).join(", "),
        })
    }
}

fn file(domain: &Domain, kind: &SlotKind, index: usize) -> io::Result<File> {
    membership::lock_file(domain, &format!("{}-{index}", kind.name)).map(File::from)
}

fn first_free(domain: &Domain, kind: &SlotKind) -> io::Result<Option<ClientSlot>> {
    for index in 0..kind.slots {
        let lock = file(domain, kind, index)?;
        match flock(&lock, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => {
                let process = format!("{:<DIGITS$}", std::process::id());
                lock.write_all_at(process.as_bytes(), 0)?;
                return Ok(Some(ClientSlot { _lock: lock }));
            }
            Err(Errno::WOULDBLOCK) => {}
            Err(error) => return Err(error.into()),
        }
    }
    Ok(None)
}

/// Returns the ids of the processes that hold the slots.
fn holders(domain: &Domain, kind: &SlotKind) -> Vec<String> {
    let mut holders = Vec::new();
    for index in 0..kind.slots {
        let mut process = [0; DIGITS];
        let read = file(domain, kind, index).and_then(|file| file.read_exact_at(&mut process, 0));
        let process = String::from_utf8_lossy(&process).trim().to_owned();
        if read.is_ok() && !holders.contains(&process) {
            holders.push(process);
        }
    }
    holders
}

#[cfg(test)]
mod tests {
    use super::*;

    const SLOTS: SlotKind = SlotKind {
        name: "test",
        description: "tests",
        slots: 2,
    };

    #[test]
    fn slots_are_released_and_the_error_names_their_holders() {
        let folder = tempfile::tempdir().expect("a folder");
        let domain = Domain::in_folder(&folder.path().join("run"), "slots").expect("a domain");
        let one = ClientSlot::acquire(&domain, &SLOTS).expect("free");
        let _two = ClientSlot::acquire(&domain, &SLOTS).expect("free");
        let error = ClientSlot::acquire(&domain, &SLOTS).expect_err("all slots are in use");
        let process = std::process::id().to_string();
        for part in ["2", "tests", process.as_str()] {
            assert!(error.to_string().contains(part), "{part}: {error}");
        }
        drop(one);
        ClientSlot::acquire(&domain, &SLOTS).expect("the slot was released");
    }
}
