//! Where the shared memory of one system lives, apart from that of every other.
//!
//! A system is known by its prefix: processes of the same user under the same prefix see each other, others
//! do not. Sockets and service files are in a folder of the user alone; shared memory is created for the
//! user alone. Nothing is ever sent over a network.

use crate::error::IpcError;
use crate::last_out::LastOut;
use crate::shared_memory;
use crate::turn;
use iceoryx2::prelude::*;
use rustix::fs::Mode;
use std::fs::{self, DirBuilder, Metadata};
use std::io;
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path as StdPath, PathBuf};

/// How many writers that are gone may have left something unread at a reader. It looks for all of them in every
/// call: the library's own number, 128, costs some 70 ns each time.
const GONE_WRITERS: usize = 8;

/// Environment variable that gives the prefix where no option does.
pub const PREFIX_VARIABLE: &str = "SUPPLE_PREFIX";
/// The prefix where nobody gives one.
pub const DEFAULT_PREFIX: &str = "supple";

/// Permissions of the folder: its owner alone.
const OWNER_ONLY: u32 = 0o700;

/// A node of the shared-memory library, whose ports stay in the thread that made them.
pub(crate) type Node = iceoryx2::node::Node<ipc::Service>;

/// The place of one system.
#[derive(Clone, Debug)]
pub struct Domain {
    prefix: String,
    folder: PathBuf,
    config: Config,
}

impl Domain {
    /// The system of a prefix; without one, of [`PREFIX_VARIABLE`], or else of [`DEFAULT_PREFIX`]. Its folder
    /// is `$XDG_RUNTIME_DIR/supple`, or `/tmp/supple-<uid>` where there is no such variable.
    ///
    /// # Errors
    /// [`IpcError::Prefix`], [`IpcError::Folder`].
    pub fn new(prefix: Option<&str>) -> Result<Domain, IpcError> {
        let from_environment = std::env::var(PREFIX_VARIABLE).ok();
        let prefix = prefix
            .or(from_environment.as_deref())
            .unwrap_or(DEFAULT_PREFIX);
        let user = rustix::process::getuid().as_raw();
        let folder = match std::env::var_os("XDG_RUNTIME_DIR") {
            Some(runtime) if !runtime.is_empty() => PathBuf::from(runtime).join("supple"),
            _ => PathBuf::from(format!("/tmp/supple-{user}")),
        };
        Domain::within(&folder, prefix)
    }

    /// The system of a prefix, with its files in a folder of the caller's choice.
    ///
    /// # Errors
    /// [`IpcError::Prefix`], [`IpcError::Folder`].
    pub fn within(folder: &StdPath, prefix: &str) -> Result<Domain, IpcError> {
        let sound = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "-_".contains(c);
        if prefix.is_empty() || prefix.len() > 32 || !prefix.chars().all(sound) {
            return Err(IpcError::Prefix {
                found: prefix.to_owned(),
            });
        }
        own(folder)?;
        let mut config = Config::default();
        let unusable = |cause: String| IpcError::Folder {
            folder: folder.to_owned(),
            cause,
            remedy: "set XDG_RUNTIME_DIR to a folder with a short path",
        };
        let root = Path::new(folder.as_os_str().as_encoded_bytes())
            .map_err(|error| unusable(format!("{error:?}")))?;
        config.global.set_root_path(&root);
        config.global.prefix = FileName::new(objects(folder, prefix).as_bytes())
            .map_err(|error| unusable(format!("{error:?}")))?;
        let terms = &mut config.defaults.publish_subscribe;
        terms.subscriber_expired_connection_buffer = GONE_WRITERS;
        Ok(Domain {
            prefix: prefix.to_owned(),
            folder: folder.to_owned(),
            config,
        })
    }

    /// The prefix.
    pub fn prefix(&self) -> &str {
        &self.prefix
    }

    /// What the names of the system's objects in shared memory begin with.
    pub fn objects(&self) -> String {
        objects(&self.folder, &self.prefix)
    }

    /// The folder that holds sockets and service files, for the user alone.
    pub fn folder(&self) -> &StdPath {
        &self.folder
    }

    pub(crate) fn config(&self) -> &Config {
        &self.config
    }

    /// Opens ports in this system, whose messages take so much shared memory \[bytes\]; they are followed by what
    /// clears up after the last who leaves. What processes that died have left is cleared away first.
    pub(crate) fn join<P>(
        &self,
        messages_bytes: u64,
        open: impl FnOnce(&Node) -> Result<P, IpcError>,
    ) -> Result<(P, LastOut), IpcError> {
        let turn = turn::wait(self).and_then(|turn| {
            turn::remove_unfinished(self)?;
            Ok(turn)
        });
        let turn = turn.map_err(|error| IpcError::Folder {
            folder: self.folder.clone(),
            cause: error.to_string(),
            remedy: match error.kind() {
                io::ErrorKind::TimedOut => "end it, if it does not go on",
                _ => "set XDG_RUNTIME_DIR to a folder that can be written",
            },
        })?;
        // Dropped before what clears up, which takes a turn of its own.
        let last_out = LastOut::of(self);
        let opened = self.open(messages_bytes, open);
        drop(turn);
        match opened {
            Ok(ports) => Ok((ports, last_out)),
            Err(error) => Err(shared_memory::explained(self, error)),
        }
    }

    fn open<P>(
        &self,
        messages_bytes: u64,
        open: impl FnOnce(&Node) -> Result<P, IpcError>,
    ) -> Result<P, IpcError> {
        shared_memory::expect_room(messages_bytes)?;
        // Its own words are about its own terms: the errors here say what they mean to this system.
        set_log_level(LogLevel::Fatal);
        let node = NodeBuilder::new()
            .config(&self.config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()
            .map_err(|error| IpcError::Service {
                service: format!("a node under the prefix `{}`", self.prefix),
                cause: error.to_string(),
            })?;
        let ports = open(&node)?;
        shared_memory::reserve(self)?;
        shared_memory::refuse_foreign(self)?;
        Ok(ports)
    }
}

/// Shared memory has one space of names for the whole machine: user and folder are part of them.
fn objects(folder: &StdPath, prefix: &str) -> String {
    let user = rustix::process::getuid().as_raw();
    // FNV-1a, 32 bits.
    let hash = folder.as_os_str().as_encoded_bytes().iter();
    let hash = hash.fold(0x811c_9dc5_u32, |hash, byte| {
        (hash ^ u32::from(*byte)).wrapping_mul(0x0100_0193)
    });
    format!("{prefix}_{user}_{hash:08x}_")
}

/// Makes the folder, or makes sure that it is ours alone.
fn own(folder: &StdPath) -> Result<(), IpcError> {
    let failed = |cause: String, remedy| IpcError::Folder {
        folder: folder.to_owned(),
        cause,
        remedy,
    };
    let made = DirBuilder::new()
        .recursive(true)
        .mode(OWNER_ONLY)
        .create(folder);
    made.map_err(|error| {
        failed(
            error.to_string(),
            "set XDG_RUNTIME_DIR to a folder that can be written",
        )
    })?;
    let found: Metadata = fs::symlink_metadata(folder)
        .map_err(|error| failed(error.to_string(), "set XDG_RUNTIME_DIR to another folder"))?;
    let ours = found.is_dir() && found.uid() == rustix::process::getuid().as_raw();
    let others = Mode::from_raw_mode(found.mode()).bits() & 0o077;
    if !ours {
        return Err(failed(
            "it belongs to somebody else".to_owned(),
            "remove it, or set XDG_RUNTIME_DIR to a folder of your own",
        ));
    }
    if others != 0 {
        return Err(failed(
            format!("others may enter it (mode {:o})", found.mode() & 0o777),
            "chmod 700 it",
        ));
    }
    Ok(())
}
