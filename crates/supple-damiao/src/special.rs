//! Special frames that a drive uses: enable, disable, clear error. They consist of seven bytes 0xFF and a code.

use crate::frame::Frame;

/// A special frame that does not write flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SpecialCommand {
    /// Clears a latched error; the motor stays disabled.
    ClearError,
    /// Enables the motor.
    Enable,
    /// Disables the motor, which then neither applies torque nor brakes.
    Disable,
}

impl SpecialCommand {
    /// Last byte.
    pub const fn code(self) -> u8 {
        match self {
            SpecialCommand::ClearError => 0xFB,
            SpecialCommand::Enable => 0xFC,
            SpecialCommand::Disable => 0xFD,
        }
    }

    /// Creates the frame to the motor with `id`.
    pub const fn emit(self, id: u8) -> Frame {
        let mut bytes = [0xFF; 8];
        bytes[7] = self.code();
        Frame::of(id as u16, bytes)
    }
}
