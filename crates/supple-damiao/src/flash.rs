//! Frames that write flash memory. The drive never sends them; only a command of the operator does, for one motor at a
//! time, while the motor is disabled.
//!
//! Flash endures about 10 000 writes. A wrong zero position shifts the limits of a joint to angles that the arm cannot reach.

use crate::frame::Frame;
use crate::register::BROADCAST;

/// Last byte of the frame that stores the present position as the zero position.
pub const SET_ZERO_CODE: u8 = 0xFE;

/// Creates the frame that makes the present position the zero position of the motor with `id`.
pub const fn set_zero(id: u8) -> Frame {
    let mut bytes = [0xFF; 8];
    bytes[7] = SET_ZERO_CODE;
    Frame::of(id as u16, bytes)
}

/// Creates the frame that stores all registers of the motor with `id` in flash.
pub const fn store_all(id: u8) -> Frame {
    Frame::of(BROADCAST, [id, 0, 0xAA, 0x01, 0, 0, 0, 0])
}
