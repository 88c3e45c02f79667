//! The command of impedance mode ("MIT"): position, velocity, two gains and a torque in eight bytes.
//!
//! The motor applies `kp (p - q) + kd (v - qd) + torque` at its output shaft. Layout, big-endian without gaps: position
//! 16 bits, velocity, kp, kd and torque 12 bits each.
//!
//! A command with the maximum position, velocity, kp and kd and a torque near the top of its range has the bytes of
//! "clear error", "enable", "disable" or "set zero". Therefore the code of kp stops at [`MAX_KP_CODE`]: byte 4 of a
//! command is then never 0xFF, and byte 4 of every special frame is.

use crate::code::{LinearCode, NotANumber};
use crate::frame::Frame;
use crate::ranges::Ranges;

/// Code of kp, 0 to 500 N m/rad on every motor.
pub const KP: LinearCode = LinearCode::new(0.0, 500.0, 12);
/// Code of kd, 0 to 5 N m s/rad on every motor.
pub const KD: LinearCode = LinearCode::new(0.0, 5.0, 12);
/// Maximum code of kp that this crate sends: 499.88 N m/rad.
pub const MAX_KP_CODE: u16 = 0xFFE;

/// A command in SI units, at the motor's output shaft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MitCommand {
    /// Position \[rad\].
    pub position_rad: f64,
    /// Velocity \[rad/s\].
    pub velocity_rad_per_s: f64,
    /// Stiffness that the motor applies \[N m/rad\], 0 to 500.
    pub kp_nm_per_rad: f64,
    /// Damping that the motor applies \[N m s/rad\], 0 to 5.
    pub kd_nm_s_per_rad: f64,
    /// Torque \[N m\].
    pub torque_nm: f64,
}

/// A command, as codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MitCodes {
    /// Position, 16 bits.
    pub position: u16,
    /// Velocity, 12 bits.
    pub velocity: u16,
    /// Stiffness, 12 bits.
    pub kp: u16,
    /// Damping, 12 bits.
    pub kd: u16,
    /// Torque, 12 bits.
    pub torque: u16,
}

impl MitCommand {
    /// Command without gains and torque.
    pub const ZERO: MitCommand = MitCommand {
        position_rad: 0.0,
        velocity_rad_per_s: 0.0,
        kp_nm_per_rad: 0.0,
        kd_nm_s_per_rad: 0.0,
        torque_nm: 0.0,
    };

    /// Returns the nearest codes; a value outside its range gets the code of the nearer end.
    ///
    /// # Errors
    /// [`NotANumber`] if a value is not finite.
    pub fn codes(&self, ranges: &Ranges) -> Result<MitCodes, NotANumber> {
        Ok(MitCodes {
            position: ranges.position().encode(self.position_rad, "position")?,
            velocity: ranges
                .velocity()
                .encode(self.velocity_rad_per_s, "velocity")?,
            kp: KP.encode(self.kp_nm_per_rad, "kp")?.min(MAX_KP_CODE),
            kd: KD.encode(self.kd_nm_s_per_rad, "kd")?,
            torque: ranges.torque().encode(self.torque_nm, "torque")?,
        })
    }

    /// Encodes the frame to the motor with `id`, 1 to 15.
    ///
    /// # Errors
    /// [`NotANumber`] if a value is not finite.
    pub fn encode(&self, id: u8, ranges: &Ranges) -> Result<Frame, NotANumber> {
        Ok(self.codes(ranges)?.emit(id))
    }
}

impl MitCodes {
    /// Encodes the frame to the motor with `id`. Drops bits above 12 and limits kp to [`MAX_KP_CODE`], so that no combination
    /// of codes gives a special frame.
    pub fn emit(&self, id: u8) -> Frame {
        let [p1, p0] = self.position.to_be_bytes();
        let [v, kd, t] = [self.velocity, self.kd, self.torque].map(|code| code & 0xFFF);
        let kp = (self.kp & 0xFFF).min(MAX_KP_CODE);
        Frame::of(
            u16::from(id),
            [
                p1,
                p0,
                (v >> 4) as u8,
                ((v & 0xF) << 4 | kp >> 8) as u8,
                (kp & 0xFF) as u8,
                (kd >> 4) as u8,
                ((kd & 0xF) << 4 | t >> 8) as u8,
                (t & 0xFF) as u8,
            ],
        )
    }

    /// Parses the codes of a payload, which may be one that this crate does not send.
    pub fn parse(bytes: &[u8; 8]) -> MitCodes {
        let b = bytes.map(u16::from);
        MitCodes {
            position: b[0] << 8 | b[1],
            velocity: b[2] << 4 | b[3] >> 4,
            kp: (b[3] & 0xF) << 8 | b[4],
            kd: b[5] << 4 | b[6] >> 4,
            torque: (b[6] & 0xF) << 8 | b[7],
        }
    }

    /// Converts the codes to values.
    pub fn command(&self, ranges: &Ranges) -> MitCommand {
        MitCommand {
            position_rad: ranges.position().decode(self.position),
            velocity_rad_per_s: ranges.velocity().decode(self.velocity),
            kp_nm_per_rad: KP.decode(self.kp),
            kd_nm_s_per_rad: KD.decode(self.kd),
            torque_nm: ranges.torque().decode(self.torque),
        }
    }
}
