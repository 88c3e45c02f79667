//! Frames that write flash memory. Nothing on the running path sends them: an operator's command does, one motor at a
//! time, with the motor disabled.
//!
//! Flash endures about 10 000 writes. A wrong zero turns a joint's limits into angles that the arm cannot have.

use crate::frame::Frame;
use crate::register::BROADCAST;

/// Last byte of the frame that makes the present position the zero.
pub const SET_ZERO_CODE: u8 = 0xFE;

/// Makes the present position the zero of the motor with `id`.
pub const fn set_zero(id: u8) -> Frame {
    let mut bytes = [0xFF; 8];
    bytes[7] = SET_ZERO_CODE;
    Frame::of(id as u16, bytes)
}

/// Stores all registers of the motor with `id`.
pub const fn store_all(id: u8) -> Frame {
    Frame::of(BROADCAST, [id, 0, 0xAA, 0x01, 0, 0, 0, 0])
}
