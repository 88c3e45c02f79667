//! Emulated force/torque sensor behind the tip.
//!
//! The sensor answers a request with a frame of forces and a frame of torques, both in the sensor's axes, which are the axes
//! of the tip. Taring takes slightly more than a second, during which the outputs are zero and the status reports taring. Source:
//! btclient, OWD.

use crate::store::property_of;
use supple_can_frame::CanFrame;
use supple_core::nalgebra::Vector3;
use supple_puck::force_torque::{Quantity, SensorReading, SensorStatus};
use supple_puck::status::{Role, Stat};
use supple_puck::{
    Destination, GroupId, MessageId, NodeId, Property, PropertyMessage, PropertyTable, Value,
};

/// Duration of taring \[ns\].
const TARE_NS: u64 = 1_100_000_000;
/// Offset from the centre of the sensor to the tip, in the sensor's axes \[m\].
const SENSOR_TO_TIP_M: Vector3<f64> = Vector3::new(0.0, 0.0, 0.026);
/// Ranges: force in x and y \[N\], force in z \[N\], torque \[N m\].
const RANGES: [f64; 3] = [80.0, 135.0, 2.75];
/// Acceleration reported at rest: gravity is not modelled, as the tool's weight is tared.
const ACCELERATION_AT_REST: Vector3<f64> = Vector3::new(0.0, 0.0, 0.0);

/// The sensor.
#[derive(Clone, Debug)]
pub struct ForceSensor {
    taring_until_ns: u64,
    saturated: u8,
    force_n: Vector3<f64>,
}

impl ForceSensor {
    /// Creates a sensor that is not taring.
    pub fn new() -> ForceSensor {
        ForceSensor {
            taring_until_ns: 0,
            saturated: 0,
            force_n: Vector3::zeros(),
        }
    }

    /// Sets the force on the tip, in the sensor's axes \[N\].
    pub fn set_force(&mut self, force_n: Vector3<f64>) {
        self.force_n = force_n;
    }

    /// Handles a frame of another node; returns the replies.
    pub fn handle_frame(&mut self, now_ns: u64, frame: &CanFrame) -> [Option<CanFrame>; 2] {
        let to = MessageId::of(frame).map(MessageId::to);
        if to != Some(Destination::Node(NodeId::FORCE_TORQUE)) {
            return [None; 2];
        }
        let table = PropertyTable::FORCE_TORQUE;
        match PropertyMessage::parse(frame) {
            Ok(PropertyMessage::Get(id)) => match property_of(&table, id) {
                Some(Property::FT) => self.read(now_ns),
                Some(Property::A) => [
                    reading(Quantity::Acceleration, ACCELERATION_AT_REST, None),
                    None,
                ],
                Some(property) => {
                    let value = match property {
                        Property::STAT => Stat::Ready.value(),
                        Property::ROLE => Role::FORCE.0 as i16,
                        Property::ID => i16::from(NodeId::FORCE_TORQUE.number()),
                        Property::VERS => 24,
                        _ => 0,
                    };
                    let reply = PropertyMessage::Set(id, Value::Narrow(value));
                    let group = Destination::Group(GroupId::REPLY);
                    [Some(reply.emit(NodeId::FORCE_TORQUE, group)), None]
                }
                None => [None; 2],
            },
            Ok(PropertyMessage::Set(id, value))
                if property_of(&table, id) == Some(Property::FT) && value.get() == 0 =>
            {
                self.taring_until_ns = now_ns + TARE_NS;
                self.saturated = 0;
                [None; 2]
            }
            _ => [None; 2],
        }
    }

    fn read(&mut self, now_ns: u64) -> [Option<CanFrame>; 2] {
        if now_ns < self.taring_until_ns {
            let status = Some(SensorStatus::TARING);
            return [
                reading(Quantity::Force, Vector3::zeros(), None),
                reading(Quantity::Torque, Vector3::zeros(), status),
            ];
        }
        let torque_nm = SENSOR_TO_TIP_M.cross(&self.force_n);
        let [side, along, torque] = RANGES;
        let limits = [side, side, along, torque, torque, torque];
        let loads = self.force_n.iter().chain(torque_nm.iter());
        let mut now = 0u8;
        for (axis, (value, limit)) in loads.zip(limits).enumerate() {
            if value.abs() > limit {
                now |= 1 << axis;
            }
        }
        self.saturated |= now;
        let bad = if now == 0 { 0 } else { 0x40 };
        let status = Some(SensorStatus(self.saturated | bad));
        [
            reading(Quantity::Force, self.force_n, None),
            reading(Quantity::Torque, torque_nm, status),
        ]
    }
}

impl Default for ForceSensor {
    fn default() -> Self {
        ForceSensor::new()
    }
}

fn reading(
    quantity: Quantity,
    components: Vector3<f64>,
    status: Option<SensorStatus>,
) -> Option<CanFrame> {
    let counts = quantity.counts(components.into()).ok()?;
    let reading = SensorReading {
        quantity,
        counts,
        status,
    };
    Some(reading.emit(NodeId::FORCE_TORQUE))
}
