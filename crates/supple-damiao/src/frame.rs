//! A frame of Damiao motors: an 11-bit id and up to eight bytes, which are the same on classic CAN and on CAN FD.

use core::fmt;
use supple_can_frame::{CanFrame, CanId, FrameFormat};

/// A frame: id and payload.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Frame {
    id: u16,
    length: u8,
    // Bytes from `length` on are zero, so that the derived equality ignores them.
    bytes: [u8; 8],
}

/// Error: the frame is not a frame of Damiao motors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameError {
    /// The id has more than 11 bits.
    Id(u32),
    /// The payload has this many bytes; the maximum is eight.
    Length(usize),
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FrameError::Id(id) => write!(f, "id {id:#x} has more than 11 bits"),
            FrameError::Length(found) => {
                write!(
                    f,
                    "payload has {found} bytes, frames of Damiao motors have at most 8"
                )
            }
        }
    }
}

impl core::error::Error for FrameError {}

impl Frame {
    /// Creates a frame with a payload of at most eight bytes.
    ///
    /// # Errors
    /// [`FrameError`] for an id above 0x7FF or a longer payload.
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

    /// Creates a frame of eight bytes with the low 11 bits of `id`.
    pub(crate) const fn of(id: u16, bytes: [u8; 8]) -> Frame {
        Frame {
            id: id & 0x7FF,
            length: 8,
            bytes,
        }
    }

    /// Converts to a frame of this format for the bus. Classic and FD frames have the same bytes.
    pub fn on_bus(&self, format: FrameFormat) -> CanFrame {
        let frame = CanFrame::of(CanId::standard_masked(self.id), self.bytes);
        // Shorter frames exist only as replies, which a host does not send.
        let frame = match self.length {
            8 => frame,
            _ => CanFrame::new(frame.id(), self.payload()).unwrap_or(frame),
        };
        match format {
            FrameFormat::Classic => frame,
            FrameFormat::Fd { bit_rate_switch } => frame.to_fd(bit_rate_switch),
        }
    }

    /// Converts a frame of either format from the bus.
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

    /// Returns the payload if it has eight bytes.
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
