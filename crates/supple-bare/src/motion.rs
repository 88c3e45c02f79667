//! A falling arm with friction and sinusoidal torques.

use crate::arm::{arm, friction};
use crate::digest::Digest;
use crate::print::{PERIOD_S, print, refused};
use core::fmt::{self, Write};
use supple_core::dynamics::{self, Terms};
use supple_core::math::sin;
use supple_core::{Arm, Vector};

const STEPS: usize = 500;

pub fn report<const N: usize>(out: &mut impl Write) -> fmt::Result {
    let arm = refused(arm::<N>(), out)?;
    let friction = friction();
    let mut q = Vector::<N>::from_fn(|i, _| 0.3 - 0.1 * i as f64);
    let mut qd = Vector::<N>::from_fn(|i, _| 0.2 * i as f64 - 0.5);
    let mut digest = Digest::new();
    print(out, "torque_nm", &dynamics::rnea(&arm, &q, &qd, &qd))?;
    for step in 0..STEPS {
        let time_s = step as f64 * PERIOD_S;
        let push = Vector::<N>::from_fn(|i, _| sin(time_s * (3.0 + i as f64)));
        let tau = push - qd.map(|v| friction.torque_nm(v));
        let qdd = dynamics::aba(&arm, &q, &qd, &tau);
        every_function(&mut digest, &arm, &q, &qd, &qdd);
        qd += qdd * PERIOD_S;
        q += qd * PERIOD_S;
    }
    print(out, "position_rad", &q)?;
    print(out, "velocity_rad_per_s", &qd)?;
    let digest = digest.value();
    writeln!(out, "motion of {N} joints, {STEPS} steps: {digest:016x}")
}

fn every_function<const N: usize>(
    digest: &mut Digest,
    arm: &Arm<N>,
    q: &Vector<N>,
    qd: &Vector<N>,
    qdd: &Vector<N>,
) {
    let mut terms = Terms::default();
    dynamics::terms(arm, q, qd, &mut terms);
    digest.pose(&terms.base_from_tip);
    digest.matrix(&terms.jacobian);
    digest.matrix(&terms.mass_matrix);
    digest.matrix(&terms.gravity);
    digest.matrix(&terms.coriolis_gravity);
    digest.matrix(&terms.jacobian_dot_qd);
    digest.matrix(&terms.momentum);
    digest.matrix(&terms.kinetic_gradient);
    digest.matrix(qdd);
    digest.matrix(&dynamics::rnea(arm, q, qd, qdd));
    digest.matrix(&dynamics::gravity(arm, q));
    digest.matrix(&dynamics::crba(arm, q));
    digest.matrix(&dynamics::coriolis(arm, q, qd));
    digest.matrix(&dynamics::coriolis_matrix(arm, q, qd));
    digest.pose(&dynamics::tip_pose(arm, q));
    digest.matrix(&dynamics::jacobian(arm, q));
    digest.matrix(&dynamics::jacobian_dot_qd(arm, q, qd));
    digest.number(dynamics::kinetic_energy(arm, q, qd));
    digest.number(dynamics::potential_energy(arm, q));
    for row in dynamics::regressor(arm, q, qd, qdd).as_flattened() {
        digest.matrix(row);
    }
}
