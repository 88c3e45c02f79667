//! Wake-up sockets: one datagram wakes the process that waits for a message.
//!
//! These are Unix sockets in the system's folder, not iceoryx2 events: iceoryx2 0.9.3 allocates an error string in
//! every timed wait and sets the socket timeout again each time.

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

/// Reason for a wake-up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum WakeReason {
    /// A message was sent.
    MessageSent = 0,
    /// A message will follow soon.
    Announced = 1,
}

/// Result of a wait.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum WaitResult {
    Notified(WakeReason),
    SignalReceived,
    /// The timeout expired.
    TimedOut,
}

fn path(domain: &Domain, name: &str) -> PathBuf {
    let name = format!("{}.{name}.wake", domain.prefix());
    domain.folder().join(name)
}

/// Sender of wake-ups.
#[derive(Debug)]
pub(crate) struct WakeSender {
    socket: UnixDatagram,
    path: PathBuf,
    connected: Cell<bool>,
}

impl WakeSender {
    pub fn new(domain: &Domain, name: &'static str) -> Result<WakeSender, IpcError> {
        let path = path(domain, name);
        let socket = UnixDatagram::unbound()
            .and_then(|socket| socket.set_nonblocking(true).map(|()| socket))
            .map_err(|error| failed(name, &error))?;
        Ok(WakeSender {
            socket,
            path,
            connected: Cell::new(false),
        })
    }

    /// Wakes the receiver and gives the reason. A missing receiver and a full receive buffer are ignored.
    pub fn notify(&self, why: WakeReason) {
        // If another process has replaced the receiver, the second attempt reconnects.
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

/// Receiver of wake-ups. The caller must make sure that only one exists per name.
#[derive(Debug)]
pub(crate) struct WakeReceiver {
    socket: UnixDatagram,
    name: &'static str,
    path: PathBuf,
    /// Receive timeout currently set on the socket.
    timeout: Cell<Duration>,
}

impl WakeReceiver {
    pub fn new(domain: &Domain, name: &'static str) -> Result<WakeReceiver, IpcError> {
        let path = path(domain, name);
        let unusable = |error: io::Error| IpcError::Folder {
            folder: domain.folder().to_owned(),
            cause: format!("{}: {error}", path.display()),
            remedy: "set XDG_RUNTIME_DIR to a folder with a short path that can be written",
        };
        // A receiver that was killed leaves its socket file.
        match fs::remove_file(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(unusable(error)),
            _ => {}
        }
        let socket = UnixDatagram::bind(&path).map_err(unusable)?;
        fs::set_permissions(&path, Permissions::from_mode(0o600)).map_err(unusable)?;
        Ok(WakeReceiver {
            socket,
            name,
            path,
            timeout: Cell::new(Duration::ZERO),
        })
    }

    /// Discards pending wake-ups whose messages the caller has already handled.
    pub fn discard_wakeups(&self) -> Result<(), IpcError> {
        while self.try_receive()? {}
        Ok(())
    }

    /// Waits for a wake-up, a signal, or `timeout` (must be above zero). Use it where the timeout rarely expires: the
    /// kernel rounds a socket timeout to scheduler ticks of several milliseconds, but needs no high-resolution timer,
    /// which is expensive in a virtual machine (`benches/latency`).
    pub fn wait_coarse(&self, timeout: Duration) -> Result<WaitResult, IpcError> {
        if self.timeout.get() != timeout {
            let set = self.socket.set_read_timeout(Some(timeout));
            set.map_err(|error| failed(self.name, &error))?;
            self.timeout.set(timeout);
        }
        let mut why = [0];
        match self.socket.recv(&mut why) {
            Ok(_) if why == [WakeReason::Announced as u8] => {
                Ok(WaitResult::Notified(WakeReason::Announced))
            }
            Ok(_) => Ok(WaitResult::Notified(WakeReason::MessageSent)),
            Err(error) => match error.kind() {
                ErrorKind::WouldBlock | ErrorKind::TimedOut => Ok(WaitResult::TimedOut),
                ErrorKind::Interrupted => Ok(WaitResult::SignalReceived),
                _ => Err(failed(self.name, &error)),
            },
        }
    }

    /// Waits for a wake-up, a signal, or `timeout`; returns whether a wake-up arrived.
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
            Ok(_) => self.try_receive(),
            Err(error) => Err(failed(self.name, &error.into())),
        }
    }

    /// Consumes one pending wake-up, if there is one.
    fn try_receive(&self) -> Result<bool, IpcError> {
        match recv(&self.socket, &mut [0_u8], RecvFlags::DONTWAIT) {
            Ok(_) => Ok(true),
            Err(Errno::WOULDBLOCK | Errno::INTR) => Ok(false),
            Err(error) => Err(failed(self.name, &error.into())),
        }
    }
}

impl Drop for WakeReceiver {
    fn drop(&mut self) {
        // If this fails, the next receiver removes the file.
        let _ = fs::remove_file(&self.path);
    }
}

pub(crate) fn failed(name: &str, cause: &io::Error) -> IpcError {
    IpcError::Service {
        service: name.to_owned(),
        cause: cause.to_string(),
    }
}
