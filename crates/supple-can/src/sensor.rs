//! Readings of the force/torque sensor, combined from their two frames.

use supple_core::nalgebra::Vector3;
use supple_puck::force_torque::{Quantity, SensorReading};

/// Age after which a reading is discarded \[ns\].
const STALE_NS: u64 = 100_000_000;

/// The last reading.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Readings {
    pending_n: Option<Vector3<f64>>,
    force_n: Option<(Vector3<f64>, u64)>,
}

impl Readings {
    /// Processes a frame. A force becomes valid when the status of the torque frame after it reports good data.
    pub fn update(&mut self, reading: &SensorReading, now_ns: u64) {
        match reading.quantity {
            Quantity::Force => self.pending_n = Some(Vector3::from(reading.components())),
            Quantity::Torque => {
                let bad = reading.status.is_some_and(|status| status.is_bad());
                let force_n = self.pending_n.take().filter(|_| !bad);
                self.force_n = force_n.map(|force_n| (force_n, now_ns));
            }
            Quantity::Acceleration => {}
        }
    }

    /// Force on the tip, in the sensor's axes \[N\], unless it is stale.
    pub fn force_n(&self, now_ns: u64) -> Option<Vector3<f64>> {
        let (force_n, taken_ns) = self.force_n?;
        (now_ns <= taken_ns + STALE_NS).then_some(force_n)
    }
}
