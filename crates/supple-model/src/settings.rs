//! The TOML beside a URDF: controller data that URDF cannot hold.
//!
//! Key names contain units; unknown keys are rejected; optional keys document their defaults. The JSON
//! schema of these types is `assets/arm.schema.json`.

use crate::bus_settings::BusSettings;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// One arm.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Name of the arm.
    pub name: String,
    /// URDF file, relative to the folder of this TOML.
    pub urdf: String,
    /// URDF link whose origin is the tip: the centre of the hemispherical cap. The arm is the chain of
    /// movable joints from the root link to this one.
    pub tip_frame: String,
    /// Source of the numbers of this file, unless a section states another.
    pub source: Option<String>,
    /// Gravitational acceleration in root link axes (m/s^2). Default (0, 0, -9.81).
    #[serde(default = "default::gravity_m_per_s2")]
    pub gravity_m_per_s2: [f64; 3],
    /// Links with mass and zero inertia get the inertia of a solid ball of this radius (m). Default: such links
    /// are rejected.
    pub point_mass_radius_m: Option<f64>,
    /// Replaces an inertia that no rigid body has by the nearest one that a rigid body has, with a warning. Default: such a
    /// link between base and tip is rejected.
    #[serde(default)]
    pub repair_inertia: bool,
    /// Cycle period (s). Default 0.001.
    #[serde(default = "default::period_s")]
    pub period_s: f64,
    /// Bandwidth of the velocity estimator (rad/s). Default 180.
    #[serde(default = "default::estimator_rad_per_s")]
    pub estimator_rad_per_s: f64,
    /// Duration of the torque blend after a change of mode (s). Default 0.2.
    #[serde(default = "default::handover_s")]
    pub handover_s: f64,
    /// Gravity hold keeps every joint by a position loop with the move mode's gains, for a model that would let the arm
    /// sink, as before a calibration. Default: false, held joints alone have a loop.
    #[serde(default)]
    pub hold_pose: bool,
    /// Pose that the arm starts from, one angle per moving joint (rad). Default: the middle of each
    /// joint's range, held joints at the angle they are held at.
    pub home_rad: Option<Vec<f64>>,
    /// Pose in which the arm stays without torque, one angle per moving joint (rad): where a shutdown leaves an arm
    /// without brakes. Default: none.
    pub stow_rad: Option<Vec<f64>>,
    /// Movable joints of the URDF that are fixed, each at an angle (rad, m for a prismatic joint); their child links
    /// become part of the parent link. Default: joints outside the chain to the tip, prismatic joints, mimics and the
    /// first ones of more than seven stay at zero, or at the end of their range that is closest to it, with a warning.
    #[serde(default)]
    pub fixed_joints_rad: BTreeMap<String, f64>,
    /// Settings per moving joint, in any order. A joint without an entry has all defaults.
    #[serde(default)]
    pub joints: Vec<JointSettings>,
    /// Motors and transmission. Default: one motor per joint, ratio 1, no quantisation.
    pub motors: Option<MotorSettings>,
    /// Motors as their bus addresses them. Default: none; the WAM's motors need no entry.
    pub bus: Option<BusSettings>,
    /// Limits that apply to the whole arm.
    #[serde(default)]
    pub limits: LimitSettings,
    /// Collision thresholds.
    #[serde(default)]
    pub collision: CollisionSettings,
    /// Plausibility checks of measurements and model.
    #[serde(default)]
    pub plausible: PlausibilitySettings,
    /// Allowed workspace of the tip. Default: unlimited.
    #[serde(default)]
    pub workspace: WorkspaceSettings,
    /// The impedance law.
    #[serde(default)]
    pub law: LawSettings,
    /// Contact detection (contact latch).
    #[serde(default)]
    pub latch: LatchSettings,
    /// The float mode, for guiding by hand.
    #[serde(default)]
    pub float: FloatSettings,
    /// The pose mode, which also controls the orientation of the tip; it needs at least six joints that are not held.
    #[serde(default)]
    pub pose: PoseSettings,
    /// Tool at the tip. Default: none.
    pub tool: Option<ToolSettings>,
    /// Where the trajectories of the paper's experiments lie. Default: where the paper has them, if the arm reaches them,
    /// otherwise found in the arm's workspace.
    pub paths: Option<PathSettings>,
    /// What was learned of the model while the arm moved, as `supple learning save` writes it. Default: nothing.
    pub learned: Option<LearnedSettings>,
}

/// Place and size of the paper's trajectories: the paper's own, about the point (0.6, 0, 0) m, are turned about the base's
/// vertical axis, moved and scaled.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PathSettings {
    /// Distance of their centre from the base's vertical axis (m), positive. The paper's: 0.6.
    pub radius_m: f64,
    /// Direction of their centre about that axis, from base axis x (rad). The paper's: 0.
    pub azimuth_rad: f64,
    /// Height of their centre above the base frame (m). The paper's: 0.
    pub height_m: f64,
    /// Their lengths as a multiple of the paper's, 0.01 to 10; speeds scale with it.
    pub scale: f64,
}

/// One moving joint.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointSettings {
    /// Name of the joint in the URDF.
    pub name: String,
    /// Source of the numbers of this joint.
    pub source: Option<String>,
    /// Holds the joint at an angle while the impedance law controls the others. Default: not held, the
    /// law controls this joint too.
    pub held: Option<HeldSettings>,
    /// Rotor inertia reflected to the joint (kg m^2). Default 0.
    #[serde(default)]
    pub armature_kg_m2: f64,
    /// Compliance of cables or gears between the joint's encoder and its link (rad/(N m)), 0 to 0.02: the law then takes
    /// the link's angle under the model's gravity. Default 0.
    #[serde(default)]
    pub compliance_rad_per_nm: f64,
    /// Whether that inertia is an estimate from the limits of torque and speed, not a datum. Default false.
    #[serde(default)]
    pub armature_is_estimate: bool,
    /// Friction. Default: the URDF's `<dynamics>` (damping as viscous, friction as Coulomb), or none.
    pub friction: Option<FrictionSettings>,
    /// Lower hard stop (rad); may narrow the range of the URDF. Default: `lower` of the URDF; -2 pi for a
    /// `continuous` joint.
    pub position_lower_rad: Option<f64>,
    /// Upper hard stop (rad); may narrow the range of the URDF. Default: `upper` of the URDF; 2 pi for a
    /// `continuous` joint.
    pub position_upper_rad: Option<f64>,
    /// Joint speed above which the controller faults (rad/s). Default: `velocity` of the URDF.
    pub speed_rad_per_s: Option<f64>,
    /// Joint torque limit (N m). Default: `effort` of the URDF.
    pub torque_nm: Option<f64>,
    /// Maximum rate of change of the joint torque (N m/s). Default 1000.
    #[serde(default = "default::torque_rate_nm_per_s")]
    pub torque_rate_nm_per_s: f64,
    /// Stiffness in the soft zone before each hard stop (N m/rad). Default 100.
    #[serde(default = "default::soft_stiffness_nm_per_rad")]
    pub soft_stiffness_nm_per_rad: f64,
    /// Damping in the soft zone (N m s/rad). Default 2.
    #[serde(default = "default::soft_damping_nm_s_per_rad")]
    pub soft_damping_nm_s_per_rad: f64,
    /// Proportional gain of the move mode (N m/rad). Default 100.
    #[serde(default = "default::move_stiffness_nm_per_rad")]
    pub move_stiffness_nm_per_rad: f64,
    /// Derivative gain of the move mode (N m s/rad). Default 5.
    #[serde(default = "default::move_damping_nm_s_per_rad")]
    pub move_damping_nm_s_per_rad: f64,
    /// Stiffness of the joint impedance mode (N m/rad), at most `move_stiffness_nm_per_rad`. Default: a fiftieth of
    /// it.
    pub impedance_stiffness_nm_per_rad: Option<f64>,
    /// Damping of the joint impedance mode (N m s/rad). Default: a tenth of `move_damping_nm_s_per_rad`.
    pub impedance_damping_nm_s_per_rad: Option<f64>,
    /// Stiffness towards the angle that the joint had when the pose mode was entered (N m/rad); it acts only in the null
    /// space of the tip's pose. Default 0.
    #[serde(default)]
    pub posture_stiffness_nm_per_rad: f64,
    /// Maximum torque of that stiffness (N m). Default 0.
    #[serde(default)]
    pub posture_torque_nm: f64,
    /// Maximum acceleration of a move (rad/s^2). Default 20.
    #[serde(default = "default::acceleration_rad_per_s2")]
    pub acceleration_rad_per_s2: f64,
    /// Maximum jerk of a move (rad/s^3). Default 1000.
    #[serde(default = "default::jerk_rad_per_s3")]
    pub jerk_rad_per_s3: f64,
    /// Collision threshold: observed external torque of the joint at which the motion stops (N m). Default: 0.3
    /// times `torque_nm`.
    pub collision_torque_nm: Option<f64>,
    /// The same in the modes with stiff joint loops (move, excite, breakaway) (N m). `supple identify` writes it
    /// from the residual of the model. Default: `[collision] move_share` times `collision_torque_nm`.
    pub move_collision_torque_nm: Option<f64>,
    /// Damping of gravity hold (N m s/rad). Default 1.
    #[serde(default = "default::hold_damping_nm_s_per_rad")]
    pub hold_damping_nm_s_per_rad: f64,
}

/// A joint held at an angle by a stiff proportional-derivative loop with model feed-forward.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HeldSettings {
    /// Angle (rad), within the joint's limits.
    pub position_rad: f64,
    /// Proportional gain (N m/rad), positive.
    pub stiffness_nm_per_rad: f64,
    /// Derivative gain (N m s/rad), zero or more.
    pub damping_nm_s_per_rad: f64,
}

/// Friction of one joint: viscous and Coulomb, continuous over a velocity band, with an optional Stribeck
/// effect and offset.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FrictionSettings {
    /// Viscous friction (N m s/rad), zero or more. Default 0.
    #[serde(default)]
    pub viscous_nm_s_per_rad: f64,
    /// Half of the difference between the viscous friction of the positive and of the negative direction (N m s/rad), at most
    /// `viscous_nm_s_per_rad` in magnitude. Default 0: it is the same in both.
    #[serde(default)]
    pub viscous_asymmetry_nm_s_per_rad: f64,
    /// Coulomb friction in steady sliding (N m), zero or more. Default 0.
    #[serde(default)]
    pub coulomb_nm: f64,
    /// Limit of the Stribeck curve at zero speed (N m), at least `coulomb_nm`. Default: `coulomb_nm`, no
    /// Stribeck effect.
    pub breakaway_nm: Option<f64>,
    /// Stribeck speed, over which the breakaway torque decays (rad/s), positive. Default 0.05.
    #[serde(default = "default::stribeck_rad_per_s")]
    pub stribeck_rad_per_s: f64,
    /// Torque that does not depend on the velocity (N m). Default 0.
    #[serde(default)]
    pub offset_nm: f64,
    /// Torque at rest in addition to `offset_nm`, which falls with the Stribeck effect (N m); at most `breakaway_nm - coulomb_nm` in
    /// magnitude. Default 0.
    #[serde(default)]
    pub stribeck_offset_nm: f64,
    /// Half-width of the band in which friction is a parabola (rad/s), positive. Default 0.01.
    #[serde(default = "default::band_rad_per_s")]
    pub band_rad_per_s: f64,
    /// Travel over which dry friction turns round after a reversal (rad), zero or more; in proportion to the dry friction, where that
    /// depends on the load. Default 0: its direction is that of the velocity.
    #[serde(default)]
    pub presliding_rad: f64,
    /// Dry friction that a torque on the gear adds, per torque, 0 to 0.5. Default 0: friction does not depend on the load.
    #[serde(default)]
    pub load_coefficient: f64,
    /// Which torque that is. Default: that which the joint carries.
    #[serde(default)]
    pub load_torque: LoadTorque,
    /// Size of that torque at which dry friction is `coulomb_nm` (N m), zero or more; `load_coefficient` times it is at most
    /// `coulomb_nm`. Default 0.
    #[serde(default)]
    pub coulomb_at_nm: f64,
}

/// The torque in proportion to which a gear adds dry friction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LoadTorque {
    /// That which the joint carries.
    #[default]
    Joint,
    /// That of the motor, which has to overcome friction as well.
    Motor,
}

/// Motors and transmission. As many motors as moving joints.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MotorSettings {
    /// Source of these numbers.
    pub source: Option<String>,
    /// `m2jp`, row by row: joint angles from motor angles, `q = m2jp p`. Motor torques are
    /// `m2jp^T tau`. Default: identity.
    pub joint_from_motor: Option<Vec<Vec<f64>>>,
    /// Torque limit of each motor, at the motor (N m).
    pub torque_nm: Vec<f64>,
    /// Resolution of each motor's torque command, at the motor (N m), positive. Default: continuous.
    pub torque_quantum_nm: Option<Vec<f64>>,
    /// Damping of each motor with shorted terminals, `Kt^2 / R` (N m s/rad), positive: brakes the motor in idle.
    /// Default: the value that stops the rotor alone with a time constant of 2 ms.
    pub braking_nm_s_per_rad: Option<Vec<f64>>,
    /// Encoder counts per motor revolution, positive. Default: continuous.
    pub counts_per_revolution: Option<u32>,
    /// Known torque ripple of the motors, cancelled by feed-forward; at most 6 harmonics per motor. Default:
    /// none.
    #[serde(default)]
    pub ripple: Vec<RippleSettings>,
}

/// A harmonic of a motor's torque over its angle: `sine sin(harmonic p) + cosine cos(harmonic p)`, each the sum of a torque
/// and of a share of the motor's torque.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RippleSettings {
    /// Motor, counted from 0.
    pub motor: usize,
    /// Periods per revolution of the motor, 1 or more.
    pub harmonic: u32,
    /// Amplitude of the sine, at the motor (N m).
    pub sine_nm: f64,
    /// Amplitude of the cosine, at the motor (N m).
    pub cosine_nm: f64,
    /// Part of the sine in proportion to the motor's torque, as a share of it: its torque constant varies with the angle.
    /// Default: 0.
    #[serde(default)]
    pub sine_share: f64,
    /// The same of the cosine. Default: 0.
    #[serde(default)]
    pub cosine_share: f64,
}

/// Limits that apply to the whole arm.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LimitSettings {
    /// Source of these numbers.
    pub source: Option<String>,
    /// Width of the zone before each hard stop in which a spring-damper pushes the joint back (rad). Default 0.1.
    pub soft_zone_rad: f64,
    /// Tip speed above which the controller faults (m/s). Default 1.
    pub tip_speed_m_per_s: f64,
    /// Maximum acceleration of a tip trajectory (m/s^2). Default 10.
    pub tip_acceleration_m_per_s2: f64,
    /// Distance of the tip from its reference above which the controller faults while tracking or probing (m).
    /// Default 0.25.
    pub tracking_error_m: f64,
    /// Joint position error above which the controller faults, during moves and for held joints (rad). Default
    /// 0.2.
    pub joint_tracking_error_rad: f64,
    /// Maximum number of cycles without a new state. Default 1: a single lost encoder reply.
    pub stale_cycles: u32,
    /// Maximum distance of the tip from the start of a requested trajectory (m). Default 0.02.
    pub start_error_m: f64,
    /// Maximum stiffness that a request may set (N/m). Default 1000.
    #[serde(alias = "greatest_stiffness_n_per_m")]
    pub max_stiffness_n_per_m: f64,
    /// Maximum damping that a request may set (N s/m). Default 100.
    #[serde(alias = "greatest_damping_n_s_per_m")]
    pub max_damping_n_s_per_m: f64,
}

/// Collision thresholds of external forces, observed from motion and torques without a sensor. The threshold of
/// each joint is its `collision_torque_nm`.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CollisionSettings {
    /// Source of these numbers.
    pub source: Option<String>,
    /// Observed force on the tip at which the motion stops (N). Default 60.
    pub tip_force_n: f64,
    /// Factor on all collision thresholds in the modes with stiff joint loops: move, excite, breakaway.
    /// Default 0.5.
    pub move_share: f64,
}

/// Limits of disagreement between measurements, commands and model; beyond them the controller faults.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PlausibilitySettings {
    /// Source of these numbers.
    pub source: Option<String>,
    /// Maximum balance of lost encoder replies: each lost reply adds one, eight received replies remove one.
    /// Default 3.
    pub lost_replies: u32,
    /// Travel of the joint reference during which the encoder may stay constant before it counts as stuck (rad).
    /// Default 0.05.
    pub stuck_rad: f64,
    /// Factor of the external torque that dry friction may hold while an encoder is constant, for a friction model that may be too
    /// small, 1 or more. Default 1.
    pub stiction_factor: f64,
    /// Torque that may oppose the joint's acceleration before the controller faults, as a fraction of the joint's
    /// torque limit. Default 0.05.
    pub against_share: f64,
    /// Force along gravity at the tip, in gravity hold or at the end of a move, above which the controller reports
    /// an unmodelled load (N). Default 5.
    pub load_n: f64,
}

/// Allowed workspace of the tip, base axes. A spring-damper pushes the tip back within a margin before each
/// boundary.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct WorkspaceSettings {
    /// Source of these numbers.
    pub source: Option<String>,
    /// Width of the margin (m). Default 0.05.
    pub margin_m: f64,
    /// Stiffness in the margin (N/m). Default 400.
    pub stiffness_n_per_m: f64,
    /// Damping in the margin, and of a tip that exceeds the speed limit of its zone (N s/m). Default 20.
    pub damping_n_s_per_m: f64,
    /// Planes that the tip must not cross. At most 8 boundaries in total; a `keep_in` box counts as six.
    pub wall: Vec<WallSettings>,
    /// Box that the tip must not leave.
    pub keep_in: Option<BoxSettings>,
    /// Boxes that the tip must not enter.
    pub keep_out: Vec<BoxSettings>,
    /// Boxes with additional limits; at most 8.
    pub zone: Vec<ZoneSettings>,
}

/// A plane: the tip must satisfy `normal . x <= offset_m`.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WallSettings {
    /// Normal that points away from the allowed side; any length but zero.
    pub normal: [f64; 3],
    /// Distance from the base's origin along the normal (m).
    pub offset_m: f64,
}

/// A box with edges parallel to the base axes.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxSettings {
    /// Corner with the smallest coordinates (m).
    pub lower_m: [f64; 3],
    /// Corner with the largest coordinates (m).
    pub upper_m: [f64; 3],
}

/// A box with additional limits, edges parallel to the base axes.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ZoneSettings {
    /// Corner with the smallest coordinates (m).
    pub lower_m: [f64; 3],
    /// Corner with the largest coordinates (m).
    pub upper_m: [f64; 3],
    /// Tip speed in the box above which the controller faults (m/s). Default: no additional limit.
    pub tip_speed_m_per_s: Option<f64>,
    /// Maximum tip force in the box (N): the spring of the law is limited to it, and a larger observed force is a
    /// fault. Default: no additional limit.
    pub tip_force_n: Option<f64>,
}

/// Velocity at which the friction feed-forward is evaluated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FrictionVelocity {
    /// Joint velocity of the reference; the friction mismatch then acts dissipatively on the error.
    #[default]
    Reference,
    /// Estimated joint velocity; cancels the damping of the arm and is unstable at low gains.
    Measured,
}

/// The impedance law.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LawSettings {
    /// Source of these numbers.
    pub source: Option<String>,
    /// `K` along the base axes (N/m), zero or more. Default 5 on each.
    pub stiffness_n_per_m: [f64; 3],
    /// `B` along the base axes (N s/m), zero or more. Default 1.5 on each.
    pub damping_n_s_per_m: [f64; 3],
    /// Desired inertia `M`, base axes (kg), exactly symmetric, positive definite; needs a force sensor. Default:
    /// the inertia of the arm.
    pub apparent_inertia_kg: Option<[[f64; 3]; 3]>,
    /// Velocity in the friction feed-forward. Default `reference`.
    pub friction_velocity: FrictionVelocity,
    /// Evaluates the Stribeck effect at the measured velocity, averaged over 50 ms, instead of at that of the reference: fewer joints with
    /// little viscous friction stick and slip at low gains. Default false.
    pub measured_stribeck: bool,
    /// Share of `presliding_rad` over which dry friction turns round along the reference, above 0, at most 1: less than 1 for joints that move
    /// by a few times that travel, which otherwise rest. Default 1.
    pub presliding_share: f64,
    /// Adds `M Xo''`. Default true.
    pub inertial_feedforward: bool,
    /// Damping of null-space motion if more than three joints are active (N m s/rad), zero or more. Default 2.
    pub nullspace_damping_nm_s_per_rad: f64,
}

/// Contact detection (contact latch): fades out the friction feed-forward while the tip is in contact.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LatchSettings {
    /// Source of these numbers.
    pub source: Option<String>,
    /// Fades the friction feed-forward on contact. Default true.
    pub fade: bool,
    /// Bandwidth of the momentum observer (rad/s). Default 40.
    pub observer_rad_per_s: f64,
    /// Contact threshold of the force that opposes the motion of the reference, without the allowance for friction
    /// uncertainty (N). Default 3.
    pub threshold_n: f64,
    /// Relative error of the friction model in steady sliding. Default 0.05.
    pub friction_error: f64,
    /// Time after a reversal or start of the reference during which the threshold is doubled (s). Default 0.2.
    pub reversal_s: f64,
    /// Fraction of the dry-friction feed-forward that remains in contact. Default 0.
    pub contact_share: f64,
    /// Time for the feed-forward to fade out (s). Default 0.01.
    pub fade_s: f64,
    /// Time for the feed-forward to return to full after release (s). Default 0.05.
    pub restore_s: f64,
    /// Time from contact to the beginning of the fade (s): with all of the feed-forward the tip settles on what it
    /// met, instead of hovering where the joints' friction holds it after a bounce. Default 0.1.
    pub settle_s: f64,
    /// Keeps the feed-forward of the moment of contact until release, instead of following a reference that the
    /// blocked arm does not follow. Default true.
    pub hold_friction: bool,
    /// Rate of false alarms in free motion for which the residuals of the model in use raise the threshold, up to five
    /// times the configured one (1/h); `inf`: the threshold stays as configured. Default 1.
    pub false_alarms_per_hour: f64,
    /// Time after which a latch opens if the tip's motion does not confirm the contact (s); `inf`: every latch stays closed
    /// until the reference retreats. Default 0.2.
    pub release_s: f64,
}

/// Tool at the tip, in tip frame coordinates: force sensor and cap.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ToolSettings {
    /// Source of these numbers.
    pub source: Option<String>,
    /// Mass (kg), positive. Default: none; the last link of the URDF includes it.
    pub mass_kg: Option<f64>,
    /// Centre of mass in the tip frame (m). Default: the tip.
    pub com_m: Option<[f64; 3]>,
    /// Inertia about the centre of mass, tip frame axes: xx, yy, zz, xy, xz, yz (kg m^2). Default:
    /// that of a solid ball of the cap's radius.
    pub inertia_kg_m2: Option<[f64; 6]>,
    /// Radius of the hemispherical cap, whose centre is the tip (m), positive.
    pub cap_radius_m: f64,
}

impl Default for LimitSettings {
    fn default() -> Self {
        Self {
            source: None,
            soft_zone_rad: 0.1,
            tip_speed_m_per_s: 1.0,
            tip_acceleration_m_per_s2: 10.0,
            tracking_error_m: 0.25,
            joint_tracking_error_rad: 0.2,
            stale_cycles: 1,
            start_error_m: 0.02,
            max_stiffness_n_per_m: 1000.0,
            max_damping_n_s_per_m: 100.0,
        }
    }
}

impl Default for CollisionSettings {
    fn default() -> Self {
        Self {
            source: None,
            tip_force_n: 60.0,
            move_share: 0.5,
        }
    }
}

impl Default for PlausibilitySettings {
    fn default() -> Self {
        Self {
            source: None,
            lost_replies: 3,
            stuck_rad: 0.05,
            stiction_factor: 1.0,
            against_share: 0.05,
            load_n: 5.0,
        }
    }
}

impl Default for WorkspaceSettings {
    fn default() -> Self {
        Self {
            source: None,
            margin_m: 0.05,
            stiffness_n_per_m: 400.0,
            damping_n_s_per_m: 20.0,
            wall: Vec::new(),
            keep_in: None,
            keep_out: Vec::new(),
            zone: Vec::new(),
        }
    }
}

impl Default for LawSettings {
    fn default() -> Self {
        Self {
            source: None,
            stiffness_n_per_m: [5.0; 3],
            damping_n_s_per_m: [1.5; 3],
            apparent_inertia_kg: None,
            friction_velocity: FrictionVelocity::Reference,
            measured_stribeck: false,
            presliding_share: 1.0,
            inertial_feedforward: true,
            nullspace_damping_nm_s_per_rad: 2.0,
        }
    }
}

impl Default for LatchSettings {
    fn default() -> Self {
        Self {
            source: None,
            fade: true,
            observer_rad_per_s: 40.0,
            threshold_n: 3.0,
            friction_error: 0.05,
            contact_share: 0.0,
            reversal_s: 0.2,
            fade_s: 0.01,
            restore_s: 0.05,
            settle_s: 0.1,
            hold_friction: true,
            false_alarms_per_hour: 1.0,
            release_s: 0.2,
        }
    }
}

/// The float mode: the model alone, without stiffness.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FloatSettings {
    /// Share of the friction at the measured joint velocity that is compensated, 0 to 1: the rest damps the arm.
    /// Default 0.5.
    pub friction_share: f64,
}

impl Default for FloatSettings {
    fn default() -> Self {
        Self {
            friction_share: 0.5,
        }
    }
}

/// The pose mode: the impedance law of position and orientation of the tip.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PoseSettings {
    /// Source of these numbers.
    pub source: Option<String>,
    /// Stiffness about the base axes (N m/rad), zero or more. Default 0.5 about each.
    pub stiffness_nm_per_rad: [f64; 3],
    /// Damping about the base axes (N m s/rad), zero or more. Default 0.02 about each.
    pub damping_nm_s_per_rad: [f64; 3],
    /// Maximum rotational stiffness that a request may set (N m/rad). Default 20.
    #[serde(alias = "greatest_stiffness_nm_per_rad")]
    pub max_stiffness_nm_per_rad: f64,
    /// Maximum rotational damping that a request may set (N m s/rad). Default 2.
    #[serde(alias = "greatest_damping_nm_s_per_rad")]
    pub max_damping_nm_s_per_rad: f64,
    /// Maximum angular speed of a requested rotation (rad/s). Default 0.5.
    pub angular_speed_rad_per_s: f64,
    /// Angle between the tip and the reference of its orientation above which the controller faults (rad). Default
    /// 0.5.
    pub rotation_error_rad: f64,
}

impl Default for PoseSettings {
    fn default() -> Self {
        Self {
            source: None,
            stiffness_nm_per_rad: [0.5; 3],
            damping_nm_s_per_rad: [0.02; 3],
            max_stiffness_nm_per_rad: 20.0,
            max_damping_nm_s_per_rad: 2.0,
            angular_speed_rad_per_s: 0.5,
            rotation_error_rad: 0.5,
        }
    }
}

impl JointSettings {
    /// All defaults.
    pub fn named(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            source: None,
            held: None,
            armature_kg_m2: 0.0,
            compliance_rad_per_nm: 0.0,
            armature_is_estimate: false,
            friction: None,
            position_lower_rad: None,
            position_upper_rad: None,
            speed_rad_per_s: None,
            torque_nm: None,
            torque_rate_nm_per_s: default::torque_rate_nm_per_s(),
            soft_stiffness_nm_per_rad: default::soft_stiffness_nm_per_rad(),
            soft_damping_nm_s_per_rad: default::soft_damping_nm_s_per_rad(),
            move_stiffness_nm_per_rad: default::move_stiffness_nm_per_rad(),
            move_damping_nm_s_per_rad: default::move_damping_nm_s_per_rad(),
            impedance_stiffness_nm_per_rad: None,
            impedance_damping_nm_s_per_rad: None,
            posture_stiffness_nm_per_rad: 0.0,
            posture_torque_nm: 0.0,
            acceleration_rad_per_s2: default::acceleration_rad_per_s2(),
            jerk_rad_per_s3: default::jerk_rad_per_s3(),
            collision_torque_nm: None,
            move_collision_torque_nm: None,
            hold_damping_nm_s_per_rad: default::hold_damping_nm_s_per_rad(),
        }
    }
}

impl From<FrictionSettings> for supple_core::Friction {
    fn from(f: FrictionSettings) -> Self {
        supple_core::Friction {
            viscous_nm_s_per_rad: f.viscous_nm_s_per_rad,
            viscous_asymmetry_nm_s_per_rad: f.viscous_asymmetry_nm_s_per_rad,
            coulomb_nm: f.coulomb_nm,
            breakaway_nm: f.breakaway_nm.unwrap_or(f.coulomb_nm),
            stribeck_rad_per_s: f.stribeck_rad_per_s,
            offset_nm: f.offset_nm,
            stribeck_offset_nm: f.stribeck_offset_nm,
            band_rad_per_s: f.band_rad_per_s,
            presliding_rad: f.presliding_rad,
            load_coefficient: f.load_coefficient,
            load_torque: match f.load_torque {
                LoadTorque::Joint => supple_core::friction::LoadTorque::Joint,
                LoadTorque::Motor => supple_core::friction::LoadTorque::Motor,
            },
            coulomb_at_nm: f.coulomb_at_nm,
        }
    }
}

mod default {
    pub fn gravity_m_per_s2() -> [f64; 3] {
        [0.0, 0.0, -9.81]
    }
    pub fn period_s() -> f64 {
        0.001
    }
    pub fn estimator_rad_per_s() -> f64 {
        180.0
    }
    pub fn handover_s() -> f64 {
        0.2
    }
    pub fn torque_rate_nm_per_s() -> f64 {
        1000.0
    }
    pub fn soft_stiffness_nm_per_rad() -> f64 {
        100.0
    }
    pub fn soft_damping_nm_s_per_rad() -> f64 {
        2.0
    }
    pub fn move_stiffness_nm_per_rad() -> f64 {
        100.0
    }
    pub fn move_damping_nm_s_per_rad() -> f64 {
        5.0
    }
    pub fn acceleration_rad_per_s2() -> f64 {
        20.0
    }
    pub fn jerk_rad_per_s3() -> f64 {
        1000.0
    }
    pub fn hold_damping_nm_s_per_rad() -> f64 {
        1.0
    }
    pub fn stribeck_rad_per_s() -> f64 {
        supple_core::Friction::NONE.stribeck_rad_per_s
    }
    pub fn band_rad_per_s() -> f64 {
        supple_core::Friction::NONE.band_rad_per_s
    }
}

/// What was learned of the model while the arm moved; lists have one entry per moving joint. The controller rejects
/// values beyond its bounds.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LearnedSettings {
    /// Source of the numbers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// Change of the viscous friction (N m s/rad). Default 0.
    #[serde(default)]
    pub viscous_nm_s_per_rad: Vec<f64>,
    /// Change of the Coulomb friction (N m). Default 0.
    #[serde(default)]
    pub coulomb_nm: Vec<f64>,
    /// Torque offset (N m). Default 0.
    #[serde(default)]
    pub offset_nm: Vec<f64>,
    /// Share of the model's torque by which the drives fall short. Default 0.
    #[serde(default)]
    pub torque_scale: Vec<f64>,
    /// Mass of a payload at the tip (kg). Default 0.
    #[serde(default)]
    pub payload_kg: f64,
    /// First moment of the payload in the tip frame (kg m). Default 0.
    #[serde(default)]
    pub payload_moment_kg_m: [f64; 3],
    /// Rotation of gravity in root link axes, axis times angle (rad). Default 0.
    #[serde(default)]
    pub tilt_rad: [f64; 3],
    /// Torque of each joint over its angle. Default: none.
    #[serde(default)]
    pub map: Vec<MapSettings>,
}

/// Torque of a joint over its angle: coefficients of 16 quadratic splines over the joint's range.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MapSettings {
    /// Part that depends on the angle alone (N m).
    pub torque_nm: Vec<f64>,
    /// Part against the direction of motion (N m).
    pub dry_nm: Vec<f64>,
}

/// The JSON schema of the TOML, as pretty-printed JSON with a trailing newline.
pub fn schema_json() -> String {
    let schema = schemars::schema_for!(Settings);
    let mut text = format!("{:#}", schema.as_value());
    text.push('\n');
    text
}
