//! Velocity products: `C(q, qd) qd` and the Christoffel matrix `C(q, qd)`.
//!
//! The matrix is built from `B_i = ((v x*) I - I (v x) + (I v) xbar*) / 2` of each body, summed over
//! the bodies that each joint moves (Echeandia and Wensing, "Numerical methods to compute the Coriolis matrix
//! and Christoffel symbols for rigid-body systems", 2021), so that `H' - 2 C` is skew. Spatial vectors
//! here are angular first.

use super::rnea;
use super::rotations::parent_rotations;
use crate::math::{Matrix, Matrix3, Vector, Vector3, skew};
use crate::model::arm::Arm;

/// Returns `C(q, qd) qd` \[N m\]: inverse dynamics at `qdd = 0` without gravity.
pub fn coriolis<const N: usize>(arm: &Arm<N>, q: &Vector<N>, qd: &Vector<N>) -> Vector<N> {
    let weightless = Arm {
        gravity: Vector3::zeros(),
        ..*arm
    };
    rnea(&weightless, q, qd, &Vector::zeros())
}

/// Returns the Christoffel matrix `C(q, qd)` \[N m s/rad\]: `C_ij = sum_k Gamma^i_jk qd_k` of Eq. (3.1).
pub fn coriolis_matrix<const N: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
    qd: &Vector<N>,
) -> Matrix<N, N> {
    let rotations = parent_rotations(arm, q);
    let mut transforms = [Matrix::<6, 6>::zeros(); N];
    let mut inertias = [Matrix::<6, 6>::zeros(); N];
    let mut biases = [Matrix::<6, 6>::zeros(); N];
    let mut axis_rates = [Vector::<6>::zeros(); N];
    let axis = Vector::<6>::new(0.0, 0.0, 1.0, 0.0, 0.0, 0.0);
    let mut twist = Vector::<6>::zeros();
    for i in 0..N {
        let link = &arm.links[i];
        let e = rotations[i].transpose();
        let origin = skew(&link.parent_from_joint.translation);
        transforms[i] = blocks(&e, &Matrix3::zeros(), &-(e * origin), &e);
        twist = transforms[i] * twist + axis * qd[i];
        let (omega, velocity) = split(&twist);
        let h = skew(&link.first_moment);
        inertias[i] = blocks(
            &link.inertia,
            &h,
            &h.transpose(),
            &Matrix3::from_diagonal_element(link.mass),
        );
        let cross = blocks(
            &skew(&omega),
            &Matrix3::zeros(),
            &skew(&velocity),
            &skew(&omega),
        );
        axis_rates[i] = cross * axis;
        let (moment, force) = split(&(inertias[i] * twist));
        let bar = blocks(
            &-skew(&moment),
            &-skew(&force),
            &-skew(&force),
            &Matrix3::zeros(),
        );
        biases[i] = (bar - cross.transpose() * inertias[i] - inertias[i] * cross) * 0.5;
    }
    let mut c = Matrix::zeros();
    for j in (0..N).rev() {
        let mut f1 = inertias[j] * axis_rates[j] + biases[j] * axis;
        let mut f2 = inertias[j] * axis;
        let mut f3 = biases[j].tr_mul(&axis);
        c[(j, j)] = f1[2];
        for i in (0..j).rev() {
            f1 = transforms[i + 1].tr_mul(&f1);
            f2 = transforms[i + 1].tr_mul(&f2);
            f3 = transforms[i + 1].tr_mul(&f3);
            c[(i, j)] = f1[2];
            c[(j, i)] = axis_rates[i].dot(&f2) + f3[2];
        }
        if j > 0 {
            let x = transforms[j];
            inertias[j - 1] += x.transpose() * inertias[j] * x;
            biases[j - 1] += x.transpose() * biases[j] * x;
        }
    }
    c
}

fn blocks(
    upper_left: &Matrix3<f64>,
    upper_right: &Matrix3<f64>,
    lower_left: &Matrix3<f64>,
    lower_right: &Matrix3<f64>,
) -> Matrix<6, 6> {
    let mut m = Matrix::<6, 6>::zeros();
    m.fixed_view_mut::<3, 3>(0, 0).copy_from(upper_left);
    m.fixed_view_mut::<3, 3>(0, 3).copy_from(upper_right);
    m.fixed_view_mut::<3, 3>(3, 0).copy_from(lower_left);
    m.fixed_view_mut::<3, 3>(3, 3).copy_from(lower_right);
    m
}

fn split(v: &Vector<6>) -> (Vector3<f64>, Vector3<f64>) {
    (
        Vector3::new(v[0], v[1], v[2]),
        Vector3::new(v[3], v[4], v[5]),
    )
}
