//! A CAN interface of the Linux kernel.
//!
//! The socket receives echoes of its own frames (a frame counts as sent only when the driver confirms it), all error
//! frames, and a count of the frames that were lost because they were not read in time (`SO_RXQ_OVFL`). It carries
//! classic CAN frames, and CAN FD frames if the interface carries them; it ignores remote requests. Bit rates and automatic restart
//! after bus-off are properties of the interface, set when it is brought up:
//! `ip link set can0 up type can bitrate 1000000 restart-ms 100`, for CAN FD with `dbitrate 5000000 fd on`.

use crate::bus::{Bus, BusFault, Event};
use crate::can_frame::{DecodedFrame, EncodedFrame, FD_FRAME_BYTES};
use crate::error::BusError;
use crate::wait::wait_readable_until;
use nix::sys::socket::{self as nix_socket, ControlMessageOwned, MsgFlags, setsockopt};
use rustix::fd::{AsFd, AsRawFd, BorrowedFd};
use rustix::io::{Errno, IoSliceMut};
use rustix::net::{RecvAncillaryBuffer, RecvFlags, ReturnFlags, recvmsg, sockopt};
use socketcan::{CanFdSocket, Socket, SocketOptions};
use std::io;
use supple_can_frame::CanFrame;
use supple_realtime::monotonic_ns;

/// Flag of the kernel for an echo of a frame that the reading socket itself sent (`MSG_CONFIRM`).
const CONFIRM: u32 = 0x800;

/// The kernel charges several times a frame's size to the buffer. This size holds a few hundred frames; the
/// default may silently drop most of a burst.
const RECEIVE_BUFFER_BYTES: usize = 1 << 20;

/// A raw CAN socket.
#[derive(Debug)]
pub struct SocketCan {
    socket: CanFdSocket,
    /// Name of the interface.
    interface: String,
    /// Whether the interface carries FD frames.
    fd: bool,
    /// Whether the kernel attaches its counter of lost frames: to every frame after the first loss.
    counter_attached: bool,
    /// Number of frames lost.
    lost: u64,
    /// Counter of lost frames as the kernel last reported it; it wraps.
    lost_by_kernel: u32,
    /// Buffer for the attached counter.
    ancillary_buffer: Vec<u8>,
}

impl SocketCan {
    /// Opens an interface by its name, such as `can0`.
    ///
    /// # Errors
    /// [`BusError::Interface`] with the kernel's error and a remedy.
    pub fn open(interface: &str) -> Result<SocketCan, BusError> {
        let refused = |source: io::Error| BusError::Interface {
            interface: interface.to_owned(),
            remedy: remedy(&source),
            source,
        };
        let socket = CanFdSocket::open(interface).map_err(refused)?;
        let set_up = || -> io::Result<()> {
            socket.set_recv_own_msgs(true)?;
            socket.set_error_filter_accept_all()?;
            socket.set_nonblocking(true)?;
            sockopt::set_socket_recv_buffer_size(&socket, RECEIVE_BUFFER_BYTES)?;
            setsockopt(&socket, nix_socket::sockopt::RxqOvfl, &1)?;
            Ok(())
        };
        set_up().map_err(refused)?;
        Ok(SocketCan {
            socket,
            interface: interface.to_owned(),
            fd: carries_fd(interface),
            counter_attached: false,
            lost: 0,
            lost_by_kernel: 0,
            ancillary_buffer: nix::cmsg_space!(u32),
        })
    }

    /// Number of frames that were lost because they were not read in time, as the kernel reported with the last frame that was
    /// read; a later loss is reported with the next frame. Each gap is also reported as [`BusFault::Overrun`].
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Sends the error frame of an emulated arm to the other sockets of this machine, if the interface supports it, as `vcan` does.
    ///
    /// # Errors
    /// If the kernel rejects it.
    pub fn send_fault(&mut self, fault: BusFault) -> Result<(), BusError> {
        let sent = rustix::io::write(&self.socket, &EncodedFrame::of_fault(fault));
        sent.map(|_| ())
            .map_err(BusError::io("sending an error frame to the CAN interface"))
    }

    /// Peeks at the counter attached to the next frame; returns whether frames were lost before that frame.
    fn detect_overrun(&mut self) -> Result<bool, BusError> {
        let mut raw = [0; FD_FRAME_BYTES];
        let mut buffers = [IoSliceMut::new(&mut raw)];
        let peeked = nix_socket::recvmsg::<()>(
            self.socket.as_raw_fd(),
            &mut buffers,
            Some(&mut self.ancillary_buffer),
            MsgFlags::MSG_PEEK | MsgFlags::MSG_DONTWAIT,
        );
        let failed = |errno: nix::Error| BusError::Io {
            action: "checking for lost frames",
            source: errno.into(),
        };
        let message = match peeked {
            Ok(message) => message,
            Err(nix::Error::EAGAIN | nix::Error::EINTR) => return Ok(false),
            Err(errno) => return Err(failed(errno)),
        };
        for ancillary in message.cmsgs().map_err(failed)? {
            if let ControlMessageOwned::RxqOvfl(count) = ancillary {
                let more = count.wrapping_sub(self.lost_by_kernel);
                self.lost += u64::from(more);
                self.lost_by_kernel = count;
                return Ok(more > 0);
            }
        }
        Ok(false)
    }

    fn read_event(&mut self) -> Result<Option<Event>, BusError> {
        loop {
            if self.counter_attached && self.detect_overrun()? {
                return Ok(Some(Event::Fault(BusFault::Overrun)));
            }
            let mut raw = [0; FD_FRAME_BYTES];
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
            // Truncated: this read has no buffer for the counter, so a peek with one precedes each later read.
            self.counter_attached |= message.flags.contains(ReturnFlags::CTRUNC);
            match DecodedFrame::decode(&raw[..message.bytes]) {
                DecodedFrame::Data(frame) if message.flags.bits() & CONFIRM != 0 => {
                    return Ok(Some(Event::Sent(frame)));
                }
                DecodedFrame::Data(frame) => return Ok(Some(Event::Frame(frame))),
                DecodedFrame::Fault(fault) => return Ok(Some(Event::Fault(fault))),
                DecodedFrame::Unsupported => {}
            }
        }
    }
}

impl Bus for SocketCan {
    fn now_ns(&self) -> u64 {
        monotonic_ns()
    }

    fn carries_fd(&self) -> bool {
        self.fd
    }

    fn send(&mut self, frame: &CanFrame) -> Result<(), BusError> {
        if frame.is_fd() && !self.fd {
            return Err(BusError::ClassicOnly {
                interface: self.interface.clone(),
            });
        }
        match rustix::io::write(&self.socket, &EncodedFrame::of_data(frame)) {
            Ok(_) => Ok(()),
            Err(Errno::AGAIN | Errno::NOBUFS) => Err(BusError::Full),
            Err(errno) => Err(BusError::io("sending to the CAN interface")(errno)),
        }
    }

    fn receive_until(&mut self, until_ns: u64) -> Result<Option<Event>, BusError> {
        loop {
            if let Some(event) = self.read_event()? {
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

/// Whether an interface carries FD frames: its MTU is then the size of a `struct canfd_frame`.
fn carries_fd(interface: &str) -> bool {
    let mtu = std::fs::read_to_string(format!("/sys/class/net/{interface}/mtu"));
    let mtu = mtu.ok().and_then(|text| text.trim().parse::<usize>().ok());
    mtu.is_some_and(|bytes| bytes >= FD_FRAME_BYTES)
}

fn remedy(error: &io::Error) -> &'static str {
    match error.raw_os_error().map(Errno::from_raw_os_error) {
        Some(Errno::NODEV) => {
            "the interface does not exist: list the interfaces with `ip -details link`, load the driver of the CAN card"
        }
        Some(Errno::AFNOSUPPORT) => {
            "this kernel has no CAN support: load the modules can and can_raw, or use a kernel that has them"
        }
        Some(Errno::NETDOWN) => {
            "the interface is down: bring it up with `ip link set can0 up type can bitrate 1000000 restart-ms 100`"
        }
        Some(Errno::PERM | Errno::ACCESS) => {
            "opening it requires the capability CAP_NET_RAW: run as a user who has it"
        }
        _ => "check the interface with `ip -details link`",
    }
}
