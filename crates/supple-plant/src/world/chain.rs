//! The arm: a chain of revolute joints, integrated in joint coordinates.
//!
//! ```text
//! (M + dt (C + diag(d))) a = f - h - diag(d) v     v+ = v + dt a     q+ = q + dt v+
//! ```
//!
//! `M = sum J_i^T diag(m_i, I_i) J_i + diag(armature)` by the Jacobians of the centres of mass in base axes, `h` the
//! velocity products, `C` their linearisation, `d` a damping of the joints, `f` gravity, joint torques and the force on
//! the tip. Semi-implicit Euler, first-order accurate; as damping and velocity products are linearly implicit, fast
//! motion does not gain energy. If that linearisation nevertheless adds more than the work of `f`, the step is
//! repeated without `C`.
//!
//! The discretisation equals that of the multibody of the rapier engine, which is general and allocates in every step; a test
//! compares both step by step. The controller's model is recursive, in the joints' frames, and shares no code with this one.

use super::tip::TipForce;
use core::array;
use supple_core::nalgebra::{Matrix3, Vector3};
use supple_core::{Arm, Matrix, Pose, Vector};

/// Largest angle of a step at which the linearised velocity products are not checked \[rad\].
const UNCHECKED_RAD: f64 = 1e-3;

/// A link in the frame of its joint, whose z is the joint's axis.
#[derive(Clone, Copy, Debug)]
struct ChainLink {
    parent_from_joint: Pose,
    mass_kg: f64,
    com_m: Vector3<f64>,
    /// Inertia about the centre of mass.
    inertia_kg_m2: Matrix3<f64>,
}

/// The arm with its state.
#[derive(Clone, Debug)]
pub struct Chain<const N: usize> {
    links: [ChainLink; N],
    armature_kg_m2: Vector<N>,
    gravity_m_per_s2: Vector3<f64>,
    /// Joint angles \[rad\].
    pub position_rad: Vector<N>,
    /// Joint velocities \[rad/s\].
    pub velocity_rad_per_s: Vector<N>,
    /// Joint frames, `base_from_joint`.
    pub poses: [Pose; N],
}

/// Torques and forces of a step.
pub struct Forces<'a, const N: usize> {
    /// Torque on each joint \[N m\].
    pub torque_nm: &'a Vector<N>,
    /// Damping of each joint, implicit \[N m s/rad\].
    pub damping_nm_s_per_rad: &'a Vector<N>,
    /// Force on the tip.
    pub tip: &'a TipForce,
    /// Point at which the force acts, base axes \[m\].
    pub tip_center_m: &'a Vector3<f64>,
}

/// Motion of the links in base axes.
struct Links<const N: usize> {
    axis: [Vector3<f64>; N],
    origin_m: [Vector3<f64>; N],
    com_m: [Vector3<f64>; N],
    inertia_kg_m2: [Matrix3<f64>; N],
    angular_rad_per_s: [Vector3<f64>; N],
}

impl<const N: usize> Links<N> {
    /// Returns column `k` of the Jacobian of the centre of mass of link `i`, `k <= i`.
    fn linear(&self, i: usize, k: usize) -> Vector3<f64> {
        self.axis[k].cross(&(self.com_m[i] - self.origin_m[k]))
    }
}

impl<const N: usize> Chain<N> {
    /// Returns the arm at rest at zero, with these rotor inertias at its joints.
    pub fn new(arm: &Arm<N>, armature_kg_m2: Vector<N>) -> Chain<N> {
        let mut chain = Chain {
            links: links_of(arm),
            armature_kg_m2,
            gravity_m_per_s2: arm.gravity(),
            position_rad: Vector::zeros(),
            velocity_rad_per_s: Vector::zeros(),
            poses: [Pose::IDENTITY; N],
        };
        chain.update_poses();
        chain
    }

    /// Sets links and gravity to those of `arm`.
    pub fn set_arm(&mut self, arm: &Arm<N>) {
        self.links = links_of(arm);
        self.gravity_m_per_s2 = arm.gravity();
    }

    /// Sets angles \[rad\] and velocities \[rad/s\].
    pub fn set_state(&mut self, q: &Vector<N>, qd: &Vector<N>) {
        self.position_rad = *q;
        self.velocity_rad_per_s = *qd;
        self.update_poses();
    }

    /// Advances by `dt_s`.
    pub fn step(&mut self, forces: &Forces<'_, N>, dt_s: f64) {
        let acceleration = self.acceleration(forces, dt_s);
        self.velocity_rad_per_s += acceleration * dt_s;
        self.position_rad += self.velocity_rad_per_s * dt_s;
        self.update_poses();
    }

    /// Returns the diagonal of the inverse mass matrix \[1/(kg m^2)\].
    pub fn inverse_inertia(&self) -> Vector<N> {
        let mass = self.mass_matrix(&self.links_in_base());
        let inverse = mass.try_inverse();
        inverse.map_or_else(Vector::zeros, |inverse| inverse.diagonal())
    }

    fn update_poses(&mut self) {
        let mut parent = Pose::IDENTITY;
        for (i, pose) in self.poses.iter_mut().enumerate() {
            let fixed = &self.links[i].parent_from_joint;
            let (sin, cos) = libm::sincos(self.position_rad[i]);
            let at_zero = parent.rotation * fixed.rotation;
            let (x, y) = (at_zero.column(0), at_zero.column(1));
            let rotation = Matrix3::from_columns(&[
                x * cos + y * sin,
                y * cos - x * sin,
                at_zero.column(2).into_owned(),
            ]);
            *pose = Pose {
                rotation,
                translation: parent.rotation * fixed.translation + parent.translation,
            };
            parent = *pose;
        }
    }

    fn links_in_base(&self) -> Links<N> {
        let mut angular = Vector3::zeros();
        let axis = self
            .poses
            .each_ref()
            .map(|pose| pose.rotation.column(2).into_owned());
        Links {
            axis,
            origin_m: self.poses.each_ref().map(|pose| pose.translation),
            com_m: array::from_fn(|i| self.poses[i].transform_point(&self.links[i].com_m)),
            inertia_kg_m2: array::from_fn(|i| {
                let rotation = &self.poses[i].rotation;
                rotation * self.links[i].inertia_kg_m2 * rotation.transpose()
            }),
            angular_rad_per_s: array::from_fn(|i| {
                angular += axis[i] * self.velocity_rad_per_s[i];
                angular
            }),
        }
    }

    fn acceleration(&self, forces: &Forces<'_, N>, dt_s: f64) -> Vector<N> {
        let links = self.links_in_base();
        let velocity = &self.velocity_rad_per_s;
        let damping = forces.damping_nm_s_per_rad;
        let mut mass = Matrix::<N, N>::zeros();
        let mut force = *forces.torque_nm - damping.component_mul(velocity);
        // Velocity products of the last link, and their derivatives with respect to the joint velocities.
        let (mut linear, mut angular) = (Vector3::zeros(), Vector3::zeros());
        let (mut d_linear, mut d_angular) = ([Vector3::zeros(); N], [Vector3::zeros(); N]);
        let (mut parent_com, mut parent_w) = (Vector3::zeros(), Vector3::zeros());
        for i in 0..N {
            let (w, axis) = (links.angular_rad_per_s[i], &links.axis);
            let inertia = &links.inertia_kg_m2[i];
            let m = self.links[i].mass_kg;
            let to_joint = links.origin_m[i] - parent_com;
            let to_com = links.com_m[i] - links.origin_m[i];
            let turning = axis[i] * velocity[i];

            linear += parent_w.cross(&parent_w.cross(&to_joint)) + angular.cross(&to_joint);
            angular += parent_w.cross(&turning);
            linear += w.cross(&w.cross(&to_com)) + angular.cross(&to_com);

            let (w_to_joint, w_to_com) = (w.cross(&to_joint), w.cross(&to_com));
            for k in 0..i {
                d_linear[k] += d_angular[k].cross(&to_joint)
                    + axis[k].cross(&w_to_joint)
                    + parent_w.cross(&axis[k].cross(&to_joint));
                d_angular[k] -= turning.cross(&axis[k]);
            }
            d_angular[i] = parent_w.cross(&axis[i]);
            for k in 0..=i {
                d_linear[k] += d_angular[k].cross(&to_com)
                    + axis[k].cross(&w_to_com)
                    + w.cross(&axis[k].cross(&to_com));
            }

            let momentum = inertia * w;
            let push = (self.gravity_m_per_s2 - linear) * m;
            let turn = -(w.cross(&momentum) + inertia * angular);
            let jacobian: [Vector3<f64>; N] = array::from_fn(|k| match k <= i {
                true => links.linear(i, k),
                false => Vector3::zeros(),
            });
            for l in 0..=i {
                force[l] += jacobian[l].dot(&push) + axis[l].dot(&turn);
                let own = inertia * axis[l];
                let gyroscopic = w.cross(&own) - momentum.cross(&axis[l]);
                let column_linear = (jacobian[l] + d_linear[l] * dt_s) * m;
                let column_angular = own + (inertia * d_angular[l] + gyroscopic) * dt_s;
                for k in 0..=i {
                    mass[(k, l)] += jacobian[k].dot(&column_linear) + axis[k].dot(&column_angular);
                }
            }
            (parent_com, parent_w) = (links.com_m[i], w);
        }
        if *forces.tip != TipForce::default() {
            force += self.tip_torque(&links, forces);
        }
        for i in 0..N {
            mass[(i, i)] += damping[i] * dt_s + self.armature_kg_m2[i];
        }
        let acceleration = solve(mass, force);
        match dt_s * velocity.amax() < UNCHECKED_RAD {
            true => acceleration,
            false => self.checked_acceleration(&links, forces, (acceleration, force), dt_s),
        }
    }

    /// Returns `acceleration`, or the acceleration without the linearised velocity products if `acceleration` adds more energy
    /// than the work of the forces.
    fn checked_acceleration(
        &self,
        links: &Links<N>,
        forces: &Forces<'_, N>,
        (acceleration, force): (Vector<N>, Vector<N>),
        dt_s: f64,
    ) -> Vector<N> {
        let velocity = &self.velocity_rad_per_s;
        let mut mass = self.mass_matrix(links);
        for i in 0..N {
            mass[(i, i)] += forces.damping_nm_s_per_rad[i] * dt_s;
        }
        let mut applied = forces.torque_nm + self.tip_torque(links, forces);
        for i in 0..N {
            let weight = self.gravity_m_per_s2 * self.links[i].mass_kg;
            for k in 0..=i {
                applied[k] += links.linear(i, k).dot(&weight);
            }
        }
        let inertial = mass * acceleration;
        let gained =
            dt_s * velocity.dot(&inertial) + 0.5 * dt_s * dt_s * acceleration.dot(&inertial);
        let work = dt_s * velocity.dot(&force) + 0.5 * dt_s * dt_s * acceleration.dot(&applied);
        let kinetic = 0.5 * velocity.dot(&(mass * velocity));
        if gained - work <= 1e-2 * kinetic + 1e-8 {
            return acceleration;
        }
        solve(mass, force)
    }

    /// Returns the joint torques of the force on the tip.
    fn tip_torque(&self, links: &Links<N>, forces: &Forces<'_, N>) -> Vector<N> {
        let TipForce {
            force_n, moment_nm, ..
        } = forces.tip;
        Vector::from_fn(|k, _| {
            let lever = forces.tip_center_m - links.origin_m[k];
            links.axis[k].dot(&(lever.cross(force_n) + moment_nm))
        })
    }

    fn mass_matrix(&self, links: &Links<N>) -> Matrix<N, N> {
        let mut mass = Matrix::from_diagonal(&self.armature_kg_m2);
        for i in 0..N {
            for l in 0..=i {
                let linear = links.linear(i, l) * self.links[i].mass_kg;
                let angular = links.inertia_kg_m2[i] * links.axis[l];
                for k in 0..=i {
                    mass[(k, l)] += links.linear(i, k).dot(&linear) + links.axis[k].dot(&angular);
                }
            }
        }
        mass
    }
}

/// Solves `a x = b` by elimination with row pivoting; `a` is a mass matrix or close to one, so that no pivot is zero.
fn solve<const N: usize>(mut a: Matrix<N, N>, mut b: Vector<N>) -> Vector<N> {
    for k in 0..N {
        let pivot = (k + 1..N).fold(k, |best, row| {
            if a[(row, k)].abs() > a[(best, k)].abs() {
                row
            } else {
                best
            }
        });
        a.swap_rows(k, pivot);
        b.swap_rows(k, pivot);
        for row in k + 1..N {
            let factor = a[(row, k)] / a[(k, k)];
            for column in k + 1..N {
                a[(row, column)] -= factor * a[(k, column)];
            }
            b[row] -= factor * b[k];
        }
    }
    for k in (0..N).rev() {
        let known: f64 = (k + 1..N).map(|column| a[(k, column)] * b[column]).sum();
        b[k] = (b[k] - known) / a[(k, k)];
    }
    b
}

fn links_of<const N: usize>(arm: &Arm<N>) -> [ChainLink; N] {
    array::from_fn(|i| {
        let body = arm.body(i);
        ChainLink {
            parent_from_joint: arm.parent_from_joint(i),
            mass_kg: body.mass_kg,
            com_m: body.com_m,
            inertia_kg_m2: body.inertia_kg_m2,
        }
    })
}
