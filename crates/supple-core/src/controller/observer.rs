//! External joint torque without a sensor: the generalised-momentum observer.
//!
//! `r = omega (p - p_0 - integral(tau + C^T qd - G - D + r))` follows the external torque as a
//! first-order lag of bandwidth `omega` (De Luca and Mattone, 2003). It needs no acceleration and
//! no inverse of the mass matrix. The estimate includes model errors: at rest, dry friction of up
//! to `S`.

use crate::math::{Vector, abs};

/// Smaller torques are set to zero \[N m\]. Otherwise the residual of an arm at rest would decay to
/// a subnormal number, which many processors handle a hundred times slower.
const MIN_TORQUE_NM: f64 = 1e-12;

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
    /// Returns the estimated external torque \[N m\].
    pub fn external_torque_nm(&self) -> Vector<N> {
        self.residual
    }

    /// Resets the observer; the next update starts from zero external torque.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// Updates the estimate by one cycle: `momentum` is the current `H qd`, `net_torque` is `tau +
    /// C^T qd - G - D` over the cycle \[N m\].
    pub fn update(
        &mut self,
        momentum: &Vector<N>,
        net_torque: &Vector<N>,
        elapsed_s: f64,
        bandwidth_rad_per_s: f64,
    ) {
        if !self.started {
            self.started = true;
            self.integral = *momentum;
            return;
        }
        self.integral += net_torque * elapsed_s;
        // The update is implicit in the residual, so that any bandwidth is stable.
        let gain = bandwidth_rad_per_s / (1.0 + bandwidth_rad_per_s * elapsed_s);
        self.residual = (momentum - self.integral) * gain;
        self.integral += self.residual * elapsed_s;
        for joint in 0..N {
            if abs(self.residual[joint]) < MIN_TORQUE_NM {
                (self.residual[joint], self.integral[joint]) = (0.0, momentum[joint]);
            }
        }
    }
}
