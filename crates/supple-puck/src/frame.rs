//! Payload lengths of the frames of this protocol, which are classic frames with 11-bit ids.

use core::fmt;
use supple_can_frame::CanFrame;

/// Error: the payload length is not valid for this kind of frame.
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

impl LengthError {
    pub(crate) fn of(frame: &CanFrame, expected: &'static [u8]) -> LengthError {
        LengthError {
            found: frame.payload().len() as u8,
            expected,
        }
    }
}
