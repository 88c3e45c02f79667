//! The track pose mode: reference of the tip's position and orientation, the task in six directions, and its torques.
//!
//! Other modes compute none of this, and it is not compiled for arms with fewer than six joints.

use super::activity::Activity;
use super::checks::DAMPING_MARGIN;
use super::fault::Fault;
use super::state::State;
use super::{Controller, checks};
use crate::config::{Config, Gains, RotationalGains};
use crate::law::impedance::{LawInput, Task, Torques, impedance};
use crate::law::target::{PoseReference, PoseTarget, Posture};
use crate::math::{Matrix, Matrix3, Vector, Vector3, sqrt};
use crate::model::pose::{Pose, rotation_vector};
use crate::trajectory::{OrientationReference, Reference, Rotation};

/// Directions of the task.
pub(super) const DIRECTIONS: usize = 6;

/// Reference, task and error of a cycle in the track pose mode, from which its torques are computed.
pub(super) struct PoseCycle<const N: usize> {
    reference: PoseReference,
    task: Task<N, DIRECTIONS>,
    /// Velocity of the active joints at which the tip moves like its reference \[rad/s\].
    pub joint_velocity_rad_per_s: Vector<N>,
    /// Axis times angle from the tip to its reference \[rad\].
    pub error_rad: Vector3<f64>,
}

impl<const N: usize> PoseCycle<N> {
    /// Returns the reference of the tip's orientation.
    pub fn base_from_tip(&self) -> Matrix3<f64> {
        self.reference.base_from_tip.rotation
    }
}

/// Combines the references of position and orientation.
pub(super) fn pose_reference(
    position: &Reference,
    orientation: &OrientationReference,
) -> PoseReference {
    PoseReference {
        base_from_tip: Pose {
            rotation: orientation.base_from_tip,
            translation: position.position,
        },
        velocity_m_per_s: position.velocity,
        angular_velocity_rad_per_s: orientation.velocity_rad_per_s,
        acceleration_m_per_s2: position.acceleration,
        angular_acceleration_rad_per_s2: orientation.acceleration_rad_per_s2,
    }
}

impl<const N: usize> State<N> {
    /// Returns the checked reference and task of the track pose mode; `None` in other modes.
    #[inline(always)]
    pub(super) fn pose_cycle(
        &self,
        config: &Config<N>,
        reference: Option<&Reference>,
    ) -> Result<Option<PoseCycle<N>>, Fault> {
        if const { N >= DIRECTIONS }
            && let (
                Activity::TrackPose {
                    rotation,
                    from_base_from_tip,
                    ..
                },
                Some(reference),
            ) = (&self.activity, reference)
        {
            return self
                .pose_task(config, reference, rotation, from_base_from_tip)
                .map(Some);
        }
        Ok(None)
    }

    #[inline(never)]
    fn pose_task(
        &self,
        config: &Config<N>,
        reference: &Reference,
        rotation: &Rotation,
        from_base_from_tip: &Matrix3<f64>,
    ) -> Result<PoseCycle<N>, Fault> {
        let orientation = rotation.at(from_base_from_tip, self.activity_s(config));
        let found = &self.terms.base_from_tip.rotation;
        let error_rad = rotation_vector(&(orientation.base_from_tip * found.transpose()));
        checks::rotation(config.pose.rotation_error_rad, &error_rad)?;
        let task = Task::of_pose(&self.terms, &config.roles).ok_or(Fault::MassMatrix)?;
        if task.is_damped {
            return Err(Fault::Singular);
        }
        let reference = pose_reference(reference, &orientation);
        Ok(PoseCycle {
            joint_velocity_rad_per_s: task.inverse * reference.velocity(),
            task,
            error_rad,
            reference,
        })
    }

    /// Returns the reference orientation of the tip; in modes without one, the orientation of the tip.
    pub(super) fn reference_orientation(&self, config: &Config<N>) -> Matrix3<f64> {
        match &self.activity {
            Activity::TrackPose {
                rotation,
                from_base_from_tip,
                ..
            } => {
                let orientation = rotation.at(from_base_from_tip, self.activity_s(config));
                orientation.base_from_tip
            }
            _ => self.terms.base_from_tip.rotation,
        }
    }

    /// Advances the gain ramps of the track pose mode; arms with fewer than six joints have none.
    #[inline(always)]
    pub(super) fn advance_pose_gains(&mut self, elapsed_s: f64) {
        if const { N >= DIRECTIONS } {
            self.pose_gains.advance(elapsed_s);
        }
    }

    /// Returns the diagonals of the rotational gain matrices in force. Arms with fewer than six joints have no track pose mode,
    /// and report the configured gains.
    #[inline(always)]
    pub(super) fn rotational_gains(&self, config: &Config<N>) -> RotationalGains {
        match const { N >= DIRECTIONS } {
            true => self.pose_gains.rotational_diagonal(),
            false => config.pose.gains,
        }
    }

    /// Returns the gains of the tip's position in force; in the track pose mode the diagonals of its matrices.
    #[inline(always)]
    pub(super) fn tip_gains(&self) -> Gains {
        if const { N >= DIRECTIONS } && matches!(self.activity, Activity::TrackPose { .. }) {
            return self.pose_gains.linear_diagonal();
        }
        self.gains.current()
    }

    /// Returns the maximum mobility of the null space \[1/(kg m^2)\]. It is large if the axes of the wrist align, because its
    /// joints can then turn against each other with little inertia. It is exact for a null space of one dimension.
    fn nullspace_mobility(&self, task: &Task<N, DIRECTIONS>) -> f64 {
        let free = Matrix::<N, N>::identity() - task.inverse * task.jacobian;
        let inertia = self.terms.mass_matrix * free;
        (0..N)
            .map(|joint| {
                let motion = free.column(joint);
                motion.norm_squared() / motion.dot(&inertia.column(joint))
            })
            .fold(0.0, f64::max)
    }

    /// Returns the torques of the pose law: linear and rotational gains, and damping and posture in the null space. If the
    /// loop's delay does not allow that much null-space damping, damping and posture are reduced together.
    #[inline(never)]
    pub(super) fn pose_torques(
        &self,
        controller: &Controller<N>,
        pose: &PoseCycle<N>,
    ) -> Torques<N> {
        let config = controller.config();
        let Activity::TrackPose { posture_rad, .. } = &self.activity else {
            return self.safe_torques(controller);
        };
        let mut gains = self.pose_gains.in_base(&pose.base_from_tip());
        let tip = self.terms.base_from_tip.translation;
        let limit_n = config.workspace.spring_limit_n(&tip);
        let pull = gains.stiffness_n_per_m * (pose.reference.base_from_tip.translation - tip);
        let pull_n2 = pull.dot(&pull);
        if pull_n2 > limit_n * limit_n {
            gains.stiffness_n_per_m *= limit_n / sqrt(pull_n2);
        }
        let posture = Posture {
            position_rad: *posture_rad,
            stiffness_nm_per_rad: config.pose.posture_stiffness_nm_per_rad,
            max_torque_nm: config.pose.posture_torque_nm,
        };
        let target = PoseTarget {
            reference: &pose.reference,
            gains: &gains,
        };
        let law = &config.law;
        let damping = law.nullspace_damping_nm_s_per_rad;
        let share = (DAMPING_MARGIN
            / (damping * self.nullspace_mobility(&pose.task) * controller.delay_s()))
        .min(1.0);
        let law_input = LawInput {
            friction: Some((&self.friction, law.friction_velocity)),
            stribeck_velocity_rad_per_s: self.stribeck_velocity(config),
            friction_share: self.latch.friction_share(),
            held_friction: self.held_friction(config),
            inertial_feedforward: law.inertial_feedforward,
            nullspace_damping_nm_s_per_rad: Vector::repeat(damping * share),
            nullspace_torque_nm: Some(&(posture.torque_nm(&self.position) * share)),
            ..LawInput::new(target, &self.estimator.velocity_rad_per_s)
        };
        impedance(&config.roles, &self.terms, &pose.task, &law_input)
    }
}
