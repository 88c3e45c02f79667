//! A datagram socket with the path of its only peer, which may connect and disconnect.

use crate::error::BusError;
use crate::folder::OwnerFolder;
use rustix::fd::{AsFd, BorrowedFd};
use std::io::ErrorKind;
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};

#[derive(Debug)]
pub(crate) struct Endpoint {
    socket: UnixDatagram,
    path: PathBuf,
    peer: PathBuf,
}

/// Result of sending a datagram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Delivery {
    Delivered,
    /// The peer exists, but its queue is full.
    Full,
    NoPeer,
}

impl Endpoint {
    pub fn new(folder: &OwnerFolder, own: &str, peer: &str) -> Result<Endpoint, BusError> {
        let socket = folder.bind(own)?;
        socket
            .set_nonblocking(true)
            .map_err(|source| BusError::Io {
                action: "making a socket non-blocking",
                source,
            })?;
        Ok(Endpoint {
            socket,
            path: folder.path().join(own),
            peer: folder.path().join(peer),
        })
    }

    pub fn peer(&self) -> &Path {
        &self.peer
    }

    pub fn send(&self, datagram: &[u8]) -> Result<Delivery, BusError> {
        match self.socket.send_to(datagram, &self.peer) {
            Ok(_) => Ok(Delivery::Delivered),
            Err(error) => match error.kind() {
                ErrorKind::WouldBlock => Ok(Delivery::Full),
                ErrorKind::NotFound | ErrorKind::ConnectionRefused | ErrorKind::ConnectionReset => {
                    Ok(Delivery::NoPeer)
                }
                _ => Err(BusError::Io {
                    action: "sending a datagram",
                    source: error,
                }),
            },
        }
    }

    /// Receives a datagram; one longer than the buffer is truncated.
    pub fn receive_into<'a>(&self, buffer: &'a mut [u8]) -> Result<Option<&'a [u8]>, BusError> {
        loop {
            match self.socket.recv(buffer) {
                Ok(length) => return Ok(Some(&buffer[..length])),
                Err(error) => match error.kind() {
                    ErrorKind::WouldBlock => return Ok(None),
                    ErrorKind::Interrupted | ErrorKind::ConnectionReset => {}
                    _ => {
                        return Err(BusError::Io {
                            action: "receiving a datagram",
                            source: error,
                        });
                    }
                },
            }
        }
    }
}

impl AsFd for Endpoint {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.socket.as_fd()
    }
}

impl Drop for Endpoint {
    fn drop(&mut self) {
        // If the socket file is already removed there is nothing to do.
        let _ = std::fs::remove_file(&self.path);
    }
}
