//! Sends messages to the service manager as `sd_notify(3)` does: ready, alive, stopping.
//!
//! Each message is one datagram to the Unix socket that the manager names in `NOTIFY_SOCKET`. Sending never blocks: if the
//! manager's queue is full, the message is dropped, and the next watchdog message replaces it.

use core::time::Duration;
use std::ffi::{OsStr, OsString};
use std::io::{Error, ErrorKind};
use std::os::linux::net::SocketAddrExt;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};

/// Error in notifying the service manager.
#[derive(Debug, thiserror::Error)]
pub enum NotifyError {
    /// The socket of the manager cannot be addressed or written to.
    #[error(
        "NOTIFY_SOCKET is `{address}`, which cannot be written to ({error}): start the program by its \
         service, or unset NOTIFY_SOCKET"
    )]
    Socket {
        /// Value of the variable.
        address: String,
        /// Error of the system.
        error: Error,
    },
    /// The thread for the watchdog messages cannot be started.
    #[error(
        "the thread for watchdog messages cannot be started: {0}; raise the user's limit of processes"
    )]
    Thread(Error),
    /// The watchdog time is invalid.
    #[error(
        "WATCHDOG_USEC is `{value}`, not a positive number of microseconds: correct WatchdogSec of the \
         service"
    )]
    Watchdog {
        /// Value of the variable.
        value: String,
    },
}

/// Connection to the service manager.
#[derive(Debug)]
pub struct Notifier {
    socket: UnixDatagram,
    address: SocketAddr,
    watchdog: Option<Duration>,
}

/// Environment variables that the service manager has set for this process.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ManagerVariables {
    /// `NOTIFY_SOCKET`: path of a socket, or `@` and an abstract name.
    pub notify_socket: Option<OsString>,
    /// `WATCHDOG_USEC`: time without a watchdog message after which the manager ends the process \[us\].
    pub watchdog_usec: Option<OsString>,
    /// `WATCHDOG_PID`: id of the process that the watchdog monitors; every process if not given.
    pub watchdog_pid: Option<OsString>,
}

impl ManagerVariables {
    /// Reads the variables of this process.
    pub fn from_environment() -> ManagerVariables {
        let variable = |name| std::env::var_os(name).filter(|value| !value.is_empty());
        ManagerVariables {
            notify_socket: variable("NOTIFY_SOCKET"),
            watchdog_usec: variable("WATCHDOG_USEC"),
            watchdog_pid: variable("WATCHDOG_PID"),
        }
    }
}

impl Notifier {
    /// Connects to the service manager that started this process; `None` if NOTIFY_SOCKET is not set.
    ///
    /// # Errors
    /// [`NotifyError`] with the variable and its value.
    pub fn new(variables: &ManagerVariables) -> Result<Option<Notifier>, NotifyError> {
        let Some(name) = &variables.notify_socket else {
            return Ok(None);
        };
        let failed = |error| NotifyError::Socket {
            address: name.to_string_lossy().into_owned(),
            error,
        };
        let address = address_of(name).map_err(failed)?;
        let socket = UnixDatagram::unbound().map_err(failed)?;
        socket.set_nonblocking(true).map_err(failed)?;
        Ok(Some(Notifier {
            socket,
            address,
            watchdog: watchdog(variables)?,
        }))
    }

    /// Time without a watchdog message after which the manager ends this process, if it has a watchdog.
    pub fn watchdog(&self) -> Option<Duration> {
        self.watchdog
    }

    /// Reports that the start is complete.
    ///
    /// # Errors
    /// [`NotifyError::Socket`] if the manager does not listen.
    pub fn ready(&self) -> Result<(), NotifyError> {
        self.send("READY=1\n")
    }

    /// Sends a watchdog message.
    ///
    /// # Errors
    /// The same as those of [`Notifier::ready`].
    pub fn alive(&self) -> Result<(), NotifyError> {
        self.send("WATCHDOG=1\n")
    }

    /// Reports that the process is about to end.
    ///
    /// # Errors
    /// The same as those of [`Notifier::ready`].
    pub fn stopping(&self) -> Result<(), NotifyError> {
        self.send("STOPPING=1\n")
    }

    fn send(&self, message: &str) -> Result<(), NotifyError> {
        match self.socket.send_to_addr(message.as_bytes(), &self.address) {
            Ok(_) => Ok(()),
            Err(error) if error.kind() == ErrorKind::WouldBlock => Ok(()),
            Err(error) => Err(NotifyError::Socket {
                address: format!("{:?}", self.address),
                error,
            }),
        }
    }
}

fn address_of(name: &OsStr) -> Result<SocketAddr, Error> {
    match name.as_bytes() {
        [b'@', rest @ ..] => SocketAddr::from_abstract_name(rest),
        [b'/', ..] => SocketAddr::from_pathname(name),
        _ => Err(Error::new(
            ErrorKind::InvalidInput,
            "neither an absolute path nor an abstract name",
        )),
    }
}

fn watchdog(variables: &ManagerVariables) -> Result<Option<Duration>, NotifyError> {
    let other = |pid: &OsString| pid.to_str() != Some(&std::process::id().to_string());
    if variables.watchdog_pid.as_ref().is_some_and(other) {
        return Ok(None);
    }
    let Some(value) = &variables.watchdog_usec else {
        return Ok(None);
    };
    let parsed = value.to_str().and_then(|text| text.parse::<u64>().ok());
    match parsed {
        Some(us) if us > 0 => Ok(Some(Duration::from_micros(us))),
        _ => Err(NotifyError::Watchdog {
            value: value.to_string_lossy().into_owned(),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn variables(socket: &str) -> ManagerVariables {
        ManagerVariables {
            notify_socket: Some(socket.into()),
            ..ManagerVariables::default()
        }
    }

    fn received(socket: &UnixDatagram) -> String {
        let mut buffer = [0; 256];
        let bytes = socket.recv(&mut buffer).unwrap();
        String::from_utf8(buffer[..bytes].to_vec()).unwrap()
    }

    #[test]
    fn messages_arrive_at_path_and_abstract_addresses() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("notify");
        let name = format!("supple-notify-{}", std::process::id());
        let abstract_name = SocketAddr::from_abstract_name(&name).unwrap();
        for (manager, address) in [
            (UnixDatagram::bind(&path), path.display().to_string()),
            (UnixDatagram::bind_addr(&abstract_name), format!("@{name}")),
        ] {
            let manager = manager.unwrap();
            let notifier = Notifier::new(&variables(&address)).unwrap().unwrap();
            notifier.ready().unwrap();
            notifier.alive().unwrap();
            notifier.stopping().unwrap();
            for expected in ["READY=1\n", "WATCHDOG=1\n", "STOPPING=1\n"] {
                assert_eq!(received(&manager), expected);
            }
        }
    }

    #[test]
    fn sending_never_blocks_when_the_manager_does_not_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("notify");
        let _manager = UnixDatagram::bind(&path).unwrap();
        let notifier = Notifier::new(&variables(&path.display().to_string()));
        let notifier = notifier.unwrap().unwrap();
        for _ in 0..10_000 {
            notifier.alive().unwrap();
        }
    }

    #[test]
    fn new_returns_no_notifier_without_a_manager() {
        assert!(
            Notifier::new(&ManagerVariables::default())
                .unwrap()
                .is_none()
        );
    }

    #[test]
    fn watchdog_time_applies_only_to_its_process() {
        let of = |usec: &str, pid: Option<u32>| ManagerVariables {
            watchdog_usec: Some(usec.into()),
            watchdog_pid: pid.map(|pid| pid.to_string().into()),
            ..ManagerVariables::default()
        };
        let own = std::process::id();
        let second = Some(Duration::from_secs(1));
        assert_eq!(watchdog(&of("1000000", None)).unwrap(), second);
        assert_eq!(watchdog(&of("1000000", Some(own))).unwrap(), second);
        assert_eq!(watchdog(&of("1000000", Some(own + 1))).unwrap(), None);
        for wrong in ["0", "-1", "soon", "1e6", ""] {
            let error = watchdog(&of(wrong, None)).unwrap_err().to_string();
            assert!(error.contains("WATCHDOG_USEC"), "{error}");
        }
    }

    #[test]
    fn invalid_address_is_named_in_the_error() {
        for wrong in ["relative", "/"] {
            let made = Notifier::new(&variables(wrong));
            let sent = made.and_then(|notifier| notifier.unwrap().ready());
            let error = sent.unwrap_err().to_string();
            assert!(error.contains("NOTIFY_SOCKET"), "{error}");
            assert!(error.contains(wrong), "{error}");
        }
    }
}
