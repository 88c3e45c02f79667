//! Bells: a byte that wakes whoever waits for a message.
//!
//! They are sockets in the system's folder and not events of iceoryx2, whose 0.9.3 allocates at every wait with a
//! time-out, to have the words ready if it should fail, and sets the socket's time-out anew each time.

use crate::domain::Domain;
use crate::error::IpcError;
use core::cell::Cell;
use core::time::Duration;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::net::{RecvFlags, recv};
use std::fs::{self, Permissions};
use std::io::{self, ErrorKind};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixDatagram;
use std::path::PathBuf;

/// Why a bell rings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ring {
    /// There is something to read.
    Sent = 0,
    /// There soon will be.
    Announced = 1,
}

/// What ended a wait.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Awoken {
    By(Ring),
    BySignal,
    /// It did not ring in time.
    InVain,
}

fn path(domain: &Domain, name: &str) -> PathBuf {
    let name = format!("{}.{name}.bell", domain.prefix());
    domain.folder().join(name)
}

/// The rope of a bell.
#[derive(Debug)]
pub(crate) struct Rope {
    socket: UnixDatagram,
    path: PathBuf,
    connected: Cell<bool>,
}

impl Rope {
    pub fn new(domain: &Domain, name: &'static str) -> Result<Rope, IpcError> {
        let path = path(domain, name);
        let socket = UnixDatagram::unbound()
            .and_then(|socket| socket.set_nonblocking(true).map(|()| socket))
            .map_err(|error| failed(name, &error))?;
        Ok(Rope {
            socket,
            path,
            connected: Cell::new(false),
        })
    }

    /// Wakes whoever waits, and says why. That nobody listens is not the ringer's concern, nor that somebody has
    /// heard of rings enough.
    pub fn ring(&self, why: Ring) {
        // One who listens in the place of another is found at the second attempt.
        for _ in 0..2 {
            if !self.connected.get() && self.socket.connect(&self.path).is_err() {
                return;
            }
            self.connected.set(true);
            match self.socket.send(&[why as u8]) {
                Err(error) if error.kind() != ErrorKind::WouldBlock => self.connected.set(false),
                _ => return,
            }
        }
    }
}

/// The side of a bell that hears it: one at a time, which the caller has to make sure of.
#[derive(Debug)]
pub(crate) struct Bell {
    socket: UnixDatagram,
    name: &'static str,
    path: PathBuf,
    /// That the socket has now.
    timeout: Cell<Duration>,
}

impl Bell {
    pub fn new(domain: &Domain, name: &'static str) -> Result<Bell, IpcError> {
        let path = path(domain, name);
        let unusable = |error: io::Error| IpcError::Folder {
            folder: domain.folder().to_owned(),
            cause: format!("{}: {error}", path.display()),
            remedy: "set XDG_RUNTIME_DIR to a folder with a short path that can be written",
        };
        // Of one who was killed.
        match fs::remove_file(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(unusable(error)),
            _ => {}
        }
        let socket = UnixDatagram::bind(&path).map_err(unusable)?;
        fs::set_permissions(&path, Permissions::from_mode(0o600)).map_err(unusable)?;
        Ok(Bell {
            socket,
            name,
            path,
            timeout: Cell::new(Duration::ZERO),
        })
    }

    /// Forgets that it has rung: what it rang for is known.
    pub fn silence(&self) -> Result<(), IpcError> {
        while self.rung()? {}
        Ok(())
    }

    /// Waits until it rings, or for `timeout`, more than zero, or until a signal comes. For who is seldom left
    /// waiting: the kernel counts the socket's time-out in ticks of several milliseconds, and sets no timer of high
    /// resolution, which is dear in a virtual machine (`benches/latency`).
    pub fn wait_in_ticks(&self, timeout: Duration) -> Result<Awoken, IpcError> {
        if self.timeout.get() != timeout {
            let set = self.socket.set_read_timeout(Some(timeout));
            set.map_err(|error| failed(self.name, &error))?;
            self.timeout.set(timeout);
        }
        let mut why = [0];
        match self.socket.recv(&mut why) {
            Ok(_) if why == [Ring::Announced as u8] => Ok(Awoken::By(Ring::Announced)),
            Ok(_) => Ok(Awoken::By(Ring::Sent)),
            Err(error) => match error.kind() {
                ErrorKind::WouldBlock | ErrorKind::TimedOut => Ok(Awoken::InVain),
                ErrorKind::Interrupted => Ok(Awoken::BySignal),
                _ => Err(failed(self.name, &error)),
            },
        }
    }

    /// Waits until it rings, or for `timeout`, or until a signal comes; false where it did not ring.
    pub fn wait(&self, timeout: Duration) -> Result<bool, IpcError> {
        let timeout = Timespec::try_from(timeout).unwrap_or(Timespec {
            tv_sec: i64::MAX,
            tv_nsec: 0,
        });
        match poll(
            &mut [PollFd::new(&self.socket, PollFlags::IN)],
            Some(&timeout),
        ) {
            Ok(0) | Err(Errno::INTR) => Ok(false),
            Ok(_) => self.rung(),
            Err(error) => Err(failed(self.name, &error.into())),
        }
    }

    /// Hears it once, where it has rung.
    fn rung(&self) -> Result<bool, IpcError> {
        match recv(&self.socket, &mut [0_u8], RecvFlags::DONTWAIT) {
            Ok(_) => Ok(true),
            Err(Errno::WOULDBLOCK | Errno::INTR) => Ok(false),
            Err(error) => Err(failed(self.name, &error.into())),
        }
    }
}

impl Drop for Bell {
    fn drop(&mut self) {
        // The next who listens removes what is left.
        let _ = fs::remove_file(&self.path);
    }
}

pub(crate) fn failed(name: &str, cause: &io::Error) -> IpcError {
    IpcError::Service {
        service: name.to_owned(),
        cause: cause.to_string(),
    }
}
