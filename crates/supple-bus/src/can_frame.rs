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

/// Error classes (`CAN_ERR_...`) in the id of an error frame, with the corresponding faults.
const ERROR_CLASSES: [(u32, BusFault); 8] = [
    (0x001, BusFault::TransmitTimeout), // TX_TIMEOUT
    (0x002, BusFault::ArbitrationLost), // LOSTARB
    (0x008, BusFault::Protocol),        // PROT
    (0x010, BusFault::Transceiver),     // TRX
    (0x020, BusFault::NoAcknowledge),   // ACK
    (0x040, BusFault::BusOff),          // BUSOFF
    (0x080, BusFault::Protocol),        // BUSERROR
    (0x100, BusFault::Restarted),       // RESTARTED
];
/// `CAN_ERR_CRTL`: the second data byte has flags of the CAN controller's state.
const CONTROLLER_STATE: u32 = 0x004;
/// Flags of the byte named in [`CONTROLLER_STATE`] (`CAN_ERR_CRTL_...`); each mask joins the flags of reception and transmission.
const CONTROLLER_FLAGS: [(u8, BusFault); 3] = [
    (0x03, BusFault::Overrun), // RX_OVERFLOW, TX_OVERFLOW
    (0x0c, BusFault::Warning), // RX_WARNING, TX_WARNING
    (0x30, BusFault::Passive), // RX_PASSIVE, TX_PASSIVE
];

/// A frame as read from a socket.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DecodedFrame {
    /// A data frame.
    Data(CanFrame),
    /// An error frame.
    Fault(BusFault),
    /// A frame that this bus does not support: a remote request, a frame of invalid length, or an error frame without a
    /// known fault.
    Unsupported,
}

/// A frame as written to a socket: 16 or 72 bytes.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct EncodedFrame {
    bytes: [u8; FD_FRAME_BYTES],
    fd: bool,
}

impl Deref for EncodedFrame {
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

impl fmt::Debug for EncodedFrame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:02x?}", &self[..])
    }
}

impl DecodedFrame {
    /// Decodes a frame of 16 or 72 bytes; other lengths are unsupported.
    pub fn decode(raw: &[u8]) -> DecodedFrame {
        let fd = match raw.len() {
            CAN_FRAME_BYTES => false,
            FD_FRAME_BYTES => true,
            _ => return DecodedFrame::Unsupported,
        };
        let (head, data) = raw.split_at(HEAD_BYTES);
        let &[a, b, c, d, length, flags, ..] = head else {
            return DecodedFrame::Unsupported;
        };
        let raw_id = u32::from_ne_bytes([a, b, c, d]);
        if raw_id & ERROR != 0 {
            return most_severe_fault(raw_id, data)
                .map_or(DecodedFrame::Unsupported, DecodedFrame::Fault);
        }
        if raw_id & REMOTE != 0 {
            return DecodedFrame::Unsupported;
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
        frame.map_or(DecodedFrame::Unsupported, DecodedFrame::Data)
    }
}

impl EncodedFrame {
    /// Encodes a data frame.
    pub fn of_data(frame: &CanFrame) -> EncodedFrame {
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
        EncodedFrame {
            bytes,
            fd: frame.is_fd(),
        }
    }

    /// Encodes an error frame.
    pub fn of_fault(fault: BusFault) -> EncodedFrame {
        let mut bytes = [0; FD_FRAME_BYTES];
        bytes[4] = 8;
        let class = ERROR_CLASSES.iter().find(|(_, of)| *of == fault);
        let flags = CONTROLLER_FLAGS.iter().find(|(_, of)| *of == fault);
        let class = class.map_or(CONTROLLER_STATE, |&(class, _)| class);
        bytes[..4].copy_from_slice(&(ERROR | class).to_ne_bytes());
        bytes[9] = flags.map_or(0, |&(flags, _)| flags);
        EncodedFrame { bytes, fd: false }
    }
}

/// Returns the most severe fault in an error frame.
fn most_severe_fault(id: u32, data: &[u8]) -> Option<BusFault> {
    let controller = data.get(1).copied().unwrap_or(0);
    let classes = ERROR_CLASSES.iter().filter(|(class, _)| id & class != 0);
    let flags = CONTROLLER_FLAGS
        .iter()
        .filter(|(flags, _)| id & CONTROLLER_STATE != 0 && controller & flags != 0);
    let faults = classes.map(|&(_, fault)| fault);
    faults.chain(flags.map(|&(_, fault)| fault)).max()
}
