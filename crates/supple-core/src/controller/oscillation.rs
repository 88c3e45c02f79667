//! A joint that oscillates with growing speed: its loop is unstable, because torques or angles come later than the
//! configuration says, or because the inertia of the model is wrong.
//!
//! The peaks of the speed are compared from one reversal of the joint to the next. After a blow they fall, and a hand
//! is slower than [`MAX_SWING_S`].

use super::fault::Fault;
use crate::math::{Vector, abs};

/// Speed in the new direction from which a joint has turned round \[rad/s\]; noise of the estimate is smaller.
const TURNED_RAD_PER_S: f64 = 0.04;
/// Longest time from one reversal to the next, half a period \[s\].
const MAX_SWING_S: f64 = 0.08;
/// Times in a row that the peak grows until it is a fault.
const GROWTHS: u32 = 3;
/// Largest ratio of a peak to the one before: a joint that begins to move has a greater one to the swings that the noise of its
/// encoder shows at rest. A loop whose delay is 2.5 times what its gains allow grows faster; the limit of the speed ends that.
const MAX_GROWTH: f64 = 3.0;
/// Peak as a fraction of the speed limit.
const SPEED_SHARE: f64 = 0.15;

/// The last swings of each joint.
#[derive(Clone, Copy, Debug)]
pub(super) struct Oscillation<const N: usize> {
    /// Fastest velocity since the joint turned round, with its sign \[rad/s\].
    fastest_rad_per_s: Vector<N>,
    /// Peak of the swing before \[rad/s\].
    last_peak_rad_per_s: Vector<N>,
    /// When the joint turned round last \[s\].
    turned_s: Vector<N>,
    /// Time since the start, of which `turned_s` are values \[s\].
    now_s: f64,
    /// Times in a row that each joint's peak has grown.
    growths: [u32; N],
}

impl<const N: usize> Default for Oscillation<N> {
    fn default() -> Self {
        Oscillation {
            fastest_rad_per_s: Vector::zeros(),
            last_peak_rad_per_s: Vector::zeros(),
            turned_s: Vector::zeros(),
            now_s: 0.0,
            growths: [0; N],
        }
    }
}

impl<const N: usize> Oscillation<N> {
    /// Adds the velocities of a cycle \[rad/s\]. An error if a joint oscillates; `limit_rad_per_s` are the speed limits.
    #[inline(always)]
    pub fn check(
        &mut self,
        velocity_rad_per_s: &Vector<N>,
        limit_rad_per_s: &Vector<N>,
        elapsed_s: f64,
    ) -> Result<(), Fault> {
        self.now_s += elapsed_s;
        let mut result = Ok(());
        for joint in 0..N {
            let (velocity, fastest) = (velocity_rad_per_s[joint], self.fastest_rad_per_s[joint]);
            if velocity * fastest < -TURNED_RAD_PER_S * abs(fastest) {
                self.end_swing(joint, velocity);
            } else if abs(velocity) > abs(fastest) {
                self.fastest_rad_per_s[joint] = velocity;
                if self.growths[joint] >= GROWTHS - 1 {
                    result = result.and(self.judge_swing(joint, limit_rad_per_s[joint]));
                }
            }
        }
        result
    }

    /// Ends a swing of a joint.
    #[cold]
    #[inline(never)]
    fn end_swing(&mut self, joint: usize, velocity: f64) {
        let peak = abs(self.fastest_rad_per_s[joint]);
        self.growths[joint] = match self.has_grown(joint, peak) {
            true => self.growths[joint] + 1,
            false => 0,
        };
        self.turned_s[joint] = self.now_s;
        self.last_peak_rad_per_s[joint] = peak;
        self.fastest_rad_per_s[joint] = velocity;
    }

    /// Whether this peak is that of a quick swing, and higher than the last one by at most [`MAX_GROWTH`].
    fn has_grown(&self, joint: usize, peak: f64) -> bool {
        let is_quick = self.now_s - self.turned_s[joint] <= MAX_SWING_S;
        let last_peak = self.last_peak_rad_per_s[joint];
        is_quick && peak > last_peak && peak <= MAX_GROWTH * last_peak
    }

    /// Judges a swing that may be the last of those that grow, before it ends.
    #[cold]
    #[inline(never)]
    fn judge_swing(&self, joint: usize, speed_limit: f64) -> Result<(), Fault> {
        let value_rad_per_s = abs(self.fastest_rad_per_s[joint]);
        let limit_rad_per_s = SPEED_SHARE * speed_limit;
        if self.has_grown(joint, value_rad_per_s) && value_rad_per_s > limit_rad_per_s {
            return Err(Fault::Oscillation {
                joint,
                value_rad_per_s,
                limit_rad_per_s,
            });
        }
        Ok(())
    }
}
