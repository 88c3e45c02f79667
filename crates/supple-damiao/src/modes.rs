//! Commands of the motor's other modes: position with a speed limit, speed, position with a current limit. The drive
//! uses none of them; they exist so that every frame on a bus can be decoded.

use crate::code::NotANumber;
use crate::frame::Frame;

/// Offset of the id of [`pos_vel`].
pub const POS_VEL: u16 = 0x100;
/// Offset of the id of [`vel`].
pub const VEL: u16 = 0x200;
/// Offset of the id of [`force_pos`].
pub const FORCE_POS: u16 = 0x300;
/// Maximum value of the two limits of [`force_pos`].
const LIMIT: f64 = 10_000.0;

fn finite(value: f64, quantity: &'static str) -> Result<f32, NotANumber> {
    let value = value as f32;
    match value.is_finite() {
        true => Ok(value),
        false => Err(NotANumber { quantity }),
    }
}

/// Creates the command to move to a position \[rad\] with a speed limit \[rad/s\].
///
/// # Errors
/// [`NotANumber`] for a value that is not finite.
pub fn pos_vel(id: u8, position_rad: f64, speed_rad_per_s: f64) -> Result<Frame, NotANumber> {
    let [a, b, c, d] = finite(position_rad, "position")?.to_le_bytes();
    let [e, f, g, h] = finite(speed_rad_per_s, "speed")?.to_le_bytes();
    Ok(Frame::of(POS_VEL + u16::from(id), [a, b, c, d, e, f, g, h]))
}

/// Creates the command to turn at a speed \[rad/s\]; padded to eight bytes, which all known firmware accepts.
///
/// # Errors
/// [`NotANumber`] for a value that is not finite.
pub fn vel(id: u8, speed_rad_per_s: f64) -> Result<Frame, NotANumber> {
    let [a, b, c, d] = finite(speed_rad_per_s, "speed")?.to_le_bytes();
    Ok(Frame::of(VEL + u16::from(id), [a, b, c, d, 0, 0, 0, 0]))
}

/// Creates the command to move to a position \[rad\] with limits of the speed, 0 to 100 rad/s, and of the current, as a fraction
/// of the maximum, 0 to 1.
///
/// # Errors
/// [`NotANumber`] for a value that is not finite.
pub fn force_pos(
    id: u8,
    position_rad: f64,
    speed_rad_per_s: f64,
    current_share: f64,
) -> Result<Frame, NotANumber> {
    let [a, b, c, d] = finite(position_rad, "position")?.to_le_bytes();
    let limit = |value: f64, scale: f64, quantity| {
        let value = f64::from(finite(value, quantity)?);
        Ok(((value * scale).clamp(0.0, LIMIT) + 0.5) as u16)
    };
    let [e, f] = limit(speed_rad_per_s, 100.0, "speed")?.to_le_bytes();
    let [g, h] = limit(current_share, LIMIT, "current")?.to_le_bytes();
    Ok(Frame::of(
        FORCE_POS + u16::from(id),
        [a, b, c, d, e, f, g, h],
    ))
}
