//! Force of the force/torque sensor, whose validity is known only from the torque frame that follows.

use supple_core::nalgebra::Vector3;
use supple_puck::force_torque::{Quantity, SensorReading};

/// Age after which a reading is discarded \[ns\].
const STALE_NS: u64 = 100_000_000;

/// The last valid force, with the force frame that still lacks its status.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Readings {
    /// Force whose torque frame has not yet arrived \[N\].
    pending_n: Option<Vector3<f64>>,
    /// Last valid force \[N\], and when its torque frame was received \[ns\].
    force_n: Option<(Vector3<f64>, u64)>,
}

impl Readings {
    /// Processes a frame. A force becomes valid with the torque frame after it, unless the status in that frame reports
    /// bad data.
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
        let (force_n, received_ns) = self.force_n?;
        (now_ns <= received_ns + STALE_NS).then_some(force_n)
    }
}
