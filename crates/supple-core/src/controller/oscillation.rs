//! Detection of a joint that oscillates with growing speed. Its loop is unstable, because torques or angles are delayed more
//! than configured, or because the inertia of the model is wrong.
//!
//! The check compares the speed peaks between successive reversals of the joint. After a blow the peaks decrease, and a hand
//! reverses a joint more slowly than [`MAX_SWING_S`].

use super::fault::Fault;
use crate::math::{Vector, abs};

/// Speed in the new direction above which a joint counts as reversed \[rad/s\]; noise of the estimate is smaller.
const REVERSED_RAD_PER_S: f64 = 0.04;
/// Longest time from one reversal to the next, half a period \[s\].
const MAX_SWING_S: f64 = 0.08;
/// Number of successive growths of the peak that cause a fault.
const GROWTHS: u32 = 3;
/// Maximum ratio of a peak to the previous peak that counts as growth. A joint that begins to move exceeds this ratio to the
/// noise swings at rest. A loop whose delay is 2.5 times the allowed delay grows faster, and ends at the speed limit instead.
const MAX_GROWTH: f64 = 3.0;
/// Minimum peak that causes a fault, as a fraction of the speed limit.
const SPEED_SHARE: f64 = 0.15;

/// The last swings of each joint.
#[derive(Clone, Copy, Debug)]
pub(super) struct Oscillation<const N: usize> {
    /// Fastest velocity since the last reversal, with its sign \[rad/s\].
    fastest_rad_per_s: Vector<N>,
    /// Peak of the previous swing \[rad/s\].
    last_peak_rad_per_s: Vector<N>,
    /// Time of the last reversal of each joint \[s\].
    reversal_s: Vector<N>,
    /// Time since the start, the clock of `reversal_s` \[s\].
    now_s: f64,
    /// Number of successive growths of each joint's peak.
    growths: [u32; N],
}

impl<const N: usize> Default for Oscillation<N> {
    fn default() -> Self {
        Oscillation {
            fastest_rad_per_s: Vector::zeros(),
            last_peak_rad_per_s: Vector::zeros(),
            reversal_s: Vector::zeros(),
            now_s: 0.0,
            growths: [0; N],
        }
    }
}

impl<const N: usize> Oscillation<N> {
    /// Adds the velocities of a cycle \[rad/s\]. Returns a fault if a joint oscillates; `limit_rad_per_s` are the speed limits.
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
            if velocity * fastest < -REVERSED_RAD_PER_S * abs(fastest) {
                self.end_swing(joint, velocity);
            } else if abs(velocity) > abs(fastest) {
                self.fastest_rad_per_s[joint] = velocity;
                if self.growths[joint] >= GROWTHS - 1 {
                    result = result.and(self.check_swing(joint, limit_rad_per_s[joint]));
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
        self.reversal_s[joint] = self.now_s;
        self.last_peak_rad_per_s[joint] = peak;
        self.fastest_rad_per_s[joint] = velocity;
    }

    /// Returns whether the swing was quick and its peak exceeds the last one by a factor of at most [`MAX_GROWTH`].
    fn has_grown(&self, joint: usize, peak: f64) -> bool {
        let is_quick = self.now_s - self.reversal_s[joint] <= MAX_SWING_S;
        let last_peak = self.last_peak_rad_per_s[joint];
        is_quick && peak > last_peak && peak <= MAX_GROWTH * last_peak
    }

    /// Checks a swing that may complete the number of growths, before the swing ends.
    #[cold]
    #[inline(never)]
    fn check_swing(&self, joint: usize, speed_limit: f64) -> Result<(), Fault> {
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
