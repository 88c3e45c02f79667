//! Checks the motion of an arm that the plant loop holds or lays down, from encoder speeds and speed limits alone.
//!
//! The holding torque is gravity compensation at the measured pose. If an angle is wrong, for example because a zero
//! position has moved, this torque accelerates the arm. A correct holding torque moves no joint at its speed limit, and
//! damping slows a joint that moved before. A joint therefore counts as accelerated if it exceeds its limit for [`FAST_S`]
//! and either is faster than when holding began, or still exceeds the limit [`STOP_S`] later. While the motors only damp,
//! the arm falls at the speed at which damping balances its weight; if a joint is faster than [`RUNAWAY_SHARE`] times its
//! limit for [`FAST_S`], the damping itself accelerates it: the arm runs away.

use supple_core::Vector;

/// Time for which a joint must be too fast before it counts as accelerated \[s\].
const FAST_S: f64 = 0.01;
/// Time after the start of holding in which speeds count as speeds before holding \[s\].
const SETTLING_S: f64 = 0.02;
/// Ratio to the speed before holding above which a joint counts as accelerated.
const SPEED_GROWTH: f64 = 1.25;
/// Time after which no joint may exceed its limit, whatever its speed before holding \[s\].
const STOP_S: f64 = 0.25;
/// Ratio to a joint's speed limit that a joint does not reach while it falls against damping.
const RUNAWAY_SHARE: f64 = 3.0;
/// Fraction of a joint's speed limit below which the joint stands still.
const REST_SHARE: f64 = 0.05;
/// Time for which all joints must stand still before the arm counts as lying \[s\].
const REST_S: f64 = 0.5;

/// Check of the motion of an arm that the loop holds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HoldCheck<const N: usize> {
    limit_rad_per_s: Vector<N>,
    /// Time since holding began \[s\].
    elapsed_s: f64,
    /// Speed of the fastest joint at the beginning \[rad/s\].
    fastest_rad_per_s: f64,
    /// Joint that is too fast, and the time for which it has been \[s\].
    fast: Option<(usize, f64)>,
    /// Time for which all joints have stood still \[s\].
    rest_s: f64,
    /// Time for which a joint has been faster than [`RUNAWAY_SHARE`] times its limit \[s\].
    runaway_s: f64,
}

impl<const N: usize> HoldCheck<N> {
    pub(crate) fn new(limit_rad_per_s: Vector<N>) -> HoldCheck<N> {
        HoldCheck {
            limit_rad_per_s,
            elapsed_s: 0.0,
            fastest_rad_per_s: 0.0,
            fast: None,
            rest_s: 0.0,
            runaway_s: 0.0,
        }
    }

    /// Restarts the check: the loop does not hold the arm.
    pub(crate) fn reset(&mut self) {
        *self = HoldCheck::new(self.limit_rad_per_s);
    }

    /// Processes the speeds of a cycle \[rad/s\], `period_s` after those of the previous cycle.
    pub(crate) fn observe(&mut self, velocity_rad_per_s: &Vector<N>, period_s: f64) {
        self.elapsed_s += period_s;
        let speed = velocity_rad_per_s.abs();
        if self.elapsed_s <= SETTLING_S {
            self.fastest_rad_per_s = self.fastest_rad_per_s.max(speed.max());
        }
        let allowed = |joint: usize| match self.elapsed_s > STOP_S {
            true => self.limit_rad_per_s[joint],
            false => self.limit_rad_per_s[joint].max(SPEED_GROWTH * self.fastest_rad_per_s),
        };
        let settled = self.elapsed_s > SETTLING_S;
        let found = (0..N).find(|joint| settled && speed[*joint] > allowed(*joint));
        let before_s = self.fast.map_or(0.0, |(_, fast_s)| fast_s);
        self.fast = found.map(|joint| (joint, before_s + period_s));
        let stands_still =
            (0..N).all(|joint| speed[joint] < REST_SHARE * self.limit_rad_per_s[joint]);
        self.rest_s = if stands_still {
            self.rest_s + period_s
        } else {
            0.0
        };
        let runs_away =
            (0..N).any(|joint| speed[joint] > RUNAWAY_SHARE * self.limit_rad_per_s[joint]);
        self.runaway_s = if runs_away {
            self.runaway_s + period_s
        } else {
            0.0
        };
    }

    /// Returns the joint that the holding torque accelerates.
    pub(crate) fn accelerated_joint(&self) -> Option<usize> {
        let (joint, fast_s) = self.fast?;
        (fast_s > FAST_S).then_some(joint)
    }

    /// Restarts the runaway check: the motors do not damp without torque in this cycle.
    pub(crate) fn reset_runaway(&mut self) {
        self.runaway_s = 0.0;
    }

    /// Whether damping fails to slow the arm.
    pub(crate) fn runs_away(&self) -> bool {
        self.runaway_s > FAST_S
    }

    /// Whether the arm has stood still long enough to count as lying.
    pub(crate) fn stands_still(&self) -> bool {
        self.rest_s > REST_S
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: f64 = 1e-3;

    /// Checks an arm with a speed limit of 2 rad/s whose joint 1 has this speed after a time \[s\]; returns the time at
    /// which the joint counts as accelerated.
    fn accelerated_after_s(speed: impl Fn(f64) -> f64) -> Option<f64> {
        let mut check = HoldCheck::<2>::new(Vector::repeat(2.0));
        (1..2000).map(|k| f64::from(k) * MS).find(|time_s| {
            check.observe(&Vector::from([0.0, speed(*time_s)]), MS);
            check.accelerated_joint() == Some(1)
        })
    }

    #[test]
    fn a_speed_that_grows_above_the_limit_counts_as_accelerated_and_one_that_decays_does_not() {
        // 20 rad/s^2 from rest exceed the limit after 0.1 s.
        let after_s = accelerated_after_s(|time_s| 20.0 * time_s).expect("accelerated");
        assert!((0.1..0.12).contains(&after_s), "{after_s}");
        assert_eq!(
            accelerated_after_s(|time_s| 4.5 * (-time_s / 0.1).exp()),
            None
        );
        assert_eq!(accelerated_after_s(|_| 1.9), None);
    }

    #[test]
    fn a_speed_above_the_limit_that_does_not_decay_counts_as_accelerated_after_a_quarter_of_a_second()
     {
        let after_s = accelerated_after_s(|_| 4.0).expect("accelerated");
        assert!((0.25..0.27).contains(&after_s), "{after_s}");
    }

    /// A joint that damping accelerates becomes ever faster; a joint that falls against damping reaches a constant speed.
    #[test]
    fn a_joint_that_damping_accelerates_runs_away() {
        let after_s = |speed: &dyn Fn(f64) -> f64| {
            let mut check = HoldCheck::<2>::new(Vector::repeat(2.0));
            (1..2000).map(|k| f64::from(k) * MS).find(|time_s| {
                check.observe(&Vector::from([0.0, speed(*time_s)]), MS);
                check.runs_away()
            })
        };
        assert_eq!(after_s(&|time_s| 5.9 * (1.0 - (-time_s / 0.1).exp())), None);
        let found_s = after_s(&|time_s| (time_s / 0.1).exp()).expect("it runs away");
        // The speed reaches 6 rad/s after 0.179 s; the check needs 10 ms more.
        assert!((0.187..0.193).contains(&found_s), "{found_s}");
    }

    #[test]
    fn an_arm_counts_as_lying_after_half_a_second_of_standstill() {
        let mut check = HoldCheck::<2>::new(Vector::repeat(2.0));
        for k in 0..1000 {
            let speed = if k < 100 { 0.2 } else { 0.01 };
            check.observe(&Vector::repeat(speed), MS);
            if !(598..602).contains(&k) {
                assert_eq!(check.stands_still(), k > 600, "{k}");
            }
        }
    }
}
