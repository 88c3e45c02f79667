//! Which joints slide in one direction. Of others the dry friction is not known, and their equations are not used.

use supple_core::Friction;
use supple_core::math::exp;

/// Minimum time for which a joint must creep in one direction \[s\].
const CREEPS_S: f64 = 0.1;
/// The same for one that does not only start or stop, which takes less than half a second \[s\].
const CREEPS_ON_S: f64 = 1.0;
/// Minimum speed of a creeping joint, averaged over [`CREEP_AVERAGING_S`] \[rad/s\]: above what the steps of a coarse encoder cause at rest.
const CREEP_RAD_PER_S: f64 = 1.5e-3;
/// Time over which the speed of a creeping joint is averaged \[s\].
const CREEP_AVERAGING_S: f64 = 0.5;
/// Time without a greater average speed than that of a moving joint, until a joint counts as creeping \[s\]: one that reverses rests for a part
/// of the averaging time.
const SLOW_S: f64 = 1.0;
/// Direction of dry friction, at most one, from which it counts as reversed. Less is in the middle of a reversal.
const REVERSED: f64 = 0.95;

/// Watches a joint's motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SlidingGate {
    /// Minimum speed \[rad/s\], and time at such a speed, without a reversal, until the joint's filters have settled \[s\].
    min_rad_per_s: f64,
    settle_s: f64,
    /// Whether the presliding distance is known, so that the equations model reversals.
    presliding: bool,
    /// Time since the joint was last slow or reversed \[s\].
    since_slow_s: f64,
    /// Velocity of the previous cycle, and its average \[rad/s\].
    last_rad_per_s: f64,
    mean_rad_per_s: f64,
    /// Time since the average was that of a moving joint \[s\].
    since_fast_s: f64,
    /// Time for which the joint has crept in one direction \[s\].
    creeps_s: f64,
}

impl SlidingGate {
    /// Creates the gate of a joint with this friction.
    pub(crate) fn new(friction: &Friction) -> Self {
        let presliding = friction.presliding_rad > 0.0;
        let (min_rad_per_s, settle_s) = if presliding {
            (0.02, 0.05)
        } else {
            (0.08, 0.15)
        };
        SlidingGate {
            min_rad_per_s,
            settle_s,
            presliding,
            since_slow_s: 0.0,
            last_rad_per_s: 0.0,
            mean_rad_per_s: 0.0,
            since_fast_s: 0.0,
            creeps_s: 0.0,
        }
    }

    /// Processes a cycle with this velocity and this direction of the dry friction, -1 to 1.
    pub(crate) fn update(&mut self, velocity_rad_per_s: f64, direction: f64, period_s: f64) {
        let is_fast = velocity_rad_per_s.abs() >= self.min_rad_per_s;
        let reverses = velocity_rad_per_s * self.last_rad_per_s < 0.0;
        self.last_rad_per_s = velocity_rad_per_s;
        self.since_slow_s = match is_fast && !reverses {
            true => self.since_slow_s + period_s,
            false => 0.0,
        };
        let share = 1.0 - exp(-period_s / CREEP_AVERAGING_S);
        self.mean_rad_per_s += (velocity_rad_per_s - self.mean_rad_per_s) * share;
        self.since_fast_s = match self.mean_rad_per_s.abs() < self.min_rad_per_s {
            true => self.since_fast_s + period_s,
            false => 0.0,
        };
        let creeps = self.presliding
            && self.since_fast_s >= SLOW_S
            && self.mean_rad_per_s.abs() >= CREEP_RAD_PER_S
            && direction * self.mean_rad_per_s.signum() >= REVERSED;
        self.creeps_s = if creeps {
            self.creeps_s + period_s
        } else {
            0.0
        };
    }

    /// Returns whether the joint slides in one direction.
    pub(crate) fn is_open(&self) -> bool {
        self.since_slow_s >= self.settle_s || self.creeps_s >= CREEPS_S
    }

    /// Returns whether the joint has crept in one direction for longer than one that starts or stops.
    pub(crate) fn creeps_on(&self) -> bool {
        self.creeps_s >= CREEPS_ON_S
    }
}

#[cfg(test)]
mod tests {
    use super::SlidingGate;
    use supple_core::Friction;

    const PERIOD_S: f64 = 1e-3;

    fn gate(presliding_rad: f64) -> SlidingGate {
        SlidingGate::new(&Friction {
            presliding_rad,
            ..Friction::coulomb(0.1, 0.5)
        })
    }

    fn after(mut gate: SlidingGate, duration_s: f64, motion: impl Fn(f64) -> (f64, f64)) -> bool {
        for cycle in 0..(duration_s / PERIOD_S) as usize {
            let (velocity, direction) = motion(cycle as f64 * PERIOD_S);
            gate.update(velocity, direction, PERIOD_S);
        }
        gate.is_open()
    }

    #[test]
    fn a_fast_joint_opens_the_gate_soon_after_its_reversal() {
        assert!(after(gate(1e-3), 0.06, |_| (0.1, 0.0)));
        assert!(!after(gate(0.0), 0.06, |_| (0.1, 0.0)));
        assert!(after(gate(0.0), 0.16, |_| (0.1, 0.0)));
        assert!(!after(gate(0.0), 10.0, |_| (0.07, 1.0)));
    }

    /// A joint that creeps at two milliradians a second in steps of an encoder, each a pulse in its filtered velocity.
    #[test]
    fn a_creeping_joint_opens_it_where_its_presliding_is_known() {
        let creep =
            |step_s: f64| move |t_s: f64| (0.38e-3 * 40.0 * (-(t_s % step_s) * 40.0).exp(), 0.99);
        assert!(after(gate(1e-3), 3.0, creep(0.19)));
        assert!(!after(gate(0.0), 3.0, creep(0.19)));
        // Half a milliradian a second is rest.
        assert!(!after(gate(1e-3), 3.0, creep(0.76)));
    }

    #[test]
    fn a_joint_in_the_middle_of_its_reversal_keeps_it_closed() {
        assert!(!after(gate(1e-3), 3.0, |_| (5e-3, 0.9)));
        assert!(!after(gate(1e-3), 3.0, |_| (5e-3, -1.0)));
        assert!(after(gate(1e-3), 3.0, |_| (5e-3, 0.99)));
    }
}
