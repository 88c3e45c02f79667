//! A folder for sockets that only its owner can enter: mode 0700, sockets in it 0600.

use crate::error::BusError;
use rustix::fs::{Mode, chmod};
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};
use supple_realtime::{PrivateFolderError, open_private_folder};

/// The longest path that fits a Unix address.
const MAX_PATH_BYTES: usize = 107;

/// An existing folder that belongs to this user and is closed to all others.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OwnerFolder(PathBuf);

impl OwnerFolder {
    /// Creates the folder, or uses an existing one if it belongs to this user and is closed to others.
    ///
    /// # Errors
    /// [`BusError::Folder`] if it cannot be created, belongs to another user, is a link, or is open to others.
    pub fn open(path: impl Into<PathBuf>) -> Result<OwnerFolder, BusError> {
        let path = path.into();
        match open_private_folder(&path) {
            Ok(()) => Ok(OwnerFolder(path)),
            Err(error) => Err(BusError::Folder {
                path,
                remedy: match error {
                    PrivateFolderError::Create(_) => "choose a folder that you may write to",
                    PrivateFolderError::Read(_) | PrivateFolderError::OtherUser { .. } => {
                        "choose a folder of your own"
                    }
                    PrivateFolderError::NoFolder => {
                        "name the folder itself, links are not followed"
                    }
                    PrivateFolderError::OpenToOthers { .. } => "close it with chmod 700",
                },
                problem: error.to_string(),
            }),
        }
    }

    /// Path of the folder.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Binds a datagram socket in the folder, accessible only to the owner. Replaces a file of this name
    /// that no process listens on.
    ///
    /// # Errors
    /// [`BusError::SocketInUse`] if a process listens on it; [`BusError::Folder`] if it cannot be created.
    pub fn bind(&self, name: &str) -> Result<UnixDatagram, BusError> {
        let path = self.0.join(name);
        let refused = |problem: String, remedy| BusError::Folder {
            path: path.clone(),
            problem,
            remedy,
        };
        if path.as_os_str().len() > MAX_PATH_BYTES {
            return Err(refused(
                format!("has {} bytes", path.as_os_str().len()),
                "a socket's path may have 107: choose a shorter folder",
            ));
        }
        if listens(&path) {
            return Err(BusError::SocketInUse { path });
        }
        match std::fs::remove_file(&path) {
            Ok(()) => {}
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
            Err(error) => {
                return Err(refused(
                    format!("cannot be replaced: {error}"),
                    "remove it by hand",
                ));
            }
        }
        let bound = UnixDatagram::bind(&path);
        let socket = bound.map_err(|error| {
            refused(
                format!("cannot be created: {error}"),
                "choose another folder",
            )
        })?;
        chmod(&path, Mode::RUSR | Mode::WUSR)
            .map_err(BusError::io("restricting the permissions of a socket"))?;
        Ok(socket)
    }
}

/// Whether a process has this socket open.
fn listens(path: &Path) -> bool {
    UnixDatagram::unbound().is_ok_and(|probe| probe.connect(path).is_ok())
}
