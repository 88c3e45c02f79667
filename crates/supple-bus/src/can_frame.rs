//! `struct can_frame` of Linux, which a SocketCAN socket reads and writes: 16 bytes.
//!
//! ```text
//! 0..4 id with flags, native order   4 length   5..8 zero   8..16 data
//! ```
//!
//! Flags in the id: 0x8000_0000 extended id, 0x4000_0000 remote request, 0x2000_0000 error frame.
//! Source: the kernel's `linux/can.h` and `linux/can/error.h`.

use crate::bus::BusFault;
use supple_puck::CanFrame;

/// Size of `struct can_frame`.
pub const CAN_FRAME_BYTES: usize = 16;

const EXTENDED: u32 = 0x8000_0000;
const REMOTE: u32 = 0x4000_0000;
const ERROR: u32 = 0x2000_0000;

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
pub enum WireFrame {
    /// A data frame with an 11-bit id.
    Data(CanFrame),
    /// An error frame.
    Fault(BusFault),
    /// Frames that this bus does not support: extended ids, remote requests, lengths above eight, and error
    /// frames without a known fault.
    Unsupported,
}

impl WireFrame {
    /// Parses a raw frame.
    pub fn parse(raw: &[u8; CAN_FRAME_BYTES]) -> WireFrame {
        let [a, b, c, d, length, _, _, _, data @ ..] = *raw;
        let id = u32::from_ne_bytes([a, b, c, d]);
        if id & ERROR != 0 {
            return fault(id, data).map_or(WireFrame::Unsupported, WireFrame::Fault);
        }
        if id & (EXTENDED | REMOTE) != 0 {
            return WireFrame::Unsupported;
        }
        let payload = data.get(..usize::from(length));
        payload
            .and_then(|payload| CanFrame::from_raw(id, payload).ok())
            .map_or(WireFrame::Unsupported, WireFrame::Data)
    }

    /// The raw form of a data frame.
    pub fn data(frame: &CanFrame) -> [u8; CAN_FRAME_BYTES] {
        let mut raw = [0; CAN_FRAME_BYTES];
        raw[..4].copy_from_slice(&u32::from(frame.id().raw()).to_ne_bytes());
        raw[4] = frame.dlc();
        raw[8..8 + frame.payload().len()].copy_from_slice(frame.payload());
        raw
    }

    /// The raw form of an error frame.
    pub fn fault(fault: BusFault) -> [u8; CAN_FRAME_BYTES] {
        let mut raw = [0; CAN_FRAME_BYTES];
        raw[4] = 8;
        let class = CLASSES.iter().find(|(_, of)| *of == fault);
        let flags = CONTROLLER_FLAGS.iter().find(|(_, of)| *of == fault);
        let class = class.map_or(CONTROLLER, |&(class, _)| class);
        raw[..4].copy_from_slice(&(ERROR | class).to_ne_bytes());
        raw[9] = flags.map_or(0, |&(flags, _)| flags);
        raw
    }
}

/// The most severe fault in an error frame.
fn fault(id: u32, data: [u8; 8]) -> Option<BusFault> {
    let classes = CLASSES.iter().filter(|(class, _)| id & class != 0);
    let flags = CONTROLLER_FLAGS
        .iter()
        .filter(|(flags, _)| id & CONTROLLER != 0 && data[1] & flags != 0);
    let faults = classes.map(|&(_, fault)| fault);
    faults.chain(flags.map(|&(_, fault)| fault)).max()
}
