//! Identity of a service's writer: a random id that the holder of the writer lock generates and stores in the lock
//! file.
//!
//! iceoryx2 is configured with spare writer slots, so that a writer killed while it joins does not block the next one. The
//! lock alone therefore does not keep other processes from writing. Each message carries its writer's id, and readers accept only the id of
//! the lock holder. Only the owner of the folder can read the file.

use crate::domain::Domain;
use crate::error::IpcError;
use crate::error::failed;
use crate::membership;
use core::cell::Cell;
use rustix::fs::{FlockOperation, flock};
use rustix::io::Errno;
use rustix::rand::{GetRandomFlags, getrandom};
use std::fs::File;
use std::io;
use std::os::fd::OwnedFd;
use std::os::unix::fs::FileExt;

/// The writer lock of a service, with the random id of its holder.
#[derive(Debug)]
pub(crate) struct WriterLock {
    writer_id: u64,
    _lock: File,
}

impl WriterLock {
    /// Acquires the lock, or returns `None` if another process holds it.
    pub fn acquire(domain: &Domain, service: &str) -> Result<Option<WriterLock>, IpcError> {
        let taken = || -> io::Result<Option<WriterLock>> {
            let Some(lock) = membership::lock(domain, service)? else {
                return Ok(None);
            };
            let lock = File::from(lock);
            let writer_id = random_id()?;
            lock.write_all_at(&writer_id.to_le_bytes(), 0)?;
            Ok(Some(WriterLock {
                writer_id,
                _lock: lock,
            }))
        };
        taken().map_err(|error| failed(service, &error))
    }

    /// Id that all messages of this writer contain.
    pub fn writer_id(&self) -> u64 {
        self.writer_id
    }
}

/// Creates a unique id: 63 random bits, never zero.
pub(crate) fn random_id() -> io::Result<u64> {
    let mut bytes = [0; 8];
    getrandom(&mut bytes, GetRandomFlags::empty())?;
    Ok(u64::from_le_bytes(bytes) | 1)
}

/// Decides which messages a reader accepts.
#[derive(Debug)]
pub(crate) struct WriterFilter {
    file: File,
    writer_id: Cell<u64>,
    dropped: Cell<u64>,
}

impl WriterFilter {
    /// Opens the lock file of a service; the writer may join later.
    pub fn of(domain: &Domain, service: &str) -> Result<WriterFilter, IpcError> {
        let file: io::Result<OwnedFd> = membership::lock_file(domain, service);
        Ok(WriterFilter {
            file: file.map_err(|error| failed(service, &error))?.into(),
            writer_id: Cell::new(0),
            dropped: Cell::new(0),
        })
    }

    /// Returns whether the id is the id of the lock holder, and counts messages with another id. Reads the file only when the
    /// id changes; allocates no memory.
    pub fn accepts(&self, writer_id: u64) -> bool {
        if writer_id == 0
            || (writer_id != self.writer_id.get() && !self.matches_lock_holder(writer_id))
        {
            self.dropped.set(self.dropped.get() + 1);
            return false;
        }
        true
    }

    /// Number of messages with another writer id.
    pub fn dropped(&self) -> u64 {
        self.dropped.get()
    }

    /// Returns whether a process holds the writer lock, and whether it is the one whose message was accepted last, if any was. The
    /// kernel releases the lock when the process ends for any reason.
    pub fn last_writer_exists(&self) -> io::Result<bool> {
        match flock(&self.file, FlockOperation::NonBlockingLockShared) {
            Ok(()) => {
                flock(&self.file, FlockOperation::Unlock)?;
                Ok(false)
            }
            Err(Errno::WOULDBLOCK) => {
                let last = self.writer_id.get();
                Ok(last == 0 || self.matches_lock_holder(last))
            }
            Err(error) => Err(error.into()),
        }
    }

    fn matches_lock_holder(&self, writer_id: u64) -> bool {
        let mut bytes = [0; 8];
        let read = self.file.read_exact_at(&mut bytes, 0);
        let is = read.is_ok() && u64::from_le_bytes(bytes) == writer_id;
        if is {
            self.writer_id.set(writer_id);
        }
        is
    }
}
