//! The force/torque sensor: forces, torques and accelerations, each three 16-bit little-endian values.
//!
//! The sensor answers a request for [`Property::FT`] with two frames, forces first. Setting it to 0 tares the
//! sensor, which takes a little over a second, during which its outputs are zero and its status is
//! [`SensorStatus::TARING`]. Source: libbarrett, OWD, btclient. libbarrett relies on neither role nor version of
//! this puck, which has a single property list.

use crate::frame::LengthError;
use crate::id::{GroupId, MessageId, NodeId};
use crate::property::{self, Property, PropertyId, PropertyTable, Value};
use core::fmt;
use supple_can_frame::CanFrame;

/// Quantity of a sensor frame, with the value of one count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Force, 1/256 N.
    Force,
    /// Torque, 1/4096 N m.
    Torque,
    /// Acceleration, 1/1024 m/s^2.
    Acceleration,
}

impl Quantity {
    /// Counts per N, N m or m/s^2.
    pub const fn counts_per_unit(self) -> f64 {
        match self {
            Quantity::Force => 256.0,
            Quantity::Torque => 4096.0,
            Quantity::Acceleration => 1024.0,
        }
    }

    /// Group to which the sensor sends frames of this quantity.
    pub const fn group(self) -> GroupId {
        match self {
            Quantity::Force => GroupId::FORCE,
            Quantity::Torque => GroupId::TORQUE,
            Quantity::Acceleration => GroupId::ACCELERATION,
        }
    }

    /// Converts three components \[N, N m or m/s^2\] to counts. Each count is rounded to the nearest integer, halves away from
    /// zero, and saturated at the range of 16 bits: 128 N, 8 N m or 32 m/s^2.
    ///
    /// # Errors
    /// [`NotFinite`] for a component that is not finite.
    pub fn counts(self, components: [f64; 3]) -> Result<[i16; 3], NotFinite> {
        if let Some(axis) = components.iter().position(|value| !value.is_finite()) {
            let value = components[axis];
            return Err(NotFinite { axis, value });
        }
        // The cast saturates.
        Ok(components.map(|value| libm::round(value * self.counts_per_unit()) as i16))
    }
}

/// Error: a component is not finite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NotFinite {
    /// Axis, 0 to 2.
    pub axis: usize,
    /// Value found.
    pub value: f64,
}

impl fmt::Display for NotFinite {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let axis = self.axis;
        write!(f, "component {axis} is {}, it must be finite", self.value)
    }
}

impl core::error::Error for NotFinite {}

/// Status byte of the sensor: which axes have saturated, and whether the data are bad. It is the seventh byte of a frame,
/// documented for torque frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SensorStatus(pub u8);

impl SensorStatus {
    /// Status that the sensor sends while it is taring.
    pub const TARING: SensorStatus = SensorStatus(0x7f);

    /// Whether the data of this frame are bad: an axis is saturated, or the sensor is taring.
    pub const fn is_bad(self) -> bool {
        self.0 & 0x40 != 0
    }

    /// Whether axis 0 to 5 has saturated since the last tare; `None` for other axes.
    pub const fn saturated_since_tare(self, axis: u8) -> Option<bool> {
        if axis < 6 {
            Some(self.0 & (1 << axis) != 0)
        } else {
            None
        }
    }
}

/// One frame of the sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SensorReading {
    /// Measured quantity.
    pub quantity: Quantity,
    /// x, y and z in counts, see [`Quantity::counts_per_unit`].
    pub counts: [i16; 3],
    /// Status, if the frame contains it.
    pub status: Option<SensorStatus>,
}

impl SensorReading {
    /// x, y and z \[N, N m or m/s^2\].
    pub fn components(&self) -> [f64; 3] {
        let scale = self.quantity.counts_per_unit();
        self.counts.map(|counts| f64::from(counts) / scale)
    }

    /// Parses a frame of `quantity`, which the caller knows from the frame's group. Does not check sender and group.
    ///
    /// # Errors
    /// [`LengthError`] if the payload has neither six nor seven bytes.
    pub fn parse(quantity: Quantity, frame: &CanFrame) -> Result<SensorReading, LengthError> {
        let (bytes, status) = match *frame.payload() {
            [a, b, c, d, e, f] => ([a, b, c, d, e, f], None),
            [a, b, c, d, e, f, status] => ([a, b, c, d, e, f], Some(SensorStatus(status))),
            _ => return Err(LengthError::of(frame, &[6, 7])),
        };
        let [a, b, c, d, e, f] = bytes;
        let counts = [[a, b], [c, d], [e, f]].map(i16::from_le_bytes);
        Ok(SensorReading {
            quantity,
            counts,
            status,
        })
    }

    /// Encodes the frame that node `from` sends.
    pub fn emit(&self, from: NodeId) -> CanFrame {
        let id = MessageId::to_group(from, self.quantity.group());
        let [[a, b], [c, d], [e, f]] = self.counts.map(i16::to_le_bytes);
        match self.status {
            None => CanFrame::of(id.can_id(), [a, b, c, d, e, f]),
            Some(status) => CanFrame::of(id.can_id(), [a, b, c, d, e, f, status.0]),
        }
    }
}

const fn property_id(property: Property) -> PropertyId {
    match PropertyTable::FORCE_TORQUE.id(property) {
        Some(id) => id,
        None => panic!("the sensor's list lacks the property"),
    }
}

const FORCE_AND_TORQUE: PropertyId = const { property_id(Property::FT) };
const ACCELERATION: PropertyId = const { property_id(Property::A) };

/// Encodes the host's request for a force frame and a torque frame.
pub fn request() -> CanFrame {
    property::get(NodeId::FORCE_TORQUE, FORCE_AND_TORQUE)
}

/// Encodes the host's request for an acceleration frame.
pub fn request_acceleration() -> CanFrame {
    property::get(NodeId::FORCE_TORQUE, ACCELERATION)
}

/// Encodes the frame that tares the sensor; send it before the readings are used.
pub fn tare() -> CanFrame {
    property::set(NodeId::FORCE_TORQUE, FORCE_AND_TORQUE, Value::Wide(0))
}
