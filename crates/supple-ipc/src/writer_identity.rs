//! Who writes a service: a number drawn by whoever holds the writer's lock, kept in the lock's file.
//!
//! The shared-memory library has places for several writers, so that one killed at the wrong moment blocks nobody; the
//! lock alone keeps nobody from writing. So every message carries its writer's number, and a reader takes those of the
//! lock's holder. The file is its owner's alone, as the folder is.

use crate::domain::Domain;
use crate::error::IpcError;
use crate::port::failed;
use crate::turn;
use core::cell::Cell;
use rustix::rand::{GetRandomFlags, getrandom};
use std::fs::File;
use std::io;
use std::os::fd::OwnedFd;
use std::os::unix::fs::FileExt;

/// The lock of a service's one writer, with the number that its holder drew.
#[derive(Debug)]
pub(crate) struct WriterLock {
    number: u64,
    _lock: File,
}

impl WriterLock {
    /// Takes it, where nobody has it.
    pub fn take(domain: &Domain, service: &str) -> Result<Option<WriterLock>, IpcError> {
        let taken = || -> io::Result<Option<WriterLock>> {
            let Some(lock) = turn::lock(domain, service)? else {
                return Ok(None);
            };
            let lock = File::from(lock);
            let number = drawn()?;
            lock.write_all_at(&number.to_le_bytes(), 0)?;
            Ok(Some(WriterLock {
                number,
                _lock: lock,
            }))
        };
        taken().map_err(|error| failed(service, &error))
    }

    /// What its messages carry.
    pub fn number(&self) -> u64 {
        self.number
    }
}

/// A number that nobody else has: 63 random bits, never zero.
pub(crate) fn drawn() -> io::Result<u64> {
    let mut bytes = [0; 8];
    getrandom(&mut bytes, GetRandomFlags::empty())?;
    Ok(u64::from_le_bytes(bytes) | 1)
}

/// What a reader knows of its writer.
#[derive(Debug)]
pub(crate) struct KnownWriter {
    file: File,
    number: Cell<u64>,
    dropped: Cell<u64>,
}

impl KnownWriter {
    /// Of a service whose writer may still have to come.
    pub fn of(domain: &Domain, service: &str) -> Result<KnownWriter, IpcError> {
        let file: io::Result<OwnedFd> = turn::lock_file(domain, service);
        Ok(KnownWriter {
            file: file.map_err(|error| failed(service, &error))?.into(),
            number: Cell::new(0),
            dropped: Cell::new(0),
        })
    }

    /// A message with this number is the writer's; one that is not is counted. The file is read where the number is
    /// another than the last: nothing is allocated.
    pub fn wrote(&self, number: u64) -> bool {
        if number == 0 || (number != self.number.get() && !self.is_the_holders(number)) {
            self.dropped.set(self.dropped.get() + 1);
            return false;
        }
        true
    }

    /// Messages of others.
    pub fn dropped(&self) -> u64 {
        self.dropped.get()
    }

    fn is_the_holders(&self, number: u64) -> bool {
        let mut bytes = [0; 8];
        let read = self.file.read_exact_at(&mut bytes, 0);
        let is = read.is_ok() && u64::from_le_bytes(bytes) == number;
        if is {
            self.number.set(number);
        }
        is
    }
}
