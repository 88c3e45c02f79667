//! Frames as a motor reads them: everything that a host can send, the dangerous ones included.
//!
//! A motor compares the low eight bits of an id with its own; the bits above select the mode. Register frames have an
//! id of their own and name the motor in their payload.

use crate::frame::Frame;
use crate::mit::MitCodes;
use crate::modes::{FORCE_POS, POS_VEL, VEL};
use crate::register::{BROADCAST, Register};
use crate::special::Special;

/// What a frame asks of a motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Request {
    /// Command of impedance mode.
    Mit(MitCodes),
    /// Position with a speed limit \[rad\], \[rad/s\].
    PositionVelocity(f32, f32),
    /// Speed \[rad/s\].
    Velocity(f32),
    /// Position \[rad\] with limits of speed, 1/100 rad/s, and current, 1/10000 of the greatest.
    ForcePosition(f32, u16, u16),
    /// Enable, disable, clear error.
    Special(Special),
    /// Makes the present position the zero, in flash.
    SetZero,
    /// Reads a register.
    Read(Register),
    /// Writes four bytes to a register.
    Write(Register, [u8; 4]),
    /// Stores all registers in flash.
    StoreAll,
    /// Asks for feedback.
    Feedback,
}

impl Request {
    /// What `frame` asks of the motor with `id`; `None` if it is for another one, or malformed.
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
                0xFB => Request::Special(Special::ClearError),
                0xFC => Request::Special(Special::Enable),
                0xFD => Request::Special(Special::Disable),
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

    /// Whether a motor that obeys writes its flash memory.
    pub fn writes_flash(&self) -> bool {
        // Firmware for four motors stores the zero on a write to the register of the motor's position.
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
