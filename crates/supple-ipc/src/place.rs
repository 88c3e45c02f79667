//! Places of those who come and go: so many of each kind, each under a lock that the kernel gives back.
//!
//! The library's own places are one pool, which hung clients may use up. Those who only look, or ask for one thing, have a
//! share of it; what keeps a system running has its own. Where a share is used up, the error names who holds it.

use crate::domain::Domain;
use crate::error::IpcError;
use crate::outside::pause;
use crate::port::failed;
use crate::turn;
use core::time::Duration;
use rustix::fs::{FlockOperation, flock};
use rustix::io::Errno;
use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;

/// A process that starts another shares its locks with it for a moment, given back ones too.
const HELD_BY_A_FORK: Duration = Duration::from_millis(100);
/// Longest number of a process.
const DIGITS: usize = 10;

/// A kind of place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Kind {
    /// Part of the names of its locks.
    pub name: &'static str,
    /// In the words of an error.
    pub words: &'static str,
    /// How many there are.
    pub places: usize,
}

/// A place, until it is dropped.
#[derive(Debug)]
pub(crate) struct Place {
    _lock: File,
}

impl Place {
    /// Takes a free one.
    ///
    /// # Errors
    /// [`IpcError::NoPlace`] where there is none.
    pub fn take(domain: &Domain, kind: &Kind) -> Result<Place, IpcError> {
        let free = || first_free(domain, kind).map_err(|error| failed(kind.name, &error));
        if let Some(place) = free()? {
            return Ok(place);
        }
        pause(HELD_BY_A_FORK);
        free()?.ok_or_else(|| IpcError::NoPlace {
            kind: kind.words,
            places: kind.places,
            holders: holders(domain, kind).join(", "),
        })
    }
}

fn file(domain: &Domain, kind: &Kind, index: usize) -> io::Result<File> {
    turn::lock_file(domain, &format!("{}-{index}", kind.name)).map(File::from)
}

fn first_free(domain: &Domain, kind: &Kind) -> io::Result<Option<Place>> {
    for index in 0..kind.places {
        let lock = file(domain, kind, index)?;
        match flock(&lock, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => {
                let process = format!("{:<DIGITS$}", std::process::id());
                lock.write_all_at(process.as_bytes(), 0)?;
                return Ok(Some(Place { _lock: lock }));
            }
            Err(Errno::WOULDBLOCK) => {}
            Err(error) => return Err(error.into()),
        }
    }
    Ok(None)
}

/// Numbers of the processes that hold the places.
fn holders(domain: &Domain, kind: &Kind) -> Vec<String> {
    let mut holders = Vec::new();
    for index in 0..kind.places {
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

    const KIND: Kind = Kind {
        name: "test",
        words: "tests",
        places: 2,
    };

    #[test]
    fn places_are_given_back_and_an_error_names_who_holds_them() {
        let folder = tempfile::tempdir().expect("a folder");
        let domain = Domain::within(&folder.path().join("run"), "place").expect("a domain");
        let one = Place::take(&domain, &KIND).expect("free");
        let _two = Place::take(&domain, &KIND).expect("free");
        let error = Place::take(&domain, &KIND).expect_err("all are taken");
        let process = std::process::id().to_string();
        for part in ["2", "tests", process.as_str()] {
            assert!(error.to_string().contains(part), "{part}: {error}");
        }
        drop(one);
        Place::take(&domain, &KIND).expect("it was given back");
    }
}
