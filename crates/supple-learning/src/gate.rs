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
const REVERSED: f64 = 0.9;

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
    /// Direction of the average velocity, and the measured angle that is furthest in it \[rad\].
    sign: f64,
    furthest_rad: f64,
    /// Whether it got further in this cycle.
    gets_further: bool,
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
            sign: 0.0,
            furthest_rad: 0.0,
            gets_further: false,
        }
    }

    /// Processes a cycle with this measured angle, this velocity, and this direction of the dry friction, -1 to 1.
    pub(crate) fn update(
        &mut self,
        measured_rad: f64,
        velocity_rad_per_s: f64,
        direction: f64,
        period_s: f64,
    ) {
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
        let sign = self.mean_rad_per_s.signum();
        self.gets_further = sign == self.sign && (measured_rad - self.furthest_rad) * sign > 0.0;
        if self.gets_further || sign != self.sign {
            (self.sign, self.furthest_rad) = (sign, measured_rad);
        }
    }

    /// Returns whether the joint slides in one direction.
    pub(crate) fn is_open(&self) -> bool {
        self.slides() || self.creeps_s >= CREEPS_S
    }

    fn slides(&self) -> bool {
        self.since_slow_s >= self.settle_s
    }

    /// Returns whether the joint has moved until this cycle. One that creeps has when its measured angle gets further: it may rest for
    /// half a second until its average velocity shows it, under less than its friction.
    pub(crate) fn has_moved(&self) -> bool {
        self.slides() || (self.is_open() && self.gets_further)
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
            gate.update(0.0, velocity, direction, PERIOD_S);
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
        assert!(!after(gate(1e-3), 3.0, |_| (5e-3, 0.85)));
        assert!(!after(gate(1e-3), 3.0, |_| (5e-3, -1.0)));
        assert!(after(gate(1e-3), 3.0, |_| (5e-3, 0.99)));
    }

    /// A joint that creeps at five milliradians a second in steps of an encoder, then rests. Its friction is known until the last step;
    /// the gate is open for longer.
    #[test]
    fn a_creeping_joint_has_not_moved_after_its_last_step() {
        let (step_rad, step_s, rests_s) = (0.38e-3, 0.076, 3.0);
        let mut gate = gate(1e-3);
        let (mut last_open_s, mut last_moved_s, mut moved) = (0.0, 0.0, 0);
        for cycle in 0..5000 {
            let t_s = f64::from(cycle) * PERIOD_S;
            let since_step_s = if t_s < rests_s { t_s % step_s } else { 1.0 };
            let measured_rad = (t_s.min(rests_s) / step_s).floor() * step_rad;
            let velocity = step_rad * 40.0 * (-since_step_s * 40.0).exp();
            gate.update(measured_rad, velocity, 0.99, PERIOD_S);
            if gate.is_open() {
                last_open_s = t_s;
            }
            if gate.has_moved() {
                (last_moved_s, moved) = (t_s, moved + 1);
            }
        }
        assert!(moved > 20, "{moved}");
        assert!(last_moved_s < rests_s, "{last_moved_s}");
        assert!(last_open_s > rests_s + 0.3, "{last_open_s}");
    }
}
