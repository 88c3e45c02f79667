//! Null-space damping of the position task that the loop's delay allows.
//!
//! With a delayed velocity, damping `D` of joints with mass matrix `H` is stable while the greatest eigenvalue of
//! `H^-1 D` stays below the margin over the delay. For a diagonal `D` that eigenvalue is at most the sum of
//! `D_i (H^-1)_ii`; each of the `n` active joints gets an `n`-th part.

use super::checks::DAMPING_MARGIN;
use crate::config::{Config, Role};
use crate::dynamics::crba;
use crate::math::linalg::Cholesky;
use crate::math::{Matrix, Vector};

/// Poses at which the mass matrix is computed, spread over the joint ranges.
const POSES: u32 = 64;
/// Limit of the joint angles considered \[rad\]: a wider range repeats the same poses.
const TURN_RAD: f64 = core::f64::consts::PI;

/// Returns the damping of each joint \[N m s/rad\]: the damping of the law, or less if the delay does not allow it.
pub(super) fn nullspace_damping_nm_s_per_rad<const N: usize>(
    config: &Config<N>,
    delay_s: f64,
) -> Vector<N> {
    let wanted = Vector::repeat(config.law.nullspace_damping_nm_s_per_rad);
    let active = config.roles.iter().filter(|role| **role == Role::Active);
    let active = active.count();
    if active <= 3 {
        // The task leaves no null space.
        return wanted;
    }
    let mut mobility = Vector::<N>::zeros();
    for pose in 0..POSES {
        let q = Vector::from_fn(|joint, _| at_pose(config, pose, joint));
        let Some(mass) = Cholesky::new(&active_mass_matrix(config, &q)) else {
            continue;
        };
        let inverse = mass.solve(&Matrix::<N, N>::identity());
        mobility = Vector::from_fn(|i, _| mobility[i].max(inverse[(i, i)]));
    }
    let share = DAMPING_MARGIN / (delay_s * active as f64);
    Vector::from_fn(|i, _| match mobility[i] > 0.0 {
        true => wanted[i].min(share / mobility[i]),
        false => wanted[i],
    })
}

/// Returns the mass matrix with held joints decoupled, as if they did not move.
fn active_mass_matrix<const N: usize>(config: &Config<N>, q: &Vector<N>) -> Matrix<N, N> {
    let mass_matrix = crba(&config.arm, q);
    let moves = |joint: usize| config.roles[joint] == Role::Active;
    Matrix::from_fn(|i, j| match moves(i) && moves(j) || i == j {
        true => mass_matrix[(i, j)],
        false => 0.0,
    })
}

/// Returns the angle of a joint in one of the poses \[rad\]. Multiples of independent irrational numbers spread the poses
/// evenly.
fn at_pose<const N: usize>(config: &Config<N>, pose: u32, joint: usize) -> f64 {
    const ROOTS: [f64; 7] = [
        core::f64::consts::SQRT_2,
        1.732_050_807_568_877_2,
        2.236_067_977_499_79,
        2.645_751_311_064_590_7,
        3.316_624_790_355_4,
        3.605_551_275_463_989,
        4.123_105_625_617_661,
    ];
    if let Role::Held { position_rad, .. } = config.roles[joint] {
        return position_rad;
    }
    let lower = config.limits.position_lower_rad[joint].max(-TURN_RAD);
    let upper = config.limits.position_upper_rad[joint].min(TURN_RAD);
    let multiple = f64::from(pose + 1) * ROOTS[joint % ROOTS.len()];
    let share = multiple - f64::from(multiple as u32);
    lower + share * (upper - lower)
}
