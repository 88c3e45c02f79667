//! The last one out of a system takes what is left of it in shared memory away.
//!
//! The library removes what a port or a service has made, and clears up after processes that died; its own
//! books on a system stay. Where no process of the system is there any more, all of its objects go. A process
//! that comes meanwhile waits: joining and leaving take turns on a lock file in the system's folder.

use crate::domain::{Domain, Node};
use iceoryx2::node::NodeState;
use iceoryx2::prelude::CallbackProgression;
use rustix::fs::{FlockOperation, Mode, OFlags, flock, open};
use std::fs;
use std::io;
use std::os::fd::OwnedFd;

/// Where Linux keeps shared memory by its name.
const SHARED_MEMORY: &str = "/dev/shm";

/// A field of everything that has ports, behind them.
#[derive(Debug)]
pub(crate) struct LastOut(Domain);

impl LastOut {
    pub fn of(domain: &Domain) -> LastOut {
        LastOut(domain.clone())
    }
}

impl Drop for LastOut {
    fn drop(&mut self) {
        // What cannot be removed is small, and found by the next who leaves.
        let _ = clear(&self.0);
    }
}

/// The right to join, until it is dropped; shared by all who join.
pub(crate) fn joining(domain: &Domain) -> io::Result<OwnedFd> {
    turn(domain, FlockOperation::LockShared)
}

fn turn(domain: &Domain, operation: FlockOperation) -> io::Result<OwnedFd> {
    let path = domain.folder().join(format!("{}.lock", domain.prefix()));
    let flags = OFlags::CREATE | OFlags::RDWR | OFlags::CLOEXEC;
    let file = open(path, flags, Mode::RUSR | Mode::WUSR)?;
    flock(&file, operation)?;
    Ok(file)
}

fn clear(domain: &Domain) -> io::Result<()> {
    // Where somebody is joining, somebody else will be the last.
    let _turn = turn(domain, FlockOperation::NonBlockingLockExclusive)?;
    let mut inhabited = false;
    let listed = Node::list(domain.config(), |state| {
        inhabited |= match state {
            NodeState::Dead(node) => node.try_remove_stale_resources().is_err(),
            NodeState::Alive(_) | NodeState::Inaccessible(_) | NodeState::Undefined(_) => true,
        };
        CallbackProgression::Continue
    });
    if inhabited || listed.is_err() {
        return Ok(());
    }
    let objects = domain.objects();
    for entry in fs::read_dir(SHARED_MEMORY)? {
        let entry = entry?;
        let name = entry.file_name();
        if name.as_encoded_bytes().starts_with(objects.as_bytes()) {
            fs::remove_file(entry.path())?;
        }
    }
    Ok(())
}
