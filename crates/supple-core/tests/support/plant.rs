//! Accurate simulation of the arm: forward dynamics and small Runge-Kutta steps.

use supple_core::config::Role;
use supple_core::dynamics::{aba, jacobian};
use supple_core::math::Vector3;
use supple_core::{Arm, Matrix, Vector};

/// An arm in motion, without friction.
#[derive(Clone, Debug)]
pub struct Plant<const N: usize> {
    pub arm: Arm<N>,
    pub q: Vector<N>,
    pub qd: Vector<N>,
}

impl<const N: usize> Plant<N> {
    pub fn at_rest(arm: Arm<N>, q: Vector<N>) -> Self {
        let qd = Vector::zeros();
        Plant { arm, q, qd }
    }

    /// Advances by `duration_s` under constant torques plus `external` at `(q, qd)`.
    pub fn advance(
        &mut self,
        torque_nm: &Vector<N>,
        external: impl Fn(&Arm<N>, &Vector<N>, &Vector<N>) -> Vector<N>,
        duration_s: f64,
        substeps: u32,
    ) {
        let h = duration_s / f64::from(substeps);
        let arm = &self.arm;
        let slope =
            |q: &Vector<N>, qd: &Vector<N>| aba(arm, q, qd, &(torque_nm + external(arm, q, qd)));
        for _ in 0..substeps {
            let (q, qd) = (self.q, self.qd);
            let k1 = slope(&q, &qd);
            let (q2, qd2) = (q + qd * (0.5 * h), qd + k1 * (0.5 * h));
            let k2 = slope(&q2, &qd2);
            let (q3, qd3) = (q + qd2 * (0.5 * h), qd + k2 * (0.5 * h));
            let k3 = slope(&q3, &qd3);
            let (q4, qd4) = (q + qd3 * h, qd + k3 * h);
            let k4 = slope(&q4, &qd4);
            self.q += (qd + (qd2 + qd3) * 2.0 + qd4) * (h / 6.0);
            self.qd += (k1 + (k2 + k3) * 2.0 + k4) * (h / 6.0);
        }
    }
}

/// Joint torques of a force on the tip.
pub fn push<const N: usize>(arm: &Arm<N>, q: &Vector<N>, force_n: &Vector3<f64>) -> Vector<N> {
    jacobian(arm, q).fixed_rows::<3>(0).tr_mul(force_n)
}

/// No external torque.
pub fn nothing<const N: usize>(_: &Arm<N>, _: &Vector<N>, _: &Vector<N>) -> Vector<N> {
    Vector::zeros()
}

/// Accelerations with ideal torques that keep held joints from accelerating.
pub fn held_acceleration<const N: usize>(
    arm: &Arm<N>,
    roles: &[Role; N],
    q: &Vector<N>,
    qd: &Vector<N>,
    torque_nm: &Vector<N>,
) -> Vector<N> {
    let free = aba(arm, q, qd, torque_nm);
    let held: Vec<usize> = (0..N).filter(|i| roles[*i] != Role::Active).collect();
    // Accelerations are affine in the torques: solve for the reactions, joint by joint.
    let mut response = Matrix::<N, N>::identity();
    for &j in &held {
        let mut torque = *torque_nm;
        torque[j] += 1.0;
        let column = aba(arm, q, qd, &torque) - free;
        for &i in &held {
            response[(i, j)] = column[i];
        }
    }
    let mut wanted = Vector::zeros();
    for &j in &held {
        wanted[j] = -free[j];
    }
    let reaction = super::inverse(&response) * wanted;
    aba(arm, q, qd, &(torque_nm + reaction))
}
