//! Configuration of a controller as plain data. [`crate::Controller::new`] validates it, so a
//! `Controller` always has a valid configuration.

use crate::math::{Matrix, Matrix3, Vector, Vector3};
use crate::model::arm::Arm;
use crate::model::friction::Friction;
use crate::model::learned::LearnedTerms;
pub use crate::model::ripple::RippleTable;
pub use crate::model::workspace::{Border, Workspace, Zone};
use crate::record::Text;

/// Names of the joints in messages, as in the URDF; a joint with an empty name is written by its index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JointNames<const N: usize>([Text; N]);

impl<const N: usize> JointNames<N> {
    /// No names: messages contain the index of each joint, from 0.
    pub const NONE: JointNames<N> = JointNames([Text::EMPTY; N]);

    /// Takes the names in order; further joints have no name.
    pub fn new<S: AsRef<str>>(names: &[S]) -> JointNames<N> {
        JointNames(core::array::from_fn(|i| {
            names
                .get(i)
                .map_or(Text::EMPTY, |name| Text::from_display(&name.as_ref()))
        }))
    }

    /// Returns the names.
    pub fn as_slice(&self) -> &[Text] {
        &self.0
    }
}

/// Role of a joint while the impedance law runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Role {
    /// The law acts on it.
    Active,
    /// Held at an angle by a stiff proportional-derivative loop with model feed-forward.
    Held {
        /// Angle \[rad\].
        position_rad: f64,
        /// Proportional gain \[N m/rad\], positive.
        stiffness_nm_per_rad: f64,
        /// Derivative gain \[N m s/rad\], zero or more.
        damping_nm_s_per_rad: f64,
    },
}

/// Cartesian impedance of Eq. (3.3), diagonal in base axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gains {
    /// `K`, one per base axis \[N/m\], zero or more.
    pub stiffness_n_per_m: Vector3<f64>,
    /// `B`, one per base axis \[N s/m\], zero or more.
    pub damping_n_s_per_m: Vector3<f64>,
}

impl Gains {
    /// Returns the same stiffness \[N/m\] and damping \[N s/m\] along every axis.
    pub fn isotropic(stiffness_n_per_m: f64, damping_n_s_per_m: f64) -> Gains {
        Gains {
            stiffness_n_per_m: Vector3::repeat(stiffness_n_per_m),
            damping_n_s_per_m: Vector3::repeat(damping_n_s_per_m),
        }
    }
}

/// Stiffness and damping of the tip's orientation, diagonal in base axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RotationalGains {
    /// Stiffness about each base axis \[N m/rad\], zero or more.
    pub stiffness_nm_per_rad: Vector3<f64>,
    /// Damping about each base axis \[N m s/rad\], zero or more.
    pub damping_nm_s_per_rad: Vector3<f64>,
}

impl RotationalGains {
    /// Returns the same stiffness \[N m/rad\] and damping \[N m s/rad\] about every axis.
    pub fn isotropic(stiffness_nm_per_rad: f64, damping_nm_s_per_rad: f64) -> RotationalGains {
        RotationalGains {
            stiffness_nm_per_rad: Vector3::repeat(stiffness_nm_per_rad),
            damping_nm_s_per_rad: Vector3::repeat(damping_nm_s_per_rad),
        }
    }
}

/// Parameters of the track pose mode, in addition to those of the [`Law`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseLaw<const N: usize> {
    /// Initial gains of the orientation; requests can change them, by ramps.
    pub gains: RotationalGains,
    /// Maximum rotational stiffness that may be requested \[N m/rad\], positive.
    pub max_stiffness_nm_per_rad: f64,
    /// Maximum rotational damping that may be requested \[N m s/rad\], positive.
    pub max_damping_nm_s_per_rad: f64,
    /// Maximum angular speed of a requested rotation \[rad/s\], positive.
    pub angular_speed_rad_per_s: f64,
    /// Angle between the tip and its reference that faults \[rad\], positive.
    pub rotation_error_rad: f64,
    /// Null-space stiffness towards the joint angles at which the mode was entered \[N m/rad\], zero or more.
    pub posture_stiffness_nm_per_rad: Vector<N>,
    /// Maximum torque of that stiffness, before its projection \[N m\], zero or more.
    pub posture_torque_nm: Vector<N>,
}

impl<const N: usize> Default for PoseLaw<N> {
    /// Returns gains for the wrist of the WAM: 0.5 N m/rad and 0.02 N m s/rad, at most 0.5 rad/s, 0.5 rad of error; no posture.
    fn default() -> PoseLaw<N> {
        PoseLaw {
            gains: RotationalGains::isotropic(0.5, 0.02),
            max_stiffness_nm_per_rad: 20.0,
            max_damping_nm_s_per_rad: 2.0,
            angular_speed_rad_per_s: 0.5,
            rotation_error_rad: 0.5,
            posture_stiffness_nm_per_rad: Vector::zeros(),
            posture_torque_nm: Vector::zeros(),
        }
    }
}

/// `M` of Eq. (3.3).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ApparentInertia {
    /// The arm's own, `M = (J H^-1 J^T)^-1`: the force sensor drops out of (3.6).
    Own,
    /// Chosen \[kg\], symmetric positive definite, base axes: needs the measured tip force. Without a
    /// measurement the law falls back to [`ApparentInertia::Own`].
    Chosen(Matrix3<f64>),
}

/// Velocity at which the friction feed-forward is evaluated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrictionVelocity {
    /// `J^-1 Xo'`, the velocity of the reference. The default: the remaining friction is then
    /// dissipative for the tracking error.
    Reference,
    /// The estimated joint velocity, as (3.6) is printed: cancels all damping of the arm and is
    /// unstable at low gains.
    Measured,
}

/// Time over which the velocity in a measured Stribeck effect is averaged \[s\].
pub const STRIBECK_AVERAGING_S: f64 = 0.05;

/// Parameters and variants of the law (3.6).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Law {
    /// Initial `K` and `B`; requests can change them, by ramps.
    pub gains: Gains,
    /// `M`.
    pub inertia: ApparentInertia,
    /// Velocity in `D`.
    pub friction_velocity: FrictionVelocity,
    /// Evaluates the Stribeck effect of `D` at the measured velocity, averaged over [`STRIBECK_AVERAGING_S`], where the rest of `D` is
    /// at that of the reference. Dry friction that falls with the speed by `k` per velocity is negative damping: at low gains, joints
    /// with little viscous friction `V` stick and slip. The feed-forward then falls with the speed as well. Because of the average, joints
    /// with an inertia below `k - V` times the averaging time still stick and slip.
    pub measured_stribeck: bool,
    /// Share of a joint's presliding distance over which its dry friction reverses along the reference, above 0, at most 1. The joint itself
    /// starts later than its reference and travels less: with 1, one that moves by a few presliding distances does not get its friction,
    /// and rests. With less, joints that move further get theirs too early.
    pub presliding_share: f64,
    /// Adds `M Xo''`, which (3.3) does not contain.
    pub inertial_feedforward: bool,
    /// Damping of null-space motion if more than three joints are active \[N m s/rad\], zero or
    /// more.
    pub nullspace_damping_nm_s_per_rad: f64,
}

impl Law {
    /// Returns equation (3.6) exactly as printed, with the continuous (3.2): measured velocity in the
    /// friction, no `M Xo''`, the arm's own inertia.
    pub fn as_published(gains: Gains) -> Law {
        Law {
            gains,
            inertia: ApparentInertia::Own,
            friction_velocity: FrictionVelocity::Measured,
            measured_stribeck: false,
            presliding_share: 1.0,
            inertial_feedforward: false,
            nullspace_damping_nm_s_per_rad: 0.0,
        }
    }
}

/// Parameters of contact detection, which fades the friction feed-forward.
///
/// The threshold of the observed force against the reference's motion is `threshold_n + sum_i |(Jb
/// d)_i| S_i (friction_error + exp(-(v_i / v_s)^2))`: the uncertainty of each joint's friction,
/// projected onto the direction `d` of the reference. A joint with a slow reference `v_i` may
/// stick; then all of its friction torque is uncertain. The residuals of free motion scale it, see
/// [`crate::controller::residual`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactLatch {
    /// Fades the friction feed-forward on contact. Without it the latch still reports.
    pub fade: bool,
    /// Bandwidth of the momentum observer \[rad/s\], positive.
    pub observer_rad_per_s: f64,
    /// Contact force threshold without friction uncertainty \[N\], positive.
    pub threshold_n: f64,
    /// Relative error of the friction model in steady sliding, zero or more.
    pub friction_error: f64,
    /// Time after a reversal or start of the reference in which the threshold is doubled \[s\].
    pub reversal_s: f64,
    /// Fraction of the dry friction feed-forward that stays on in contact, 0 to 1.
    pub contact_share: f64,
    /// Time for fading the full feed-forward to zero \[s\], positive.
    pub fade_s: f64,
    /// Time for restoring the full feed-forward after release \[s\], positive.
    pub restore_s: f64,
    /// Time from contact to the beginning of the fade \[s\], zero or more. With the full feed-forward the tip settles
    /// on the obstacle; without it, the joints' friction could hold the tip off the obstacle after a bounce.
    pub settle_s: f64,
    /// Freezes the friction feed-forward from contact to release, because the blocked arm does not follow its reference.
    /// Configurations of logs that lack this field have `false`.
    pub hold_friction: bool,
    /// Rate of false alarms in free motion for which the residuals of the model in use set the threshold \[1/h\],
    /// positive; infinite: the threshold stays as configured.
    pub false_alarms_per_hour: f64,
    /// Time after which a latch opens if the tip's motion does not confirm the contact \[s\], positive; infinite: every latch
    /// stays closed until the reference retreats.
    pub release_s: f64,
}

/// Thresholds on the external forces that the momentum observer estimates; above them the motion
/// ends. They are well above the residual of an inexact model in free motion, dry friction
/// included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collision<const N: usize> {
    /// External torque of a joint \[N m\], positive.
    pub joint_torque_nm: Vector<N>,
    /// Force on the tip \[N\], positive; away from singular poses.
    pub tip_force_n: f64,
    /// The thresholds in the modes with stiff joint loops (move, excite, breakaway), in which no contact is wanted:
    /// external torque of a joint \[N m\], positive.
    pub move_joint_torque_nm: Vector<N>,
    /// Force on the tip in these modes \[N\], positive.
    pub move_tip_force_n: f64,
}

impl<const N: usize> Collision<N> {
    /// Disables collision detection; used to replay logs recorded before these thresholds existed.
    pub fn disabled() -> Collision<N> {
        Collision {
            joint_torque_nm: Vector::repeat(f64::MAX),
            tip_force_n: f64::MAX,
            move_joint_torque_nm: Vector::repeat(f64::MAX),
            move_tip_force_n: f64::MAX,
        }
    }
}

/// Plausibility limits: allowed disagreement between measurements, commands and model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlausibilityLimits {
    /// Tolerated lost encoder replies; eight received replies cancel one lost reply.
    pub lost_replies: u32,
    /// Travel of a joint's reference during which its encoder value may stay unchanged \[rad\],
    /// positive.
    pub stuck_rad: f64,
    /// Factor of the external torque that dry friction may hold while an encoder is unchanged, for a friction model that may be
    /// too small, 1 or more.
    pub stiction_factor: f64,
    /// Fraction of a joint's torque limit: net torque above it that opposes an accelerating joint
    /// is a fault. Positive.
    pub against_share: f64,
    /// Tip force along gravity above which an unmodelled load is assumed, in gravity hold and after
    /// the end of a move \[N\], positive.
    pub load_n: f64,
}

impl PlausibilityLimits {
    /// Disables the plausibility checks; used to replay logs recorded before they existed.
    pub fn disabled() -> PlausibilityLimits {
        PlausibilityLimits {
            lost_replies: u32::MAX / 16,
            stuck_rad: f64::MAX,
            stiction_factor: 1.0,
            against_share: f64::MAX,
            load_n: f64::MAX,
        }
    }
}

/// Stiffness and damping of each joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointGains<const N: usize> {
    /// Stiffness \[N m/rad\], zero or more; in the move mode positive.
    pub stiffness_nm_per_rad: Vector<N>,
    /// Damping \[N m s/rad\], zero or more.
    pub damping_nm_s_per_rad: Vector<N>,
}

impl<const N: usize> JointGains<N> {
    /// Returns gains without stiffness and damping.
    pub fn zero() -> JointGains<N> {
        JointGains {
            stiffness_nm_per_rad: Vector::zeros(),
            damping_nm_s_per_rad: Vector::zeros(),
        }
    }
}

/// Limits that the supervisor enforces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits<const N: usize> {
    /// Lower hard stops \[rad\].
    pub position_lower_rad: Vector<N>,
    /// Upper hard stops \[rad\].
    pub position_upper_rad: Vector<N>,
    /// Width of the zone before each hard stop in which a spring-damper pushes back \[rad\], positive.
    pub soft_zone_rad: f64,
    /// Stiffness in that zone \[N m/rad\], zero or more.
    pub soft_stiffness_nm_per_rad: Vector<N>,
    /// Damping in that zone \[N m s/rad\], zero or more.
    pub soft_damping_nm_s_per_rad: Vector<N>,
    /// Joint speeds that fault \[rad/s\], positive.
    pub joint_speed_rad_per_s: Vector<N>,
    /// Tip speed that faults \[m/s\], positive.
    pub tip_speed_m_per_s: f64,
    /// Maximum acceleration of a requested tip trajectory \[m/s^2\], positive.
    pub tip_acceleration_m_per_s2: f64,
    /// Maximum acceleration of a requested move \[rad/s^2\], positive.
    pub joint_acceleration_rad_per_s2: Vector<N>,
    /// Maximum jerk of a requested move \[rad/s^3\], positive.
    pub joint_jerk_rad_per_s3: Vector<N>,
    /// Tracking error of the tip that faults while tracking or probing \[m\], positive.
    pub tracking_error_m: f64,
    /// Joint tracking error that faults, for joints with a position loop (move mode, held joints)
    /// \[rad\], positive.
    pub joint_tracking_error_rad: f64,
    /// Joint torque limits \[N m\], positive.
    pub joint_torque_nm: Vector<N>,
    /// Motor torque limits \[N m\] at the motor, positive.
    pub motor_torque_nm: Vector<N>,
    /// Maximum rate of change of joint torque \[N m/s\], positive.
    pub torque_rate_nm_per_s: Vector<N>,
    /// Tolerated cycles without a new state, whether the same state is repeated or states are
    /// missing.
    pub stale_cycles: u32,
    /// Maximum distance of the tip from the start of a requested trajectory \[m\], positive.
    pub start_error_m: f64,
    /// Maximum stiffness that may be requested \[N/m\], positive.
    pub stiffness_n_per_m: f64,
    /// Maximum damping that may be requested \[N s/m\], positive.
    pub damping_n_s_per_m: f64,
}

/// Configuration of a controller.
#[derive(Clone, Copy, Debug)]
pub struct Config<const N: usize> {
    /// Names of the joints in messages.
    pub joint_names: JointNames<N>,
    /// The controller's model of the arm.
    pub arm: Arm<N>,
    /// The controller's model of the friction.
    pub friction: [Friction; N],
    /// Role of each joint.
    pub roles: [Role; N],
    /// `m2jp`: joint angles from motor angles, `q = m2jp p`; motor torques are `m2jp^T tau`.
    pub joint_from_motor: Matrix<N, N>,
    /// Torque ripple of each motor, compensated by feed-forward.
    pub ripple: [RippleTable; N],
    /// Learned terms of the model in force at the start, within
    /// [`LearnedBounds`](crate::learned::LearnedBounds).
    pub learned: LearnedTerms<N>,
    /// Compliance between the encoder of each joint and its link, zero or more \[rad/(N m)\]: under the model's gravity
    /// torque `G` the link's angle is the measured one minus this times `G`.
    pub compliance_rad_per_nm: Vector<N>,
    /// Cycle period \[s\], positive.
    pub period_s: f64,
    /// Bandwidth of the velocity estimator \[rad/s\], positive.
    pub estimator_rad_per_s: f64,
    /// The law.
    pub law: Law,
    /// The contact latch.
    pub latch: ContactLatch,
    /// Gains of the move mode; their stiffness is also the maximum of the joint impedance mode.
    pub move_gains: JointGains<N>,
    /// Initial gains of the joint impedance mode; requests can change them, by ramps.
    pub joint_gains: JointGains<N>,
    /// Parameters of the track pose mode.
    pub pose: PoseLaw<N>,
    /// Share of the friction torque at the measured joint velocity that the float mode compensates, 0 to 1. The
    /// rest, `1 - share`, damps the arm.
    pub float_friction_share: f64,
    /// Joint damping of gravity hold \[N m s/rad\], zero or more.
    pub hold_damping_nm_s_per_rad: Vector<N>,
    /// Whether gravity hold keeps every joint with a position loop, with the move mode's gains and collision thresholds, for a
    /// model with which the arm would sink. A fault opens these loops like all others.
    pub hold_pose: bool,
    /// Time over which the torque is blended after a change of mode \[s\], positive.
    pub handover_s: f64,
    /// Limits.
    pub limits: Limits<N>,
    /// Collision thresholds.
    pub collision: Collision<N>,
    /// Plausibility limits.
    pub plausible: PlausibilityLimits,
    /// Workspace limits of the tip.
    pub workspace: Workspace,
}
