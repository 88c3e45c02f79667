//! Joining of a process to a system.

use crate::cleanup::SharedMemoryCleanup;
use crate::domain::{Domain, Node};
use crate::error::IpcError;
use crate::membership;
use crate::shared_memory;
use iceoryx2::prelude::*;
use std::io;

impl Domain {
    /// Opens ports whose messages need `messages_bytes` of shared memory, and returns them with a guard that removes
    /// the shared memory when the last process leaves. Objects left by killed processes are removed first.
    pub(crate) fn join<P>(
        &self,
        messages_bytes: u64,
        open: impl FnOnce(&Node) -> Result<P, IpcError>,
    ) -> Result<(P, SharedMemoryCleanup), IpcError> {
        let membership_lock = membership::lock_to_join(self).and_then(|membership_lock| {
            membership::remove_unsized_objects(self)?;
            Ok(membership_lock)
        });
        let membership_lock = membership_lock.map_err(|error| IpcError::Folder {
            folder: self.folder().to_owned(),
            cause: error.to_string(),
            remedy: match error.kind() {
                io::ErrorKind::TimedOut => "end that process if it hangs",
                _ => "set XDG_RUNTIME_DIR to a folder that can be written",
            },
        })?;
        // The lock is released below, before the guard can be dropped: dropping the guard acquires the lock.
        let cleanup = SharedMemoryCleanup::of(self);
        let opened = self.open(messages_bytes, open);
        drop(membership_lock);
        match opened {
            Ok(ports) => Ok((ports, cleanup)),
            Err(error) => Err(shared_memory::add_foreign_object_cause(self, error)),
        }
    }

    fn open<P>(
        &self,
        messages_bytes: u64,
        open: impl FnOnce(&Node) -> Result<P, IpcError>,
    ) -> Result<P, IpcError> {
        shared_memory::check_free_space(messages_bytes)?;
        // iceoryx2's log messages are suppressed; IpcError reports the same errors in this system's terms.
        set_log_level(LogLevel::Fatal);
        let node = NodeBuilder::new()
            .config(self.config())
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()
            .map_err(|error| IpcError::Service {
                service: format!("a node under the prefix `{}`", self.prefix()),
                cause: error.to_string(),
            })?;
        let ports = open(&node)?;
        shared_memory::reserve(self)?;
        shared_memory::refuse_foreign(self)?;
        Ok(ports)
    }
}
