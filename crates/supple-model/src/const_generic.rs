//! Converts a description, whose number of joints is dynamic, to the types of the core.

use crate::bounds::first_out_of_range;
use crate::description::Description;
use crate::error::{ModelError, Reporter};
use crate::settings::FrictionVelocity;
use supple_core::config::{
    self, ApparentInertia, Collision, ContactLatch, Gains, JointGains, JointNames, Law, Limits,
    PlausibilityLimits, PoseLaw, Role, RotationalGains,
};
use supple_core::controller::ConfigError;
use supple_core::math::{Matrix3, Vector3};
use supple_core::{Arm, Body, Config, Controller, Friction, Joint, Matrix, Pose, Vector};

/// Default stiffness of the joint impedance mode as a fraction of the stiffness of the move mode.
const DEFAULT_IMPEDANCE_STIFFNESS: f64 = 0.02;
/// Default damping of the joint impedance mode as a fraction of the damping of the move mode.
const DEFAULT_IMPEDANCE_DAMPING: f64 = 0.1;
/// Default collision threshold as a fraction of the joint's torque limit.
const DEFAULT_COLLISION_FRACTION: f64 = 0.3;

/// The parts of an [`Arm`], which may be modified before building, for models with a known deviation from the arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parts<const N: usize> {
    /// Joints with their links.
    pub joints: [Joint; N],
    /// Tip frame in the last link's frame.
    pub last_link_from_tip: Pose,
    /// Tool, in the tip frame.
    pub tool: Option<Body>,
    /// Gravitational acceleration in root link axes \[m/s^2\].
    pub gravity_m_per_s2: Vector3<f64>,
}

impl<const N: usize> Parts<N> {
    /// Builds the arm from these parts.
    ///
    /// # Errors
    /// Errors of the constructor of [`Arm`].
    pub fn build(&self) -> Result<Arm<N>, supple_core::ArmError> {
        Arm::new(
            &self.joints,
            self.last_link_from_tip,
            self.tool,
            self.gravity_m_per_s2,
        )
    }
}

impl Description {
    /// Returns the parts of the arm, including the tool.
    ///
    /// # Errors
    /// [`ModelError::JointCount`] if the arm does not have `N` moving joints.
    pub fn parts<const N: usize>(&self) -> Result<Parts<N>, ModelError> {
        self.expect_dof(N)?;
        Ok(Parts {
            joints: core::array::from_fn(|i| {
                let moving = &self.chain.moving[i];
                Joint {
                    parent_from_link: moving.parent_from_link,
                    axis: moving.axis,
                    body: moving.body,
                    armature_kg_m2: self.joints[i].armature_kg_m2,
                }
            }),
            last_link_from_tip: self.chain.last_link_from_tip,
            tool: self.tool().and_then(|tool| tool.body),
            gravity_m_per_s2: Vector3::from(self.settings.gravity_m_per_s2),
        })
    }

    /// Returns the arm with its tool.
    ///
    /// # Errors
    /// [`ModelError::JointCount`] if the arm does not have `N` moving joints.
    pub fn arm<const N: usize>(&self) -> Result<Arm<N>, ModelError> {
        self.parts::<N>()?.build().map_err(|error| ModelError::Arm {
            file: self.toml_file.clone(),
            error,
        })
    }

    /// Returns the home pose \[rad\].
    ///
    /// # Errors
    /// [`ModelError::JointCount`] if the arm does not have `N` moving joints.
    pub fn home<const N: usize>(&self) -> Result<Vector<N>, ModelError> {
        self.expect_dof(N)?;
        Ok(Vector::from_column_slice(self.home_rad()))
    }

    /// Returns the controller configuration of this arm. Settings that are missing in its files have placeholder values;
    /// a controller needs the values of [`Description::completed`].
    ///
    /// # Errors
    /// [`ModelError::JointCount`] if the arm does not have `N` moving joints; [`ModelError::Invalid`] for values that
    /// [`supple_core::Controller::new`] rejects, such as fewer than three joints that the law controls.
    pub fn config<const N: usize>(&self) -> Result<Config<N>, ModelError> {
        let arm = self.arm::<N>()?;
        let settings = &self.settings;
        let gain = |of: fn(&crate::settings::JointSettings) -> f64| {
            Vector::<N>::from_fn(|i, _| of(&self.joints[i].gains))
        };
        let friction: [Friction; N] = core::array::from_fn(|i| self.joints[i].friction);
        let config = Config {
            joint_names: JointNames::new(self.joint_names()),
            arm,
            friction,
            roles: core::array::from_fn(|i| match self.joints[i].held {
                None => Role::Active,
                Some(held) => Role::Held {
                    position_rad: held.position_rad,
                    stiffness_nm_per_rad: held.stiffness_nm_per_rad,
                    damping_nm_s_per_rad: held.damping_nm_s_per_rad,
                },
            }),
            joint_from_motor: Matrix::<N, N>::from_fn(|i, j| {
                self.motors().joint_from_motor[(i, j)]
            }),
            ripple: core::array::from_fn(|m| self.motors().ripple[m]),
            learned: self.learned()?,
            compliance_rad_per_nm: gain(|joint| joint.compliance_rad_per_nm),
            period_s: settings.period_s,
            estimator_rad_per_s: settings.estimator_rad_per_s,
            law: self.law(),
            latch: self.latch(),
            move_gains: JointGains {
                stiffness_nm_per_rad: gain(|joint| joint.move_stiffness_nm_per_rad),
                damping_nm_s_per_rad: gain(|joint| joint.move_damping_nm_s_per_rad),
            },
            joint_gains: JointGains {
                stiffness_nm_per_rad: gain(|joint| {
                    let default = DEFAULT_IMPEDANCE_STIFFNESS * joint.move_stiffness_nm_per_rad;
                    joint.impedance_stiffness_nm_per_rad.unwrap_or(default)
                }),
                damping_nm_s_per_rad: gain(|joint| {
                    let default = DEFAULT_IMPEDANCE_DAMPING * joint.move_damping_nm_s_per_rad;
                    joint.impedance_damping_nm_s_per_rad.unwrap_or(default)
                }),
            },
            pose: PoseLaw {
                gains: RotationalGains {
                    stiffness_nm_per_rad: Vector3::from(settings.pose.stiffness_nm_per_rad),
                    damping_nm_s_per_rad: Vector3::from(settings.pose.damping_nm_s_per_rad),
                },
                max_stiffness_nm_per_rad: settings.pose.max_stiffness_nm_per_rad,
                max_damping_nm_s_per_rad: settings.pose.max_damping_nm_s_per_rad,
                angular_speed_rad_per_s: settings.pose.angular_speed_rad_per_s,
                rotation_error_rad: settings.pose.rotation_error_rad,
                posture_stiffness_nm_per_rad: gain(|joint| joint.posture_stiffness_nm_per_rad),
                posture_torque_nm: gain(|joint| joint.posture_torque_nm),
            },
            float_friction_share: settings.float.friction_share,
            hold_damping_nm_s_per_rad: gain(|joint| joint.hold_damping_nm_s_per_rad),
            hold_pose: settings.hold_pose,
            handover_s: settings.handover_s,
            limits: Limits {
                position_lower_rad: Vector::from_fn(|i, _| self.joints[i].position_lower_rad),
                position_upper_rad: Vector::from_fn(|i, _| self.joints[i].position_upper_rad),
                soft_zone_rad: settings.limits.soft_zone_rad,
                soft_stiffness_nm_per_rad: gain(|joint| joint.soft_stiffness_nm_per_rad),
                soft_damping_nm_s_per_rad: gain(|joint| joint.soft_damping_nm_s_per_rad),
                joint_speed_rad_per_s: Vector::from_fn(|i, _| self.joints[i].speed_rad_per_s),
                tip_speed_m_per_s: settings.limits.tip_speed_m_per_s,
                tip_acceleration_m_per_s2: settings.limits.tip_acceleration_m_per_s2,
                joint_acceleration_rad_per_s2: gain(|joint| joint.acceleration_rad_per_s2),
                joint_jerk_rad_per_s3: gain(|joint| joint.jerk_rad_per_s3),
                tracking_error_m: settings.limits.tracking_error_m,
                joint_tracking_error_rad: settings.limits.joint_tracking_error_rad,
                joint_torque_nm: Vector::from_fn(|i, _| self.joints[i].torque_nm),
                motor_torque_nm: Vector::from_column_slice(&self.motors().torque_nm),
                torque_rate_nm_per_s: gain(|joint| joint.torque_rate_nm_per_s),
                stale_cycles: settings.limits.stale_cycles,
                start_error_m: settings.limits.start_error_m,
                stiffness_n_per_m: settings.limits.max_stiffness_n_per_m,
                damping_n_s_per_m: settings.limits.max_damping_n_s_per_m,
            },
            collision: Collision {
                joint_torque_nm: Vector::from_fn(|i, _| self.collision_torque_nm(i)),
                tip_force_n: settings.collision.tip_force_n,
                move_joint_torque_nm: Vector::from_fn(|i, _| {
                    let given = self.joints[i].gains.move_collision_torque_nm;
                    given.unwrap_or(settings.collision.move_share * self.collision_torque_nm(i))
                }),
                move_tip_force_n: settings.collision.move_share * settings.collision.tip_force_n,
            },
            plausible: PlausibilityLimits {
                lost_replies: settings.plausible.lost_replies,
                stuck_rad: settings.plausible.stuck_rad,
                stiction_factor: settings.plausible.stiction_factor,
                against_share: settings.plausible.against_share,
                load_n: settings.plausible.load_n,
            },
            workspace: self.workspace()?,
        };
        Controller::new(config).map_err(|error| self.rejected(&error))?;
        if let Some(error) = first_out_of_range(&config) {
            return Err(self.rejected(&error));
        }
        Ok(config)
    }

    fn collision_torque_nm(&self, joint: usize) -> f64 {
        let joint = &self.joints[joint];
        let given = joint.gains.collision_torque_nm;
        given.unwrap_or(DEFAULT_COLLISION_FRACTION * joint.torque_nm)
    }

    pub(crate) fn rejected(&self, error: &ConfigError) -> ModelError {
        let joint = error.joint.and_then(|i| self.joint_names().get(i));
        let element = joint.map_or_else(
            || error.entry.to_owned(),
            |name| format!("{} of joint `{name}`", error.entry),
        );
        let report = Reporter {
            file: &self.toml_file,
        };
        report.invalid(
            element,
            format!("must be {}", error.must),
            error.value,
            "correct it in the TOML",
        )
    }

    fn law(&self) -> Law {
        let law = &self.settings.law;
        Law {
            gains: Gains {
                stiffness_n_per_m: Vector3::from(law.stiffness_n_per_m),
                damping_n_s_per_m: Vector3::from(law.damping_n_s_per_m),
            },
            inertia: match law.apparent_inertia_kg {
                None => ApparentInertia::Own,
                Some(rows) => ApparentInertia::Chosen(Matrix3::from_fn(|i, j| rows[i][j])),
            },
            friction_velocity: match law.friction_velocity {
                FrictionVelocity::Reference => config::FrictionVelocity::Reference,
                FrictionVelocity::Measured => config::FrictionVelocity::Measured,
            },
            measured_stribeck: law.measured_stribeck,
            presliding_share: law.presliding_share,
            inertial_feedforward: law.inertial_feedforward,
            nullspace_damping_nm_s_per_rad: law.nullspace_damping_nm_s_per_rad,
        }
    }

    fn latch(&self) -> ContactLatch {
        let latch = &self.settings.latch;
        ContactLatch {
            fade: latch.fade,
            observer_rad_per_s: latch.observer_rad_per_s,
            threshold_n: latch.threshold_n,
            friction_error: latch.friction_error,
            contact_share: latch.contact_share,
            reversal_s: latch.reversal_s,
            fade_s: latch.fade_s,
            restore_s: latch.restore_s,
            settle_s: latch.settle_s,
            hold_friction: latch.hold_friction,
            false_alarms_per_hour: latch.false_alarms_per_hour,
            release_s: latch.release_s,
        }
    }
}
