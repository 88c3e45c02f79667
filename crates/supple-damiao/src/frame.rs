//! A frame of these motors: an 11-bit id and up to eight bytes, the same in classic CAN and in CAN FD.

use core::fmt;
use supple_can_frame::{CanFrame, CanId, FrameFormat};

/// Id and payload.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Frame {
    id: u16,
    length: u8,
    // Bytes from `length` on are zero, so that the derived equality ignores them.
    bytes: [u8; 8],
}

/// Error: not a frame of these motors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameError {
    /// An id of more than 11 bits.
    Id(u32),
    /// A payload of this many bytes; these motors use eight at most.
    Length(usize),
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FrameError::Id(id) => write!(f, "id {id:#x} has more than 11 bits"),
            FrameError::Length(found) => {
                write!(
                    f,
                    "payload has {found} bytes, frames of these motors at most 8"
                )
            }
        }
    }
}

impl core::error::Error for FrameError {}

impl Frame {
    /// A frame with `payload`, eight bytes at most.
    ///
    /// # Errors
    /// An id above 0x7FF, or a longer payload.
    pub fn new(id: u32, payload: &[u8]) -> Result<Frame, FrameError> {
        if id > 0x7FF {
            return Err(FrameError::Id(id));
        }
        let mut bytes = [0; 8];
        let target = bytes.get_mut(..payload.len());
        target
            .ok_or(FrameError::Length(payload.len()))?
            .copy_from_slice(payload);
        Ok(Frame {
            id: id as u16,
            length: payload.len() as u8,
            bytes,
        })
    }

    /// A frame of eight bytes; of the id the low 11 bits.
    pub(crate) const fn of(id: u16, bytes: [u8; 8]) -> Frame {
        Frame {
            id: id & 0x7FF,
            length: 8,
            bytes,
        }
    }

    /// The frame on a bus of this format. Classic and FD frames of these motors have the same bytes.
    pub fn on_bus(&self, format: FrameFormat) -> CanFrame {
        let frame = CanFrame::of(CanId::standard_masked(self.id), self.bytes);
        // Shorter frames exist only as answers, which a host does not send.
        let frame = match self.length {
            8 => frame,
            _ => CanFrame::new(frame.id(), self.payload()).unwrap_or(frame),
        };
        match format {
            FrameFormat::Classic => frame,
            FrameFormat::Fd { bit_rate_switch } => frame.to_fd(bit_rate_switch),
        }
    }

    /// The frame of a bus, of either format.
    ///
    /// # Errors
    /// [`FrameError`] for an extended id or more than eight bytes.
    pub fn of_bus(frame: &CanFrame) -> Result<Frame, FrameError> {
        match frame.id().as_standard() {
            Some(id) => Frame::new(u32::from(id), frame.payload()),
            None => Err(FrameError::Id(frame.id().raw())),
        }
    }

    /// Arbitration id.
    pub const fn id(&self) -> u16 {
        self.id
    }

    /// Payload, 0 to 8 bytes.
    pub fn payload(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.length)).unwrap_or(&[])
    }

    /// The payload if it has eight bytes.
    pub fn eight(&self) -> Option<&[u8; 8]> {
        (self.length == 8).then_some(&self.bytes)
    }
}

impl fmt::Debug for Frame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:03X}#", self.id)?;
        self.payload()
            .iter()
            .try_for_each(|byte| write!(f, "{byte:02X}"))
    }
}
