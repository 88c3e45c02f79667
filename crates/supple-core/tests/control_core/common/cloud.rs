//! Bodies and arms as clouds of point masses: mechanics from first principles, in link frames,
//! without any formula of the library.

use supple_core::math::{Matrix3, Vector3};
use supple_core::nalgebra::{Rotation3, Unit};
use supple_core::{Body, Joint, Matrix, Pose, Vector};

/// A point mass.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    pub mass_kg: f64,
    pub position_m: Vector3<f64>,
}

/// A rigid body made of point masses.
#[derive(Clone, Debug)]
pub struct Cloud(pub Vec<Point>);

impl Cloud {
    pub fn mass_kg(&self) -> f64 {
        self.0.iter().map(|p| p.mass_kg).sum()
    }

    pub fn first_moment(&self) -> Vector3<f64> {
        self.0.iter().map(|p| p.position_m * p.mass_kg).sum()
    }

    /// Inertia about `centre`.
    pub fn inertia_about(&self, centre: &Vector3<f64>) -> Matrix3<f64> {
        self.0
            .iter()
            .map(|p| {
                let r = p.position_m - centre;
                (Matrix3::identity() * r.norm_squared() - r * r.transpose()) * p.mass_kg
            })
            .sum()
    }

    pub fn body(&self) -> Body {
        let com_m = self.first_moment() / self.mass_kg();
        Body {
            mass_kg: self.mass_kg(),
            com_m,
            inertia_kg_m2: self.inertia_about(&com_m),
        }
    }

    /// The same cloud expressed in frame `a`; `self` is given in frame `b`.
    pub fn expressed_in(&self, a_from_b: &Pose) -> Cloud {
        let seen = |p: &Point| Point {
            position_m: a_from_b.transform_point(&p.position_m),
            ..*p
        };
        Cloud(self.0.iter().map(seen).collect())
    }

    pub fn joined(mut self, other: Cloud) -> Cloud {
        self.0.extend(other.0);
        self
    }
}

/// Rotation by `angle_rad` about a unit `axis` through the origin.
pub fn turn(axis: &Vector3<f64>, angle_rad: f64) -> Pose {
    Pose {
        rotation: Rotation3::from_axis_angle(&Unit::new_unchecked(*axis), angle_rad).into_inner(),
        translation: Vector3::zeros(),
    }
}

/// Pose of every link frame in the base.
pub fn link_poses<const N: usize>(joints: &[Joint; N], q: &Vector<N>) -> [Pose; N] {
    let mut base_from_link = Pose::IDENTITY;
    std::array::from_fn(|i| {
        base_from_link = base_from_link * joints[i].parent_from_link * turn(&joints[i].axis, q[i]);
        base_from_link
    })
}

/// Columns: velocity of a point of link `link`, at `position` in the base, for unit speed of each
/// joint.
pub fn point_jacobian<const N: usize>(
    joints: &[Joint; N],
    poses: &[Pose; N],
    link: usize,
    position: &Vector3<f64>,
) -> Matrix<3, N> {
    let mut jacobian = Matrix::<3, N>::zeros();
    for i in 0..=link {
        let axis = poses[i].rotation * joints[i].axis;
        let lever = position - poses[i].translation;
        jacobian.set_column(i, &axis.cross(&lever));
    }
    jacobian
}

/// Mass matrix without rotors, and potential energy, summed over the points. `clouds` in link
/// frames.
pub fn point_mass_reference<const N: usize>(
    joints: &[Joint; N],
    clouds: &[Cloud; N],
    gravity: &Vector3<f64>,
    q: &Vector<N>,
) -> (Matrix<N, N>, f64) {
    let poses = link_poses(joints, q);
    let mut mass_matrix = Matrix::<N, N>::zeros();
    let mut potential_energy = 0.0;
    for (link, cloud) in clouds.iter().enumerate() {
        for point in &cloud.expressed_in(&poses[link]).0 {
            let j = point_jacobian(joints, &poses, link, &point.position_m);
            mass_matrix += j.transpose() * j * point.mass_kg;
            potential_energy -= point.mass_kg * gravity.dot(&point.position_m);
        }
    }
    (mass_matrix, potential_energy)
}
