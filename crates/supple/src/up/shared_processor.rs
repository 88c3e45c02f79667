//! One processor for the processes of a system in virtual time.
//!
//! They take turns, one message after another. On one processor the next of them continues where the last one has stopped; on several, each
//! message first wakes a processor, which in a virtual machine takes longer than the cycle.

use rustix::fs::{FlockOperation, flock};
use std::fs::{File, OpenOptions};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::process::Child;
use supple_ipc::Domain;
use supple_realtime::{allowed_processors, bind_process};

/// A processor that the systems in virtual time of this user leave to this one while the value lives.
#[derive(Debug)]
pub struct SharedProcessor {
    number: usize,
    _lock: File,
}

impl SharedProcessor {
    /// Takes a processor on which this process may run and no other system in virtual time does; `None` if there is none, or none to
    /// choose from. The scheduler then distributes the processes: their results are the same.
    pub fn take(domain: &Domain) -> Option<SharedProcessor> {
        let allowed = allowed_processors();
        if allowed.len() < 2 {
            return None;
        }
        allowed
            .into_iter()
            .find_map(|number| Self::lock(domain.folder(), number))
    }

    fn lock(folder: &Path, number: usize) -> Option<SharedProcessor> {
        let file = OpenOptions::new()
            .write(true)
            .create(true)
            .truncate(false)
            .mode(0o600)
            .open(folder.join(format!("processor-{number}.lock")))
            .ok()?;
        flock(&file, FlockOperation::NonBlockingLockExclusive).ok()?;
        Some(SharedProcessor {
            number,
            _lock: file,
        })
    }

    /// Binds a process that has just been started to the processor. If that fails, it runs as without.
    pub fn bind(&self, child: &Child) {
        let _ = bind_process(child.id(), self.number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_processor_is_taken_once_until_it_is_free_again() {
        let folder = tempfile::tempdir().expect("a folder");
        let take = |number| SharedProcessor::lock(folder.path(), number);
        let first = take(0).expect("free");
        assert!(take(0).is_none());
        assert_eq!(take(1).expect("free").number, 1);
        drop(first);
        assert!(take(0).is_some());
    }

    #[test]
    fn a_bound_process_runs_on_its_processor_alone() {
        let folder = tempfile::tempdir().expect("a folder");
        let number = *allowed_processors().last().expect("a processor");
        let processor = SharedProcessor::lock(folder.path(), number).expect("free");
        let mut child = std::process::Command::new("sleep")
            .arg("10")
            .spawn()
            .expect("started");
        processor.bind(&child);
        let status = std::fs::read_to_string(format!("/proc/{}/status", child.id()));
        child.kill().expect("ended");
        child.wait().expect("ended");
        let status = status.expect("a status");
        let list = status
            .lines()
            .find_map(|line| line.strip_prefix("Cpus_allowed_list:"));
        assert_eq!(list.expect("a list").trim(), number.to_string());
    }
}
