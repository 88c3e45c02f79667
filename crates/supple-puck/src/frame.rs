//! A classical CAN data frame with an 11-bit id and up to eight bytes.

use crate::id::{IdError, MessageId};
use core::fmt;

/// A frame of the bus: id and payload.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct CanFrame {
    id: MessageId,
    length: u8,
    // Bytes from `length` on are zero, so that the derived equality ignores them.
    bytes: [u8; 8],
}

/// Error: not a valid frame of this bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameError {
    /// An id above 0x7FF.
    Id(IdError),
    /// A payload of this many bytes; the maximum is eight.
    TooLong(usize),
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FrameError::Id(error) => write!(f, "{error}"),
            FrameError::TooLong(length) => {
                write!(f, "payload has {length} bytes, a frame carries at most 8")
            }
        }
    }
}

impl core::error::Error for FrameError {}

impl From<IdError> for FrameError {
    fn from(error: IdError) -> FrameError {
        FrameError::Id(error)
    }
}

/// A payload of a wrong length for this kind of frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LengthError {
    /// Bytes found.
    pub found: u8,
    /// Valid lengths.
    pub expected: &'static [u8],
}

impl fmt::Display for LengthError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "payload has {} bytes, expected ", self.found)?;
        for (index, length) in self.expected.iter().enumerate() {
            let separator = if index == 0 { "" } else { " or " };
            write!(f, "{separator}{length}")?;
        }
        Ok(())
    }
}

impl core::error::Error for LengthError {}

impl CanFrame {
    /// A frame with `payload`, eight bytes at most.
    ///
    /// # Errors
    /// A longer payload.
    pub fn new(id: MessageId, payload: &[u8]) -> Result<CanFrame, FrameError> {
        let mut bytes = [0; 8];
        let target = bytes.get_mut(..payload.len());
        target
            .ok_or(FrameError::TooLong(payload.len()))?
            .copy_from_slice(payload);
        Ok(CanFrame {
            id,
            length: payload.len() as u8,
            bytes,
        })
    }

    /// A frame from the id that a CAN driver reports; the caller has removed the driver's flags.
    ///
    /// # Errors
    /// An id above 0x7FF, or a payload of more than eight bytes.
    pub fn from_raw(id: u32, payload: &[u8]) -> Result<CanFrame, FrameError> {
        CanFrame::new(MessageId::from_raw(id)?, payload)
    }

    /// A frame whose payload length is checked at compile time.
    pub(crate) const fn of<const N: usize>(id: MessageId, payload: [u8; N]) -> CanFrame {
        const { assert!(N <= 8) };
        let mut bytes = [0; 8];
        let mut i = 0;
        while i < N {
            bytes[i] = payload[i];
            i += 1;
        }
        CanFrame {
            id,
            length: N as u8,
            bytes,
        }
    }

    /// Message id.
    pub const fn id(&self) -> MessageId {
        self.id
    }

    /// Number of bytes, 0 to 8.
    pub const fn dlc(&self) -> u8 {
        self.length
    }

    /// Payload, `dlc` bytes.
    pub fn payload(&self) -> &[u8] {
        self.bytes.get(..self.length as usize).unwrap_or(&[])
    }

    pub(crate) const fn wrong_length(&self, expected: &'static [u8]) -> LengthError {
        LengthError {
            found: self.length,
            expected,
        }
    }
}

impl fmt::Debug for CanFrame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:03x} {:02x?}", self.id.raw(), self.payload())
    }
}
