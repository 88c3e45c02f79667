//! The last one out of a system takes what is left of it in shared memory away.
//!
//! The library removes what a port or a service has made, and clears up after processes that died; its own
//! books on a system stay. Where no process of the system is there any more, all of its objects go. A process
//! that comes meanwhile waits for its turn.

use crate::domain::{Domain, Node};
use crate::shared_memory;
use crate::turn;
use iceoryx2::node::NodeState;
use iceoryx2::prelude::CallbackProgression;
use std::fs;
use std::io;

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

fn clear(domain: &Domain) -> io::Result<()> {
    // Where others join and leave all the time, one of them will be the last.
    let Some(_turn) = turn::to_leave(domain)? else {
        return Ok(());
    };
    turn::remove_unfinished(domain)?;
    let mut inhabited = false;
    let listed = Node::list(domain.config(), |state| {
        match state {
            NodeState::Dead(node) => {
                // What it leaves all the same goes below.
                let _ = node.try_remove_stale_resources();
            }
            // Nobody is joining: it was killed when it did.
            NodeState::Undefined(_) => {}
            NodeState::Alive(_) | NodeState::Inaccessible(_) => inhabited = true,
        }
        CallbackProgression::Continue
    });
    if inhabited || listed.is_err() {
        return Ok(());
    }
    for object in shared_memory::objects(domain)?.ours {
        fs::remove_file(object)?;
    }
    Ok(())
}
