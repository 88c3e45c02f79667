//! External joint torque without a sensor: the generalised-momentum observer.
//!
//! `r = omega (p - p_0 - integral(tau + C^T qd - G - D + r))` follows the external torque as a
//! first-order lag of bandwidth `omega` (De Luca and Mattone, 2003). It needs no acceleration and no
//! inverse of the mass matrix. It sees what the model leaves out as well: at rest, dry friction of up
//! to `S` hides in it.

use crate::math::{Vector, abs};

/// Torques below this are none \[N m\]. The residual of an arm at rest would otherwise decay to a subnormal number, with
/// which many a processor takes a hundred times as long.
const LEAST_TORQUE_NM: f64 = 1e-12;

/// State of the observer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MomentumObserver<const N: usize> {
    integral: Vector<N>,
    residual: Vector<N>,
    started: bool,
}

impl<const N: usize> Default for MomentumObserver<N> {
    fn default() -> Self {
        MomentumObserver {
            integral: Vector::zeros(),
            residual: Vector::zeros(),
            started: false,
        }
    }
}

impl<const N: usize> MomentumObserver<N> {
    /// Estimated external torque \[N m\].
    pub fn external_torque_nm(&self) -> Vector<N> {
        self.residual
    }

    /// Forgets everything; the next update starts from no external torque.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// One cycle: `momentum` is `H qd` now, `drive` is `tau + C^T qd - G - D` over the cycle \[N m\].
    pub fn update(
        &mut self,
        momentum: &Vector<N>,
        drive: &Vector<N>,
        elapsed_s: f64,
        bandwidth_rad_per_s: f64,
    ) {
        if !self.started {
            self.started = true;
            self.integral = *momentum;
            return;
        }
        self.integral += drive * elapsed_s;
        // Implicit in the residual, so that any bandwidth is stable.
        let gain = bandwidth_rad_per_s / (1.0 + bandwidth_rad_per_s * elapsed_s);
        self.residual = (momentum - self.integral) * gain;
        self.integral += self.residual * elapsed_s;
        for joint in 0..N {
            if abs(self.residual[joint]) < LEAST_TORQUE_NM {
                (self.residual[joint], self.integral[joint]) = (0.0, momentum[joint]);
            }
        }
    }
}
