//! Receives the force of the force/torque sensor. The sensor sends the status of a force in the torque frame that follows.

use supple_core::nalgebra::Vector3;
use supple_puck::force_torque::{Quantity, SensorReading};

/// Age after which a force is stale \[ns\].
const STALE_NS: u64 = 100_000_000;

/// Receiver of the sensor's frames: holds the last valid force, and a force whose status has not arrived.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ForceReceiver {
    /// Force whose status has not arrived \[N\].
    pending_n: Option<Vector3<f64>>,
    /// Last valid force \[N\], and the time at which its torque frame was received \[ns\].
    force_n: Option<(Vector3<f64>, u64)>,
}

impl ForceReceiver {
    /// Processes a frame of the sensor. The torque frame after a force makes the force valid, unless its status reports bad
    /// data.
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

    /// Returns the last valid force on the tip, in the sensor's axes \[N\]; `None` if it is stale.
    pub fn force_n(&self, now_ns: u64) -> Option<Vector3<f64>> {
        let (force_n, received_ns) = self.force_n?;
        (now_ns <= received_ns + STALE_NS).then_some(force_n)
    }
}
