//! Special frames of the running path: enable, disable, clear error. Seven bytes of 0xFF and a code.

use crate::frame::Frame;

/// A special frame that writes nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Special {
    /// Clears a latched error; the motor stays disabled.
    ClearError,
    /// Enables the motor.
    Enable,
    /// Disables the motor: no torque, no brake.
    Disable,
}

impl Special {
    /// Last byte.
    pub const fn code(self) -> u8 {
        match self {
            Special::ClearError => 0xFB,
            Special::Enable => 0xFC,
            Special::Disable => 0xFD,
        }
    }

    /// The frame to the motor with `id`.
    pub const fn emit(self, id: u8) -> Frame {
        let mut bytes = [0xFF; 8];
        bytes[7] = self.code();
        Frame::of(id as u16, bytes)
    }
}
