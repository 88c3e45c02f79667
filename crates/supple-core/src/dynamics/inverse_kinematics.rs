//! Inverse kinematics of the tip's position, for start poses and for checking whether a trajectory
//! is within reach. The control loop does not use it.

use crate::config::{Limits, Role};
use crate::dynamics::{jacobian, tip_pose};
use crate::math::linalg::Cholesky;
use crate::math::{Matrix, Matrix3, Vector, Vector3, sqrt};
use crate::model::arm::Arm;

const MAX_ITERATIONS: usize = 200;
const MAX_STEP_RAD: f64 = 0.2;
const TOLERANCE_M: f64 = 1e-10;

/// Result of the inverse kinematics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IkSolution<const N: usize> {
    /// Joint angles \[rad\], within the limits and out of the soft zones; held joints at their angle.
    pub position_rad: Vector<N>,
    /// Distance of the tip from the point \[m\].
    pub distance_m: f64,
}

impl<const N: usize> IkSolution<N> {
    /// Returns whether the point is reached to within a micrometre.
    pub fn reached(&self) -> bool {
        self.distance_m < 1e-6
    }
}

/// Finds joint angles that bring the tip to `point_m` (base axes), by damped least squares over the
/// active joints, between the soft zones. The solution is the local optimum reached from
/// `seed_rad`.
pub fn inverse_kinematics<const N: usize>(
    arm: &Arm<N>,
    roles: &[Role; N],
    limits: &Limits<N>,
    seed_rad: &Vector<N>,
    point_m: &Vector3<f64>,
) -> IkSolution<N> {
    let clamp = |q: Vector<N>| -> Vector<N> {
        Vector::from_fn(|i, _| match roles[i] {
            Role::Held { position_rad, .. } => position_rad,
            Role::Active => q[i]
                .max(limits.position_lower_rad[i] + limits.soft_zone_rad)
                .min(limits.position_upper_rad[i] - limits.soft_zone_rad),
        })
    };
    let away = |q: &Vector<N>| point_m - tip_pose(arm, q).translation;
    let mut q = clamp(*seed_rad);
    let mut error = away(&q);
    let mut damping = 1e-6;
    for _ in 0..MAX_ITERATIONS {
        let distance = sqrt(error.dot(&error));
        if distance < TOLERANCE_M {
            break;
        }
        let mut j: Matrix<3, N> = jacobian(arm, &q).fixed_rows::<3>(0).into_owned();
        for (i, role) in roles.iter().enumerate() {
            if *role != Role::Active {
                j.column_mut(i).fill(0.0);
            }
        }
        let gram = j * j.transpose() + Matrix3::from_diagonal_element(damping);
        let Some(gram) = Cholesky::new(&gram) else {
            damping *= 10.0;
            continue;
        };
        let mut step = j.transpose() * gram.solve(&error);
        let length = sqrt(step.dot(&step));
        if length > MAX_STEP_RAD {
            step *= MAX_STEP_RAD / length;
        }
        let next = clamp(q + step);
        let next_error = away(&next);
        if next_error.dot(&next_error) < error.dot(&error) {
            q = next;
            error = next_error;
            damping = (damping * 0.3).max(1e-12);
        } else if damping > 1e3 {
            break;
        } else {
            damping *= 10.0;
        }
    }
    IkSolution {
        position_rad: q,
        distance_m: sqrt(error.dot(&error)),
    }
}
