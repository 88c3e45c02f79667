//! Friction of all joints and motors: bristle states, loads of the joints, variation.

use crate::config::PlantConfig;
use crate::friction::LuGre;
use crate::friction_variation::{FrictionScale, FrictionVariation};
use supple_core::nalgebra::Vector3;
use supple_core::{Arm, Matrix, Pose, Vector};

/// Friction with its state.
#[derive(Clone, Debug)]
pub(crate) struct JointFrictions<const N: usize> {
    joints: [LuGre; N],
    motors: Option<[LuGre; N]>,
    variation: Option<FrictionVariation<N>>,
    motor_from_joint: Matrix<N, N>,
    joint_bristles_rad: [f64; N],
    motor_bristles_rad: [f64; N],
    load: Option<Load<N>>,
}

impl<const N: usize> JointFrictions<N> {
    /// Returns the relaxed bristles.
    pub fn new(config: &PlantConfig<N>, motor_from_joint: Matrix<N, N>) -> JointFrictions<N> {
        let loaded = config.friction.iter().any(|f| f.load_fraction > 0.0);
        let at_motors = config.motor_friction != [LuGre::NONE; N];
        let varies = config.friction_variation != FrictionVariation::none();
        JointFrictions {
            joints: config.friction,
            motors: at_motors.then_some(config.motor_friction),
            variation: varies.then(|| config.friction_variation.clone()),
            motor_from_joint,
            joint_bristles_rad: [0.0; N],
            motor_bristles_rad: [0.0; N],
            load: loaded.then(|| Load::new(&config.arm)),
        }
    }

    /// Updates the loads for an arm with another payload or another gravity.
    pub fn set_arm(&mut self, arm: &Arm<N>) {
        if let Some(load) = &mut self.load {
            *load = Load::new(arm);
        }
    }

    /// Relaxes all bristles.
    pub fn reset(&mut self) {
        self.joint_bristles_rad = [0.0; N];
        self.motor_bristles_rad = [0.0; N];
    }

    /// Advances the friction of the joints by `dt_s` while the motors transmit `motor_nm`; returns their torque, positive
    /// against positive motion \[N m\].
    pub fn joints_nm(
        &mut self,
        (q, qd): (&Vector<N>, &Vector<N>),
        motor_nm: &Vector<N>,
        poses: &[Pose; N],
        time_s: f64,
        dt_s: f64,
    ) -> Vector<N> {
        let load = match &self.load {
            Some(load) => load.relative(poses),
            None => Vector::zeros(),
        };
        let Some(variation) = &self.variation else {
            return Vector::from_fn(|i, _| {
                let bristle = &mut self.joint_bristles_rad[i];
                self.joints[i].advance(bristle, qd[i], load[i], dt_s)
            });
        };
        let warm = variation.warm_up(time_s);
        Vector::from_fn(|i, _| {
            let friction = &self.joints[i];
            let speed = qd[i] / friction.stribeck_rad_per_s;
            let geared = match friction.coulomb_nm > 0.0 {
                true => variation.gear_fraction * motor_nm[i].abs() / friction.coulomb_nm,
                false => 0.0,
            };
            let varied = variation.factor(i, q[i], speed);
            let scale = FrictionScale {
                dry: warm.dry * (varied + geared),
                viscous: warm.viscous * varied * variation.viscous_load_factor(load[i], speed),
            };
            let bristle = &mut self.joint_bristles_rad[i];
            friction.advance_scaled(bristle, qd[i], load[i], scale, dt_s)
        })
    }

    /// Advances the friction of the motors by `dt_s`; returns its torque at the joints, positive against positive motion
    /// \[N m\]. `qd` are the motors' velocities seen at the joints. `None` without friction at the motors.
    pub fn motors_nm(&mut self, qd: &Vector<N>, time_s: f64, dt_s: f64) -> Option<Vector<N>> {
        let motors = self.motors.as_ref()?;
        let variation = self.variation.as_ref();
        let warm = variation.map_or(FrictionScale::ONE, |v| v.warm_up(time_s));
        let speed = self.motor_from_joint * qd;
        let at_motors = Vector::from_fn(|i, _| {
            let bristle = &mut self.motor_bristles_rad[i];
            motors[i].advance_scaled(bristle, speed[i], 0.0, warm, dt_s)
        });
        Some(self.motor_from_joint.transpose() * at_motors)
    }
}

/// Gravity moments on the joints, relative to those of the horizontally stretched arm.
#[derive(Clone, Debug)]
pub(crate) struct Load<const N: usize> {
    mass_kg: [f64; N],
    com_m: [Vector3<f64>; N],
    gravity_m_per_s2: Vector3<f64>,
    bound_nm: Vector<N>,
}

impl<const N: usize> Load<N> {
    pub fn new(arm: &Arm<N>) -> Load<N> {
        let bodies: [_; N] = core::array::from_fn(|i| arm.body(i));
        Load {
            mass_kg: bodies.each_ref().map(|body| body.mass_kg),
            com_m: bodies.each_ref().map(|body| body.com_m),
            gravity_m_per_s2: arm.gravity(),
            bound_nm: load_bound(arm),
        }
    }

    /// Returns the load of each joint, 0 to 1, with the joint frames `poses`.
    pub fn relative(&self, poses: &[Pose; N]) -> Vector<N> {
        let mut load = Vector::zeros();
        let (mut mass, mut moment) = (0.0, Vector3::zeros());
        for j in (0..N).rev() {
            let own = self.mass_kg[j];
            mass += own;
            moment += poses[j].transform_point(&self.com_m[j]) * own;
            let first_moment = moment - poses[j].translation * mass;
            let gravity_moment = first_moment.cross(&self.gravity_m_per_s2);
            if self.bound_nm[j] > 0.0 {
                load[j] = libm::sqrt(gravity_moment.dot(&gravity_moment)) / self.bound_nm[j];
            }
        }
        load
    }
}

/// Returns the moment on each joint if all links beyond it formed a horizontal line: mass times gravity times the length of
/// the chain.
fn load_bound<const N: usize>(arm: &Arm<N>) -> Vector<N> {
    let gravity = libm::sqrt(arm.gravity().dot(&arm.gravity()));
    Vector::from_fn(|j, _| {
        let (mut length, mut moment) = (0.0, 0.0);
        for k in j..N {
            if k > j {
                length += arm.parent_from_joint(k).translation.norm();
            }
            let body = arm.body(k);
            moment += body.mass_kg * gravity * (length + body.com_m.norm());
        }
        moment
    })
}
