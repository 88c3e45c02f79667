//! Energy along motions integrated with `aba` by the classical Runge-Kutta method of fourth order.

use crate::common::reference::{Reference, wam3, wam4, wam7};
use supple_core::dynamics::{aba, kinetic_energy, potential_energy};
use supple_core::{Arm, Vector};

/// Accumulated rounding error of energies of some 10 J after ten thousand steps.
const ROUNDING_J: f64 = 1e-11;

/// A state, and the work done on the arm up to it \[J\].
#[derive(Clone, Copy)]
struct State<const N: usize> {
    q: Vector<N>,
    qd: Vector<N>,
    work: f64,
}

impl<const N: usize> State<N> {
    fn moved(&self, rate: &State<N>, t: f64) -> State<N> {
        State {
            q: self.q + rate.q * t,
            qd: self.qd + rate.qd * t,
            work: self.work + rate.work * t,
        }
    }
}

/// Energy gained beyond the work done \[J\], after `duration_s` in `steps` steps.
fn imbalance<const N: usize>(
    arm: &Arm<N>,
    start: (Vector<N>, Vector<N>),
    torque: impl Fn(&State<N>) -> Vector<N>,
    duration_s: f64,
    steps: usize,
) -> f64 {
    let energy = |s: &State<N>| kinetic_energy(arm, &s.q, &s.qd) + potential_energy(arm, &s.q);
    let rate = |s: &State<N>| {
        let tau = torque(s);
        State {
            q: s.qd,
            qd: aba(arm, &s.q, &s.qd, &tau),
            work: tau.dot(&s.qd),
        }
    };
    let dt = duration_s / steps as f64;
    let mut s = State {
        q: start.0,
        qd: start.1,
        work: 0.0,
    };
    let first = energy(&s);
    for _ in 0..steps {
        let k1 = rate(&s);
        let k2 = rate(&s.moved(&k1, dt / 2.0));
        let k3 = rate(&s.moved(&k2, dt / 2.0));
        let k4 = rate(&s.moved(&k3, dt));
        s = s.moved(&k1, dt / 6.0);
        s = s.moved(&k2, dt / 3.0);
        s = s.moved(&k3, dt / 3.0);
        s = s.moved(&k4, dt / 6.0);
    }
    energy(&s) - first - s.work
}

/// The imbalance is due to the integrator alone: it falls with the fourth power of the step, down
/// to rounding.
fn energy_is_accounted_for<const N: usize>(
    reference: &Reference<N>,
    torque: impl Fn(&State<N>) -> Vector<N> + Copy,
    steps: usize,
) {
    for (k, s) in reference.samples.iter().take(8).enumerate() {
        let run = |n| imbalance(&reference.arm, (s.q, s.qd * 0.5), torque, 0.5, n).abs();
        let (coarse, half, sixteenth) = (run(steps), run(2 * steps), run(16 * steps));
        let figures =
            format!("state {k} of {N} joints: {coarse:.1e}, {half:.1e}, {sixteenth:.1e} J");
        assert!(coarse <= 1e-3, "{figures}");
        assert!(half <= coarse / 12.0 + ROUNDING_J, "{figures}");
        assert!(sixteenth <= coarse * 1e-4 + ROUNDING_J, "{figures}");
    }
}

#[test]
fn a_free_motion_conserves_energy() {
    energy_is_accounted_for(&wam3(), |_| Vector::zeros(), 100);
    energy_is_accounted_for(&wam4(), |_| Vector::zeros(), 100);
    energy_is_accounted_for(&wam7(), |_| Vector::zeros(), 800);
}

#[test]
fn dampers_dissipate_the_lost_energy() {
    energy_is_accounted_for(&wam3(), |s| -s.qd, 100);
    energy_is_accounted_for(&wam4(), |s| -s.qd, 100);
    energy_is_accounted_for(&wam7(), |s| s.qd * -1e-3, 800);
}
