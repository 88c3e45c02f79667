//! Packed torques: four 14-bit two's complement values after the property byte, most significant bit first. Each puck
//! reads the slot given by its [`Property::PIDX`](crate::Property::PIDX).
//!
//! Torques are rounded to the nearest unit, halves away from zero, so that the rounding has no bias. (libbarrett rounds
//! down, which is a bias of half a unit.) Torques saturate at +-8191 units, as in libbarrett.
//! Source: libbarrett, manual.

use crate::frame::LengthError;
use crate::id::{GroupId, MessageId, NodeId};
use crate::property::{PropertyId, SET_BIT};
use core::fmt;
use supple_can_frame::CanFrame;

/// A torque in a puck's units, -8192 to 8191; a host commands at most +-8191. 1024 units are 1 A.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct PuckTorque(i16);

impl PuckTorque {
    /// Zero torque.
    pub const ZERO: PuckTorque = PuckTorque(0);
    /// Maximum torque that a host commands.
    pub const MAX: PuckTorque = PuckTorque(8191);
    /// Minimum torque that a host commands.
    pub const MIN: PuckTorque = PuckTorque(-8191);

    /// Returns the nearest torque within +-8191 units.
    pub const fn saturating(units: i32) -> PuckTorque {
        if units > PuckTorque::MAX.0 as i32 {
            PuckTorque::MAX
        } else if units < PuckTorque::MIN.0 as i32 {
            PuckTorque::MIN
        } else {
            PuckTorque(units as i16)
        }
    }

    /// Number of units.
    pub const fn units(self) -> i16 {
        self.0
    }

    const fn from_low_14_bits(bits: u64) -> PuckTorque {
        PuckTorque(((bits as u16) << 2) as i16 >> 2)
    }

    const fn low_14_bits(self) -> u64 {
        (self.0 as u16 & 0x3fff) as u64
    }
}

/// Torque units per N m of a puck's motor; converts newton metres to puck units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorqueScale {
    units_per_nm: f64,
}

/// Errors of the conversion to puck units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TorqueError {
    /// The scale is not finite and positive \[1/(N m)\].
    Scale(f64),
    /// The torque is not finite \[N m\].
    Torque(f64),
}

impl fmt::Display for TorqueError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            TorqueError::Scale(scale) => write!(
                f,
                "torque scale is {scale} units per N m, it must be finite and positive"
            ),
            TorqueError::Torque(torque) => {
                write!(f, "motor torque is {torque} N m, it must be finite")
            }
        }
    }
}

impl core::error::Error for TorqueError {}

impl TorqueScale {
    /// Creates the scale from the value of [`Property::IPNM`](crate::Property::IPNM), or from an identified value. Barrett's
    /// values are 2700 for motors 1 to 4, 6500 for 5 and 6, 17474 for 7.
    ///
    /// # Errors
    /// [`TorqueError::Scale`] for a scale that is not finite and positive.
    pub const fn new(units_per_nm: f64) -> Result<TorqueScale, TorqueError> {
        if units_per_nm.is_finite() && units_per_nm > 0.0 {
            Ok(TorqueScale { units_per_nm })
        } else {
            Err(TorqueError::Scale(units_per_nm))
        }
    }

    /// Units per N m.
    pub const fn units_per_nm(&self) -> f64 {
        self.units_per_nm
    }

    /// Converts `torque_nm` to the nearest torque in puck units, halves away from zero, within +-8191 units.
    ///
    /// # Errors
    /// [`TorqueError::Torque`] for a torque that is not finite, which would otherwise saturate at a limit.
    pub fn puck_torque(&self, torque_nm: f64) -> Result<PuckTorque, TorqueError> {
        if torque_nm.is_finite() {
            // A float outside the integer range saturates in the cast, and the integer saturates here.
            let units = libm::round(torque_nm * self.units_per_nm) as i32;
            Ok(PuckTorque::saturating(units))
        } else {
            Err(TorqueError::Torque(torque_nm))
        }
    }

    /// Torque of the motor \[N m\].
    pub fn torque_nm(&self, torque: PuckTorque) -> f64 {
        f64::from(torque.0) / self.units_per_nm
    }
}

/// One torque frame: the commands of up to four pucks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PackedTorques {
    /// Id of [`Property::T`](crate::Property::T) in the pucks' firmware: 42 from version 61.
    pub property: PropertyId,
    /// Torques by slot; zero for slots without a puck.
    pub slots: [PuckTorque; 4],
}

/// Errors of parsing a packed torque frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PackedTorquesError {
    /// The payload does not have eight bytes.
    Length(LengthError),
    /// The first byte lacks the set bit.
    NotASet(u8),
}

impl fmt::Display for PackedTorquesError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            PackedTorquesError::Length(error) => write!(f, "torque frame: {error}"),
            PackedTorquesError::NotASet(byte) => write!(
                f,
                "torque frame begins with {byte:#04x}, expected a property id with bit 0x80 set"
            ),
        }
    }
}

impl core::error::Error for PackedTorquesError {}

impl PackedTorques {
    /// Torque in slot `pidx`, 1 to 4 as in the property; `None` for other slots.
    pub fn slot(&self, pidx: u8) -> Option<PuckTorque> {
        let index = usize::from(pidx).checked_sub(1)?;
        self.slots.get(index).copied()
    }

    /// Parses a frame to [`GroupId::LOWER_TORQUES`] or [`GroupId::UPPER_TORQUES`]. Does not check the destination.
    ///
    /// # Errors
    /// [`PackedTorquesError`] for a payload that does not have eight bytes, or begins with a request byte.
    pub fn parse(frame: &CanFrame) -> Result<PackedTorques, PackedTorquesError> {
        let Ok([head, rest @ ..]) = <[u8; 8]>::try_from(frame.payload()) else {
            return Err(PackedTorquesError::Length(LengthError::of(frame, &[8])));
        };
        if head & SET_BIT == 0 {
            return Err(PackedTorquesError::NotASet(head));
        }
        let [a, b, c, d, e, f, g] = rest;
        let bits = u64::from_be_bytes([0, a, b, c, d, e, f, g]);
        Ok(PackedTorques {
            property: PropertyId::from_byte(head),
            slots: [42, 28, 14, 0].map(|shift| PuckTorque::from_low_14_bits(bits >> shift)),
        })
    }

    /// Encodes the frame that the host sends to `group`.
    pub fn emit(&self, group: GroupId) -> CanFrame {
        let bits = self
            .slots
            .iter()
            .fold(0, |bits, torque| bits << 14 | torque.low_14_bits());
        let [_, a, b, c, d, e, f, g] = bits.to_be_bytes();
        CanFrame::of(
            MessageId::to_group(NodeId::HOST, group).can_id(),
            [self.property.number() | SET_BIT, a, b, c, d, e, f, g],
        )
    }
}
