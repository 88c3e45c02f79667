//! A CAN interface of the Linux kernel.
//!
//! Opened with its own messages echoed, so that a frame counts as sent only when the driver says that
//! it left, and with all error frames on. Frames with extended ids and remote requests are passed over.
//! Bit rate and automatic restart belong to the interface and are set by who brings it up:
//! `ip link set can0 up type can bitrate 1000000 restart-ms 100`.

use crate::bus::{Bus, BusFault, Event};
use crate::can_frame::{CAN_FRAME_BYTES, WireFrame};
use crate::clock::{monotonic_ns, wait_readable_until};
use crate::error::BusError;
use rustix::fd::{AsFd, BorrowedFd};
use rustix::io::{Errno, IoSliceMut};
use rustix::net::{RecvAncillaryBuffer, RecvFlags, recvmsg, sockopt};
use socketcan::{CanSocket, Socket, SocketOptions};
use std::io;
use supple_puck::CanFrame;

/// Set by the kernel on an echoed frame of the very socket that reads it (`MSG_CONFIRM`).
const CONFIRM: u32 = 0x800;

/// The kernel accounts several times a frame's size for each; this holds a few hundred frames, where the
/// default may lose most of a burst in silence.
const RECEIVE_BUFFER_BYTES: usize = 1 << 20;

/// A raw CAN socket.
#[derive(Debug)]
pub struct SocketCan {
    socket: CanSocket,
}

impl SocketCan {
    /// Opens an interface by its name, such as `can0`.
    ///
    /// # Errors
    /// [`BusError::Interface`] says what the kernel says and what to do.
    pub fn open(interface: &str) -> Result<SocketCan, BusError> {
        let refused = |source: io::Error| BusError::Interface {
            interface: interface.to_owned(),
            remedy: remedy(&source),
            source,
        };
        let socket = CanSocket::open(interface).map_err(refused)?;
        let set_up = || -> io::Result<()> {
            socket.set_recv_own_msgs(true)?;
            socket.set_error_filter_accept_all()?;
            socket.set_nonblocking(true)?;
            sockopt::set_socket_recv_buffer_size(&socket, RECEIVE_BUFFER_BYTES)?;
            Ok(())
        };
        set_up().map_err(refused)?;
        Ok(SocketCan { socket })
    }

    /// Puts an error frame on the bus for the other sockets of this machine to see, where the interface
    /// lets it, as `vcan` does.
    ///
    /// # Errors
    /// Where the kernel refuses it.
    pub fn send_fault(&mut self, fault: BusFault) -> Result<(), BusError> {
        let sent = rustix::io::write(&self.socket, &WireFrame::fault(fault));
        sent.map(|_| ())
            .map_err(BusError::io("sending an error frame to the CAN interface"))
    }

    fn take(&mut self) -> Result<Option<Event>, BusError> {
        loop {
            let mut raw = [0; CAN_FRAME_BYTES];
            let received = recvmsg(
                &self.socket,
                &mut [IoSliceMut::new(&mut raw)],
                &mut RecvAncillaryBuffer::default(),
                RecvFlags::DONTWAIT,
            );
            let message = match received {
                Ok(message) => message,
                Err(Errno::AGAIN) => return Ok(None),
                Err(Errno::INTR) => continue,
                Err(errno) => return Err(BusError::io("receiving from the CAN interface")(errno)),
            };
            match WireFrame::parse(&raw) {
                WireFrame::Data(frame) if message.flags.bits() & CONFIRM != 0 => {
                    return Ok(Some(Event::Sent(frame)));
                }
                WireFrame::Data(frame) => return Ok(Some(Event::Frame(frame))),
                WireFrame::Fault(fault) => return Ok(Some(Event::Fault(fault))),
                WireFrame::Foreign => {}
            }
        }
    }
}

impl Bus for SocketCan {
    fn now_ns(&self) -> u64 {
        monotonic_ns()
    }

    fn send(&mut self, frame: &CanFrame) -> Result<(), BusError> {
        match rustix::io::write(&self.socket, &WireFrame::data(frame)) {
            Ok(_) => Ok(()),
            Err(Errno::AGAIN | Errno::NOBUFS) => Err(BusError::Full),
            Err(errno) => Err(BusError::io("sending to the CAN interface")(errno)),
        }
    }

    fn receive_until(&mut self, until_ns: u64) -> Result<Option<Event>, BusError> {
        loop {
            if let Some(event) = self.take()? {
                return Ok(Some(event));
            }
            let readable = wait_readable_until(&self.socket, until_ns)?;
            if !readable && monotonic_ns() >= until_ns {
                return Ok(None);
            }
        }
    }
}

impl AsFd for SocketCan {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.socket.as_fd()
    }
}

fn remedy(error: &io::Error) -> &'static str {
    match error.raw_os_error().map(Errno::from_raw_os_error) {
        Some(Errno::NODEV) => {
            "there is no such interface: see `ip -details link`, load the driver of the CAN card"
        }
        Some(Errno::AFNOSUPPORT) => {
            "this kernel has no CAN: load the modules can and can_raw, or use a kernel that has them"
        }
        Some(Errno::NETDOWN) => {
            "bring it up: ip link set can0 up type can bitrate 1000000 restart-ms 100"
        }
        Some(Errno::PERM | Errno::ACCESS) => "you may not open it: ask for CAP_NET_RAW",
        _ => "see `ip -details link`",
    }
}
