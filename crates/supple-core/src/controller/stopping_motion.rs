//! Motion of a stopping arm: detects whether the arm gains kinetic energy.

use super::checks::MOVING_SHARE;
use crate::config::{Config, Limits};
use crate::dynamics::Terms;
use crate::math::{Vector, Vector3, abs};

/// Maximum number of cycles over which the speed of a stopping arm is averaged.
const MAX_WINDOW: usize = 16;
/// Ratio to the kinetic energy at the fault and before above which the arm counts as accelerating.
const ENERGY_GROWTH_LIMIT: f64 = 1.2;

/// Motion of a stopping arm, from its angles alone. After an impact the velocity estimate needs several times the lag of its
/// filter to reach the arm's speed; the mean over half of the lag, `1 / w`, is exact after that time.
#[derive(Clone, Copy, Debug)]
pub(super) struct StoppingMotion<const N: usize> {
    /// Ring buffer of the last angles \[rad\] and their times since the fault \[s\]; the latest is at `count - 1` modulo the
    /// length.
    angles: [(Vector<N>, f64); MAX_WINDOW],
    count: usize,
    /// Maximum kinetic energy before the fault and over the first window \[J\].
    allowed_j: f64,
    /// Whether the arm followed a reference, so that nobody was expected to move it.
    pub follows_reference: bool,
    /// Time for which an external torque that would move a joint at rest has acted in the fault \[s\].
    pub residual_torque_s: f64,
}

impl<const N: usize> StoppingMotion<N> {
    /// Creates the motion of an arm with the kinetic energy `before_j` \[J\] before its fault.
    pub fn new(before_j: f64, follows_reference: bool) -> StoppingMotion<N> {
        StoppingMotion {
            angles: [(Vector::zeros(), 0.0); MAX_WINDOW],
            count: 0,
            allowed_j: before_j,
            follows_reference,
            residual_torque_s: 0.0,
        }
    }

    /// Adds the angles of a cycle, which change in steps of `resolution_rad`. Returns whether the arm moves and has gained energy
    /// since the first window by more than the resolution can explain.
    pub fn gains_energy(
        &mut self,
        config: &Config<N>,
        position_rad: &Vector<N>,
        resolution_rad: &Vector<N>,
        terms: &Terms<N>,
        since_fault_s: f64,
    ) -> bool {
        let cycles = 1.0 / (config.estimator_rad_per_s * config.period_s);
        let window = cycles.min((MAX_WINDOW - 2) as f64) as usize + 1;
        self.angles[self.count % MAX_WINDOW] = (*position_rad, since_fault_s);
        // On overflow, continue at a count with the same index in the ring buffer.
        self.count = match self.count {
            usize::MAX => usize::MAX - MAX_WINDOW + 1,
            count => count + 1,
        };
        if self.count <= window {
            return false;
        }
        let (from_rad, from_s) = self.angles[(self.count - 1 - window) % MAX_WINDOW];
        let elapsed_s = since_fault_s - from_s;
        if elapsed_s <= 0.0 {
            return false;
        }
        let turned_rad = position_rad - from_rad;
        let energy_j = |velocity: &Vector<N>| 0.5 * velocity.dot(&(terms.mass_matrix * velocity));
        if self.count == window + 1 {
            self.allowed_j = self.allowed_j.max(energy_j(&(turned_rad / elapsed_s)));
        }
        let certain_rad = turned_rad.zip_map(resolution_rad, |turned, resolution| {
            turned - turned.clamp(-resolution, resolution)
        });
        let velocity = certain_rad / elapsed_s;
        let tip_velocity = terms.jacobian.fixed_rows::<3>(0) * velocity;
        is_moving(&config.limits, &velocity, &tip_velocity)
            && energy_j(&velocity) > ENERGY_GROWTH_LIMIT * self.allowed_j
    }
}

/// Returns whether a joint or the tip is faster than a fifth of its speed limit.
pub(super) fn is_moving<const N: usize>(
    limits: &Limits<N>,
    velocity_rad_per_s: &Vector<N>,
    tip_velocity: &Vector3<f64>,
) -> bool {
    let tip_limit = MOVING_SHARE * limits.tip_speed_m_per_s;
    let mut moving = tip_velocity.dot(tip_velocity) > tip_limit * tip_limit;
    for joint in 0..N {
        let limit = MOVING_SHARE * limits.joint_speed_rad_per_s[joint];
        moving |= abs(velocity_rad_per_s[joint]) > limit;
    }
    moving
}
