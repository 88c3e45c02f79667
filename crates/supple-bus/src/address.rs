//! Address of a bus, as given on the command line.

use crate::error::BusError;
use crate::folder::OwnerFolder;
use core::fmt;
use core::str::FromStr;
use std::path::PathBuf;
use supple_realtime::runtime_folder;

/// Address of a bus.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Address {
    /// `can:NAME`: the CAN interface of this name.
    Interface(String),
    /// `unix:FOLDER`: Unix sockets in this folder, which only its owner can access.
    Folder(PathBuf),
}

/// Error: the text is not a bus address.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("bus `{0}`: expected can:NAME for a CAN interface, or unix:FOLDER for sockets")]
pub struct AddressError(String);

impl FromStr for Address {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Address, AddressError> {
        match text.split_once(':') {
            Some(("can", name)) if !name.is_empty() => Ok(Address::Interface(name.to_owned())),
            Some(("unix", folder)) if !folder.is_empty() => Ok(Address::Folder(folder.into())),
            _ => Err(AddressError(text.to_owned())),
        }
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Address::Interface(name) => write!(f, "can:{name}"),
            Address::Folder(folder) => write!(f, "unix:{}", folder.display()),
        }
    }
}

impl Address {
    /// Returns the socket folder of the system that `prefix` identifies: `supple-bus/PREFIX` under `$XDG_RUNTIME_DIR`, or
    /// `/tmp/supple-bus-UID/PREFIX` if the variable is not set.
    ///
    /// # Errors
    /// If the parent folder cannot be created, belongs to another user, or is accessible to other users.
    pub fn of_system(prefix: &str) -> Result<Address, BusError> {
        let parent = OwnerFolder::open(runtime_folder("supple-bus"))?;
        Ok(Address::Folder(parent.path().join(prefix)))
    }
}
