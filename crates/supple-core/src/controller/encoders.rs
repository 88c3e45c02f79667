//! Coupling between encoders and joints. The encoders are on the motors: a stuck encoder gives wrong angles of all joints that
//! its motor drives.

use crate::config::Config;
use crate::math::{Matrix, Vector, abs};

/// Dry friction that may hold a motor at rest, as a multiple of the modelled dry friction.
const DRY_FRICTION_RATIO: f64 = 1.5;
/// Error of the model at rest, as a fraction of a motor's torque limit.
const MODEL_ERROR_SHARE: f64 = 0.02;

/// Angles of the encoders, each in radians of the joint that turns its motor most.
#[derive(Clone, Copy, Debug)]
pub struct Encoders<const N: usize> {
    from_joint: Matrix<N, N>,
    /// Whether a motor drives more than one joint.
    coupled: bool,
    /// The joint that turns the motor of each encoder most.
    joint: [usize; N],
    /// Whether a motor (second index) drives a joint.
    drives: [[bool; N]; N],
    /// Joint angles from encoder angles.
    to_joint: Matrix<N, N>,
}

/// Effect of one resolution step of an encoder on the estimates.
#[derive(Clone, Copy, Debug)]
pub(super) struct EncoderStep {
    /// Change of the observed torque per step angle, for an inertia of 1 kg m^2 \[N m/(rad kg m^2)\].
    pub observed_per_s2: f64,
    /// Time for which the step affects the observed torque \[s\].
    pub lasts_s: f64,
}

impl EncoderStep {
    /// Computes the effect from the bandwidths of the velocity estimate and of the observer.
    pub fn new(estimator_rad_per_s: f64, observer_rad_per_s: f64) -> EncoderStep {
        // Peak of the estimated velocity over the step, at `1 / omega` after it.
        let velocity_per_s = estimator_rad_per_s / core::f64::consts::E;
        EncoderStep {
            observed_per_s2: velocity_per_s * observer_rad_per_s,
            lasts_s: 5.0 / estimator_rad_per_s + 2.0 / observer_rad_per_s,
        }
    }
}

impl<const N: usize> Encoders<N> {
    pub(super) fn new(joint_from_motor: &Matrix<N, N>, motor_from_joint: &Matrix<N, N>) -> Self {
        let drives = core::array::from_fn(|joint| {
            core::array::from_fn(|motor| joint_from_motor[(joint, motor)] != 0.0)
        });
        let coupled = (0..N).any(|motor| {
            let driven = drives.iter().filter(|of: &&[bool; N]| of[motor]);
            driven.count() > 1
        });
        if !coupled {
            // Each joint has its own motor; the order of the motors does not matter.
            return Encoders {
                from_joint: Matrix::identity(),
                coupled,
                joint: core::array::from_fn(|i| i),
                drives: core::array::from_fn(|joint| core::array::from_fn(|i| i == joint)),
                to_joint: Matrix::identity(),
            };
        }
        let joint: [usize; N] =
            core::array::from_fn(|motor| motor_from_joint.row(motor).transpose().icamax());
        Encoders {
            from_joint: Matrix::from_fn(|motor, i| {
                motor_from_joint[(motor, i)] / motor_from_joint[(motor, joint[motor])]
            }),
            to_joint: Matrix::from_fn(|i, motor| {
                joint_from_motor[(i, motor)] * motor_from_joint[(motor, joint[motor])]
            }),
            coupled,
            joint,
            drives,
        }
    }

    /// Returns angles or speeds of the encoders from those of the joints.
    pub(super) fn values_of(&self, joints: &Vector<N>) -> Vector<N> {
        if self.coupled {
            self.from_joint * joints
        } else {
            *joints
        }
    }

    /// Returns the angle or speed of one encoder from those of the joints.
    pub(super) fn value_at(&self, encoder: usize, joints: &Vector<N>) -> f64 {
        (self.from_joint.row(encoder) * joints)[0]
    }

    /// Returns the torque on the motor of an encoder that is equivalent to the joint torques (equal virtual work) \[N m\].
    pub(super) fn torque_at(&self, encoder: usize, joints_nm: &Vector<N>) -> f64 {
        self.to_joint.column(encoder).dot(joints_nm)
    }

    /// Returns the inertia at the motor of an encoder for the mass matrix of the joints \[kg m^2\].
    pub(super) fn inertia_at(&self, encoder: usize, mass_matrix: &Matrix<N, N>) -> f64 {
        let joints = self.to_joint.column(encoder);
        joints.dot(&(mass_matrix * joints))
    }

    /// Returns the external torque on the motor of each encoder (see [`Encoders::torque_at`]) above which dry friction does not
    /// hold the motor \[N m\], with a margin for errors of the model.
    pub(super) fn stiction_limit_nm(
        &self,
        config: &Config<N>,
        motor_from_joint: &Matrix<N, N>,
    ) -> Vector<N> {
        let dry_nm = Vector::from_fn(|joint, _| config.friction[joint].dry_size_nm(0.0));
        let limits = &config.limits;
        Vector::from_fn(|encoder, _| {
            let joint = self.joint[encoder];
            let limit_nm = match self.coupled {
                true => limits.motor_torque_nm[encoder] * abs(motor_from_joint[(encoder, joint)]),
                false => limits.joint_torque_nm[joint],
            };
            let dry_nm = self.to_joint.column(encoder).abs().dot(&dry_nm);
            let held_nm = DRY_FRICTION_RATIO * dry_nm + MODEL_ERROR_SHARE * limit_nm;
            config.plausible.stiction_factor * held_nm
        })
    }

    /// Returns the joint that turns the motor of an encoder most.
    pub(super) fn joint(&self, encoder: usize) -> usize {
        self.joint[encoder]
    }

    /// Returns the encoders of the motors that drive a joint.
    pub(super) fn of(&self, joint: usize) -> impl Iterator<Item = usize> {
        let drives = self.drives[joint];
        (0..N).filter(move |encoder| drives[*encoder])
    }
}
