//! Position replies: 22-bit two's complement counts, most significant byte first, without a property
//! byte, sent to [`GroupId::POSITION`].
//!
//! Three bytes contain the motor's position; six contain the motor's and the joint encoder's. The two top bits
//! of each triple are documented as zero; libbarrett has disabled its check of them, and all public
//! implementations ignore them, as does this one. Source: libbarrett, btclient, OWD, manual.

use crate::frame::LengthError;
use crate::id::{GroupId, MessageId, NodeId};
use core::f64::consts::TAU;
use core::fmt;
use supple_can_frame::CanFrame;

/// An encoder's position, -2 097 152 to 2 097 151 counts: the range of 22 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Counts(i32);

/// Error: a position is outside the range of 22 bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CountsError {
    /// This number of counts is outside the range.
    OutOfRange(i32),
    /// An angle is not finite or outside the range; the value is the angle in counts.
    Angle(f64),
}

impl fmt::Display for CountsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let range = "it must be -2097152 to 2097151";
        match self {
            CountsError::OutOfRange(counts) => write!(f, "position is {counts} counts, {range}"),
            CountsError::Angle(counts) => write!(f, "position is {counts:.1} counts, {range}"),
        }
    }
}

impl core::error::Error for CountsError {}

impl Counts {
    /// Minimum position: -512 revolutions at 4096 counts.
    pub const MIN: Counts = Counts(-(1 << 21));
    /// Maximum position.
    pub const MAX: Counts = Counts((1 << 21) - 1);

    /// Creates a position from its counts.
    ///
    /// # Errors
    /// [`CountsError::OutOfRange`] for counts outside the range of 22 bits.
    pub const fn new(counts: i32) -> Result<Counts, CountsError> {
        if counts >= Counts::MIN.0 && counts <= Counts::MAX.0 {
            Ok(Counts(counts))
        } else {
            Err(CountsError::OutOfRange(counts))
        }
    }

    /// Number of counts.
    pub const fn get(self) -> i32 {
        self.0
    }

    const fn parse(bytes: [u8; 3]) -> Counts {
        let word = u32::from_be_bytes([0, bytes[0], bytes[1], bytes[2]]);
        Counts((word << 10) as i32 >> 10)
    }

    const fn emit(self) -> [u8; 3] {
        let [_, high, middle, low] = self.0.to_be_bytes();
        [high & 0x3f, middle, low]
    }
}

/// Counts per revolution of an encoder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositionScale {
    counts_per_rad: f64,
}

/// Error: the number of counts is not positive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PositionScaleError(pub i32);

impl fmt::Display for PositionScaleError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "encoder has {} counts per revolution, it must have 1 or more",
            self.0
        )
    }
}

impl core::error::Error for PositionScaleError {}

impl PositionScale {
    /// Creates the scale from the value of [`Property::CTS`](crate::Property::CTS): 4096 for the magnetic encoder,
    /// 40960 for the optical one.
    ///
    /// # Errors
    /// [`PositionScaleError`] for a number that is not positive.
    pub fn new(counts_per_revolution: i32) -> Result<PositionScale, PositionScaleError> {
        if counts_per_revolution > 0 {
            Ok(PositionScale {
                counts_per_rad: f64::from(counts_per_revolution) / TAU,
            })
        } else {
            Err(PositionScaleError(counts_per_revolution))
        }
    }

    /// Converts counts to the angle of the encoder \[rad\].
    pub fn rad(&self, counts: Counts) -> f64 {
        f64::from(counts.0) / self.counts_per_rad
    }

    /// Converts an angle of the encoder \[rad\] to the nearest count, halves away from zero.
    ///
    /// # Errors
    /// [`CountsError::Angle`] for an angle that is not finite or outside the range of 22 bits.
    pub fn counts(&self, angle_rad: f64) -> Result<Counts, CountsError> {
        let counts = libm::round(angle_rad * self.counts_per_rad);
        let (lower, upper) = (f64::from(Counts::MIN.0), f64::from(Counts::MAX.0));
        if (lower..=upper).contains(&counts) {
            Ok(Counts(counts as i32))
        } else {
            Err(CountsError::Angle(counts))
        }
    }
}

/// A motor puck's reply to a position request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PositionReply {
    /// Motor encoder.
    pub motor: Counts,
    /// Joint encoder, if the puck has one. Its position is not absolute until the encoder has passed its index.
    pub joint: Option<Counts>,
}

impl PositionReply {
    /// Parses a frame to [`GroupId::POSITION`]. Does not check the destination.
    ///
    /// # Errors
    /// [`LengthError`] if the payload has neither three nor six bytes.
    pub fn parse(frame: &CanFrame) -> Result<PositionReply, LengthError> {
        match *frame.payload() {
            [a, b, c] => Ok(PositionReply {
                motor: Counts::parse([a, b, c]),
                joint: None,
            }),
            [a, b, c, d, e, f] => Ok(PositionReply {
                motor: Counts::parse([a, b, c]),
                joint: Some(Counts::parse([d, e, f])),
            }),
            _ => Err(LengthError::of(frame, &[3, 6])),
        }
    }

    /// Encodes the frame that node `from` sends.
    pub const fn emit(&self, from: NodeId) -> CanFrame {
        let id = MessageId::to_group(from, GroupId::POSITION);
        let [a, b, c] = self.motor.emit();
        match self.joint {
            None => CanFrame::of(id.can_id(), [a, b, c]),
            Some(joint) => {
                let [d, e, f] = joint.emit();
                CanFrame::of(id.can_id(), [a, b, c, d, e, f])
            }
        }
    }
}
