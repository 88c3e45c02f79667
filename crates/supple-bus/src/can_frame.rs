//! `struct can_frame` and `struct canfd_frame` of Linux, which a SocketCAN socket reads and writes: 16 bytes for a
//! classic frame, 72 bytes for an FD frame. Error frames are always classic.
//!
//! ```text
//! 0..4 id with flags, native order   4 length   5 flags of an FD frame   8..16 or 8..72 data   the rest zero
//! ```
//!
//! Flags in the id: 0x8000_0000 extended id, 0x4000_0000 remote request, 0x2000_0000 error frame. Flags of an FD
//! frame: 1 bit rate switch, 2 error state, 4 FD format. Source: the kernel's `linux/can.h` and `linux/can/error.h`.

use crate::bus::BusFault;
use core::fmt;
use core::ops::Deref;
use supple_can_frame::{CanFrame, CanId, FrameFormat, MAX_FD_BYTES};

/// Size of `struct can_frame`.
pub const CAN_FRAME_BYTES: usize = 16;
/// Size of `struct canfd_frame`.
pub const FD_FRAME_BYTES: usize = 72;

const EXTENDED: u32 = 0x8000_0000;
const REMOTE: u32 = 0x4000_0000;
const ERROR: u32 = 0x2000_0000;
const BIT_RATE_SWITCH: u8 = 0x01;
const FD_FORMAT: u8 = 0x04;
const HEAD_BYTES: usize = FD_FRAME_BYTES - MAX_FD_BYTES;

/// Error classes in the id of an error frame, with the corresponding faults.
const CLASSES: [(u32, BusFault); 8] = [
    (0x001, BusFault::TransmitTimeout),
    (0x002, BusFault::ArbitrationLost),
    (0x008, BusFault::Protocol),
    (0x010, BusFault::Transceiver),
    (0x020, BusFault::NoAcknowledge),
    (0x040, BusFault::BusOff),
    (0x080, BusFault::Protocol),
    (0x100, BusFault::Restarted),
];
/// The class whose second data byte reports the state of the controller.
const CONTROLLER: u32 = 0x004;
/// Flags of that byte.
const CONTROLLER_FLAGS: [(u8, BusFault); 3] = [
    (0x03, BusFault::Overrun),
    (0x0c, BusFault::Warning),
    (0x30, BusFault::Passive),
];

/// A parsed raw frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(
    clippy::large_enum_variant,
    reason = "it lives on the stack of one function, and a box would allocate"
)]
pub enum WireFrame {
    /// A data frame.
    Data(CanFrame),
    /// An error frame.
    Fault(BusFault),
    /// Frames that this bus does not support: remote requests, invalid lengths, and error frames without a known
    /// fault.
    Unsupported,
}

/// A raw frame to be written: 16 or 72 bytes.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct RawFrame {
    bytes: [u8; FD_FRAME_BYTES],
    fd: bool,
}

impl Deref for RawFrame {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        let length = if self.fd {
            FD_FRAME_BYTES
        } else {
            CAN_FRAME_BYTES
        };
        &self.bytes[..length]
    }
}

impl fmt::Debug for RawFrame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:02x?}", &self[..])
    }
}

impl WireFrame {
    /// Parses a raw frame of 16 or 72 bytes; other lengths are unsupported.
    pub fn parse(raw: &[u8]) -> WireFrame {
        let fd = match raw.len() {
            CAN_FRAME_BYTES => false,
            FD_FRAME_BYTES => true,
            _ => return WireFrame::Unsupported,
        };
        let (head, data) = raw.split_at(HEAD_BYTES);
        let &[a, b, c, d, length, flags, ..] = head else {
            return WireFrame::Unsupported;
        };
        let raw_id = u32::from_ne_bytes([a, b, c, d]);
        if raw_id & ERROR != 0 {
            return fault(raw_id, data).map_or(WireFrame::Unsupported, WireFrame::Fault);
        }
        if raw_id & REMOTE != 0 {
            return WireFrame::Unsupported;
        }
        let format = if fd {
            FrameFormat::Fd {
                bit_rate_switch: flags & BIT_RATE_SWITCH != 0,
            }
        } else {
            FrameFormat::Classic
        };
        let id = match raw_id & EXTENDED {
            0 => CanId::standard(raw_id),
            _ => CanId::extended(raw_id & !EXTENDED),
        };
        let payload = data.get(..usize::from(length));
        let frame = match (id, payload) {
            (Ok(id), Some(payload)) => CanFrame::of_format(id, format, payload).ok(),
            _ => None,
        };
        frame.map_or(WireFrame::Unsupported, WireFrame::Data)
    }

    /// The raw form of a data frame.
    pub fn data(frame: &CanFrame) -> RawFrame {
        let mut bytes = [0; FD_FRAME_BYTES];
        let id = frame.id();
        let flag = if id.is_extended() { EXTENDED } else { 0 };
        let payload = frame.payload();
        bytes[..4].copy_from_slice(&(id.raw() | flag).to_ne_bytes());
        bytes[4] = payload.len() as u8;
        bytes[5] = match frame.format() {
            FrameFormat::Classic => 0,
            FrameFormat::Fd { bit_rate_switch } => {
                FD_FORMAT | if bit_rate_switch { BIT_RATE_SWITCH } else { 0 }
            }
        };
        bytes[HEAD_BYTES..HEAD_BYTES + payload.len()].copy_from_slice(payload);
        RawFrame {
            bytes,
            fd: frame.is_fd(),
        }
    }

    /// The raw form of an error frame.
    pub fn fault(fault: BusFault) -> RawFrame {
        let mut bytes = [0; FD_FRAME_BYTES];
        bytes[4] = 8;
        let class = CLASSES.iter().find(|(_, of)| *of == fault);
        let flags = CONTROLLER_FLAGS.iter().find(|(_, of)| *of == fault);
        let class = class.map_or(CONTROLLER, |&(class, _)| class);
        bytes[..4].copy_from_slice(&(ERROR | class).to_ne_bytes());
        bytes[9] = flags.map_or(0, |&(flags, _)| flags);
        RawFrame { bytes, fd: false }
    }
}

/// The most severe fault in an error frame.
fn fault(id: u32, data: &[u8]) -> Option<BusFault> {
    let controller = data.get(1).copied().unwrap_or(0);
    let classes = CLASSES.iter().filter(|(class, _)| id & class != 0);
    let flags = CONTROLLER_FLAGS
        .iter()
        .filter(|(flags, _)| id & CONTROLLER != 0 && controller & flags != 0);
    let faults = classes.map(|&(_, fault)| fault);
    faults.chain(flags.map(|&(_, fault)| fault)).max()
}
