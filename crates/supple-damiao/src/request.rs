//! Frames as a motor decodes them: all frames that a host can send, including those that write flash.
//!
//! A motor compares the low eight bits of an id with its own; the bits above select the mode. Register frames have a
//! separate id and contain the motor's id in their payload.

use crate::frame::Frame;
use crate::mit::MitCodes;
use crate::modes::{FORCE_POS, POS_VEL, VEL};
use crate::register::{BROADCAST, Register};
use crate::special::SpecialCommand;

/// Request in a frame to a motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Request {
    /// Command of impedance mode.
    Mit(MitCodes),
    /// Position with a speed limit \[rad\], \[rad/s\].
    PositionVelocity(f32, f32),
    /// Speed \[rad/s\].
    Velocity(f32),
    /// Position \[rad\] with limits of the speed, in 1/100 rad/s, and of the current, in 1/10000 of the maximum.
    ForcePosition(f32, u16, u16),
    /// Enable, disable, clear error.
    SpecialCommand(SpecialCommand),
    /// Stores the present position as the zero position in flash.
    SetZero,
    /// Reads a register.
    Read(Register),
    /// Writes four bytes to a register.
    Write(Register, [u8; 4]),
    /// Stores all registers in flash.
    StoreAll,
    /// Requests feedback.
    Feedback,
}

impl Request {
    /// Decodes the request of `frame` to the motor with `id`; `None` if the frame is for another motor, or malformed.
    pub fn parse(frame: &Frame, id: u8) -> Option<Request> {
        if frame.id() == BROADCAST {
            return registers(frame.payload(), id);
        }
        if frame.id() & 0xFF != u16::from(id) {
            return None;
        }
        if let Some([0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, code @ 0xFB..=0xFE]) = frame.eight()
        {
            return Some(match code {
                0xFB => Request::SpecialCommand(SpecialCommand::ClearError),
                0xFC => Request::SpecialCommand(SpecialCommand::Enable),
                0xFD => Request::SpecialCommand(SpecialCommand::Disable),
                _ => Request::SetZero,
            });
        }
        let float = |at: usize| {
            let bytes = frame.payload().get(at..at + 4)?;
            Some(f32::from_le_bytes(bytes.try_into().ok()?))
        };
        let short = |at: usize| {
            let bytes = frame.payload().get(at..at + 2)?;
            Some(u16::from_le_bytes(bytes.try_into().ok()?))
        };
        match frame.id() & 0x700 {
            0 => frame
                .eight()
                .map(|bytes| Request::Mit(MitCodes::parse(bytes))),
            POS_VEL => Some(Request::PositionVelocity(float(0)?, float(4)?)),
            VEL => Some(Request::Velocity(float(0)?)),
            FORCE_POS => Some(Request::ForcePosition(float(0)?, short(4)?, short(6)?)),
            _ => None,
        }
    }

    /// Whether a motor that executes the request writes its flash memory.
    pub fn writes_flash(&self) -> bool {
        // Firmware for four motors stores the zero position when the register of the motor's position is written.
        matches!(
            self,
            Request::SetZero | Request::StoreAll | Request::Write(Register::MOTOR_POSITION, _)
        )
    }
}

fn registers(payload: &[u8], id: u8) -> Option<Request> {
    let [low, high, operation, rest @ ..] = payload else {
        return None;
    };
    if (*low, *high) != (id, 0) {
        return None;
    }
    match (operation, rest) {
        (0x33, [register, ..]) => Some(Request::Read(Register(*register))),
        (0x55, [register, a, b, c, d]) => {
            Some(Request::Write(Register(*register), [*a, *b, *c, *d]))
        }
        (0xAA, _) => Some(Request::StoreAll),
        (0xCC, _) => Some(Request::Feedback),
        _ => None,
    }
}
