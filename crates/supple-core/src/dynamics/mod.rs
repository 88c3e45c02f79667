//! Rigid-body dynamics of a serial arm: free functions over an immutable [`Arm`].
//!
//! Sweeps run in joint frames, so that each joint turns about z and precision does not depend on how
//! far the wrist is from the base. Accelerations are classical (of the frame's origin), and gravity
//! enters as an upward acceleration of the base.

mod aba;
mod coriolis;
mod crba;
mod energy;
mod kinematics;
mod momentum;
mod regressor;
mod rnea;
mod terms;

pub use aba::aba;
pub use coriolis::{coriolis, coriolis_matrix};
pub use crba::crba;
pub use energy::{kinetic_energy, potential_energy};
pub use kinematics::{jacobian, jacobian_dot_qd, joint_poses, tip_pose};
pub use momentum::{Momentum, momentum};
pub use regressor::{parameters, regressor, regressor_rows};
pub use rnea::{gravity, rnea};
pub use terms::{Terms, terms};

use crate::arm::{Arm, Link};
use crate::body::steiner;
use crate::math::{Matrix3, Vector, Vector3, sin_cos};

/// `z x a`, the cross product with the joint axis.
#[inline]
fn z_cross(a: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(-a.y, a.x, 0.0)
}

/// Rotation of joint frame `i` in its parent's joint frame, for every joint.
#[inline]
fn parent_rotations<const N: usize>(arm: &Arm<N>, q: &Vector<N>) -> [Matrix3<f64>; N] {
    core::array::from_fn(|i| {
        let (s, c) = sin_cos(q[i]);
        let r = &arm.links[i].parent_from_joint.rotation;
        let (x, y) = (r.column(0), r.column(1));
        Matrix3::from_columns(&[x * c + y * s, y * c - x * s, r.column(2).into_owned()])
    })
}

/// Mass, first moment and inertia about the frame's origin, of a link and all that it carries.
#[derive(Clone, Copy)]
struct Composite {
    mass: f64,
    first_moment: Vector3<f64>,
    inertia: Matrix3<f64>,
}

impl Composite {
    #[inline]
    fn of(link: &Link) -> Composite {
        Composite {
            mass: link.mass,
            first_moment: link.first_moment,
            inertia: link.inertia,
        }
    }

    /// Adds a child given in its own frame, which stands at `origin`, turned by `rotation`.
    #[inline]
    fn add(&mut self, child: &Composite, rotation: &Matrix3<f64>, origin: &Vector3<f64>) {
        let moment = rotation * child.first_moment;
        let outer = origin * moment.transpose();
        self.mass += child.mass;
        self.first_moment += moment + origin * child.mass;
        self.inertia += rotation * child.inertia * rotation.transpose()
            + Matrix3::from_diagonal_element(2.0 * origin.dot(&moment))
            - outer
            - outer.transpose()
            + steiner(child.mass, origin);
    }

    /// Moment about the origin and force that accelerate the composite about z by 1 rad/s^2.
    #[inline]
    fn unit_wrench(&self) -> (Vector3<f64>, Vector3<f64>) {
        (
            self.inertia.column(2).into_owned(),
            z_cross(&self.first_moment),
        )
    }
}

/// A wrench of joint frame `i`, seen from the parent's joint frame.
#[inline]
fn wrench_to_parent(
    moment: &Vector3<f64>,
    force: &Vector3<f64>,
    rotation: &Matrix3<f64>,
    origin: &Vector3<f64>,
) -> (Vector3<f64>, Vector3<f64>) {
    let force = rotation * force;
    (rotation * moment + origin.cross(&force), force)
}
