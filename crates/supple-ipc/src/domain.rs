//! The namespace of one system: its folder and the names of its shared-memory objects.
//!
//! A system is identified by its prefix: processes of the same user with the same prefix are connected to each
//! other, and to no other process. Only the user can access the folder of sockets and service files, and the shared memory. Nothing is ever sent
//! over a network.

use crate::error::IpcError;
use crate::home_pose_confirmation::HomePoseConfirmation;
use iceoryx2::prelude::*;
use std::path::{Path as StdPath, PathBuf};
use supple_realtime::{PrivateFolderError, open_private_folder, runtime_folder};

/// Number of terminated writers whose unread messages a reader keeps. The reader polls all of these slots in every
/// call; iceoryx2's default of 128 costs about 70 ns per call.
const MAX_DEAD_WRITERS: usize = 8;

/// Environment variable that gives the prefix if no option does.
pub const PREFIX_VARIABLE: &str = "SUPPLE_PREFIX";
/// Default prefix.
pub const DEFAULT_PREFIX: &str = "supple";

/// Folder of all systems of a user.
const FOLDER: &str = "supple";

/// An iceoryx2 node; its ports stay in the thread that created them.
pub(crate) type Node = iceoryx2::node::Node<ipc::Service>;

/// Namespace of one system.
#[derive(Clone, Debug)]
pub struct Domain {
    prefix: String,
    folder: PathBuf,
    config: Config,
}

impl Domain {
    /// Opens the system with this prefix; the default is the value of [`PREFIX_VARIABLE`], otherwise
    /// [`DEFAULT_PREFIX`]. The folder of the system is `$XDG_RUNTIME_DIR/supple`, or `/tmp/supple-<uid>` if the variable is not set.
    ///
    /// # Errors
    /// [`IpcError::Prefix`] for an invalid prefix, [`IpcError::Folder`] if the folder cannot be used.
    pub fn new(prefix: Option<&str>) -> Result<Domain, IpcError> {
        let from_environment = std::env::var(PREFIX_VARIABLE).ok();
        let prefix = prefix
            .or(from_environment.as_deref())
            .unwrap_or(DEFAULT_PREFIX);
        Domain::in_folder(&runtime_folder(FOLDER), prefix)
    }

    /// Opens the system with this prefix in the given folder.
    ///
    /// # Errors
    /// [`IpcError::Prefix`] for an invalid prefix, [`IpcError::Folder`] if the folder cannot be used.
    pub fn in_folder(folder: &StdPath, prefix: &str) -> Result<Domain, IpcError> {
        let allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "-_".contains(c);
        if prefix.is_empty() || prefix.len() > 32 || !prefix.chars().all(allowed) {
            return Err(IpcError::Prefix {
                found: prefix.to_owned(),
            });
        }
        open_folder(folder)?;
        let mut config = Config::default();
        let unusable = |cause: String| IpcError::Folder {
            folder: folder.to_owned(),
            cause,
            remedy: "set XDG_RUNTIME_DIR to a folder with a short path",
        };
        let root = Path::new(folder.as_os_str().as_encoded_bytes())
            .map_err(|error| unusable(format!("{error:?}")))?;
        config.global.set_root_path(&root);
        config.global.prefix = FileName::new(object_prefix(folder, prefix).as_bytes())
            .map_err(|error| unusable(format!("{error:?}")))?;
        let defaults = &mut config.defaults.publish_subscribe;
        defaults.subscriber_expired_connection_buffer = MAX_DEAD_WRITERS;
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

    /// Prefix of the system's shared-memory object names.
    pub fn object_prefix(&self) -> String {
        object_prefix(&self.folder, &self.prefix)
    }

    /// Folder of the sockets and service files, accessible to the user only.
    pub fn folder(&self) -> &StdPath {
        &self.folder
    }

    /// Folder in which the controller stores the description of its arm with the learned terms.
    pub fn learned_folder(&self) -> PathBuf {
        self.folder.join(format!("learned-{}", self.prefix))
    }

    /// File in which the program on the bus stores what the registers of the arm's motors state, see `MotorConstants` of
    /// `supple-model`.
    pub fn motors_file(&self) -> PathBuf {
        self.folder.join(format!("motors-{}.toml", self.prefix))
    }

    /// Returns the files through which the operator confirms that the arm is in its home pose, after it has lost its position
    /// reference.
    pub fn home_pose_confirmation(&self) -> HomePoseConfirmation {
        HomePoseConfirmation::of(&self.folder, &self.prefix)
    }

    pub(crate) fn config(&self) -> &Config {
        &self.config
    }
}

/// Shared-memory names are global on the machine, so they contain the user id and a hash of the folder.
fn object_prefix(folder: &StdPath, prefix: &str) -> String {
    let user = rustix::process::getuid().as_raw();
    // FNV-1a, 32 bits.
    let hash = folder.as_os_str().as_encoded_bytes().iter();
    let hash = hash.fold(0x811c_9dc5_u32, |hash, byte| {
        (hash ^ u32::from(*byte)).wrapping_mul(0x0100_0193)
    });
    format!("{prefix}_{user}_{hash:08x}_")
}

/// Creates the folder, or checks that this user owns it and that no other user can access it.
fn open_folder(folder: &StdPath) -> Result<(), IpcError> {
    open_private_folder(folder).map_err(|error| IpcError::Folder {
        folder: folder.to_owned(),
        remedy: match error {
            PrivateFolderError::Create(_) => "set XDG_RUNTIME_DIR to a folder that can be written",
            PrivateFolderError::Read(_) => "set XDG_RUNTIME_DIR to another folder",
            PrivateFolderError::NoFolder | PrivateFolderError::OtherUser { .. } => {
                "remove it, or set XDG_RUNTIME_DIR to a folder of your own"
            }
            PrivateFolderError::OpenToOthers { .. } => "restrict it with chmod 700",
        },
        cause: format!("it {error}"),
    })
}
