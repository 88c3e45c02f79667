//! The TOML beside a URDF, as it is written: everything an arm's controller needs that a URDF has no
//! place for.
//!
//! Every key carries its unit; unknown keys are refused; what may be left out says its default. The
//! JSON schema of these types is `assets/arm.schema.json`.

use schemars::JsonSchema;
use serde::Deserialize;
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
    /// Where the numbers of this file come from, unless a section says otherwise.
    pub source: Option<String>,
    /// Acceleration of free fall in root link axes (m/s^2). Default (0, 0, -9.81).
    #[serde(default = "default::gravity_m_per_s2")]
    pub gravity_m_per_s2: [f64; 3],
    /// Links that have mass but an inertia of zeros are taken for solid balls of this radius (m). Default:
    /// they are refused.
    pub point_mass_radius_m: Option<f64>,
    /// Cycle period (s). Default 0.001.
    #[serde(default = "default::period_s")]
    pub period_s: f64,
    /// Bandwidth of the velocity estimator (rad/s). Default 180.
    #[serde(default = "default::estimator_rad_per_s")]
    pub estimator_rad_per_s: f64,
    /// Time over which a change of mode blends the torque (s). Default 0.2.
    #[serde(default = "default::handover_s")]
    pub handover_s: f64,
    /// Pose that the arm starts from, one angle per moving joint (rad). Default: the middle of each
    /// joint's range, held joints at the angle they are held at.
    pub home_rad: Option<Vec<f64>>,
    /// Movable joints of the URDF that are frozen, each at an angle (rad); their links become part of
    /// the link that carries them. Movable joints off the chain to the tip must be listed here.
    #[serde(default)]
    pub fixed_joints_rad: BTreeMap<String, f64>,
    /// Settings per moving joint, in any order. A joint without an entry has all defaults.
    #[serde(default)]
    pub joints: Vec<JointSettings>,
    /// Motors and transmission. Default: one motor per joint, ratio 1, no quantisation.
    pub motors: Option<MotorSettings>,
    /// Limits that are not one joint's.
    #[serde(default)]
    pub limits: LimitSettings,
    /// External forces that end the motion.
    #[serde(default)]
    pub collision: CollisionSettings,
    /// What is believed of measurements and model.
    #[serde(default)]
    pub plausible: PlausibleSettings,
    /// Where the tip may be. Default: anywhere.
    #[serde(default)]
    pub workspace: WorkspaceSettings,
    /// The impedance law.
    #[serde(default)]
    pub law: LawSettings,
    /// The contact latch.
    #[serde(default)]
    pub latch: LatchSettings,
    /// What is mounted at the tip. Default: nothing.
    pub tool: Option<ToolSettings>,
}

/// One moving joint.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointSettings {
    /// Name of the joint in the URDF.
    pub name: String,
    /// Where the numbers of this joint come from.
    pub source: Option<String>,
    /// Holds the joint at an angle while the impedance law acts on the others. Default: not held, the
    /// law acts on this joint too.
    pub held: Option<HeldSettings>,
    /// Rotor inertia reflected to the joint (kg m^2). Default 0.
    #[serde(default)]
    pub armature_kg_m2: f64,
    /// Friction. Default: the URDF's `<dynamics>` (damping as viscous, friction as Coulomb), or none.
    pub friction: Option<FrictionSettings>,
    /// Lower hard stop (rad); may narrow the URDF's. Default: the URDF's; -2 pi for a `continuous`
    /// joint.
    pub position_lower_rad: Option<f64>,
    /// Upper hard stop (rad); may narrow the URDF's. Default: the URDF's; 2 pi for a `continuous`
    /// joint.
    pub position_upper_rad: Option<f64>,
    /// Joint speed that faults (rad/s). Default: the URDF's `velocity`.
    pub speed_rad_per_s: Option<f64>,
    /// Joint torque limit (N m). Default: the URDF's `effort`.
    pub torque_nm: Option<f64>,
    /// Greatest change of joint torque (N m/s). Default 1000.
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
    /// Greatest acceleration of a move (rad/s^2). Default 20.
    #[serde(default = "default::acceleration_rad_per_s2")]
    pub acceleration_rad_per_s2: f64,
    /// Greatest jerk of a move (rad/s^3). Default 1000.
    #[serde(default = "default::jerk_rad_per_s3")]
    pub jerk_rad_per_s3: f64,
    /// Observed external torque that ends the motion (N m). Default: 0.3 of `torque_nm`.
    pub collision_torque_nm: Option<f64>,
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

/// Friction of one joint: viscous and Coulomb, made continuous over a band, with an optional Stribeck
/// dip and offset.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FrictionSettings {
    /// Viscous friction (N m s/rad), zero or more. Default 0.
    #[serde(default)]
    pub viscous_nm_s_per_rad: f64,
    /// Coulomb friction in steady sliding (N m), zero or more. Default 0.
    #[serde(default)]
    pub coulomb_nm: f64,
    /// Torque that the Stribeck curve tends to at rest (N m), at least `coulomb_nm`. Default:
    /// `coulomb_nm`, no dip.
    pub breakaway_nm: Option<f64>,
    /// Speed over which the dip fades (rad/s), positive. Default 0.05.
    #[serde(default = "default::stribeck_rad_per_s")]
    pub stribeck_rad_per_s: f64,
    /// Torque that does not depend on the velocity (N m). Default 0.
    #[serde(default)]
    pub offset_nm: f64,
    /// Half-width of the band in which friction is a parabola (rad/s), positive. Default 0.01.
    #[serde(default = "default::band_rad_per_s")]
    pub band_rad_per_s: f64,
}

/// Motors and transmission. As many motors as moving joints.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MotorSettings {
    /// Where these numbers come from.
    pub source: Option<String>,
    /// `m2jp`, row by row: joint angles from motor angles, `q = m2jp p`. Motor torques are
    /// `m2jp^T tau`. Default: identity.
    pub joint_from_motor: Option<Vec<Vec<f64>>>,
    /// Torque limit of each motor, at the motor (N m).
    pub torque_nm: Vec<f64>,
    /// Least step of each motor's torque command, at the motor (N m), positive. Default: continuous.
    pub torque_quantum_nm: Option<Vec<f64>>,
    /// Torque of each motor per its speed when its terminals are shorted, `Kt^2 / R` (N m s/rad), positive: what
    /// brakes it in idle. Default: what stops the rotor alone with a time constant of 2 ms.
    pub braking_nm_s_per_rad: Option<Vec<f64>>,
    /// Encoder counts per motor revolution, positive. Default: continuous.
    pub counts_per_revolution: Option<u32>,
    /// Torque ripple that the motors are known to have, fed forward so that it cancels; at most 6
    /// harmonics a motor. Default: none.
    #[serde(default)]
    pub ripple: Vec<RippleSettings>,
}

/// A harmonic of a motor's torque over its angle: `sine sin(harmonic p) + cosine cos(harmonic p)`.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RippleSettings {
    /// Motor, counted from 0.
    pub motor: usize,
    /// Periods in a revolution of the motor, 1 or more.
    pub harmonic: u32,
    /// Amplitude of the sine, at the motor (N m).
    pub sine_nm: f64,
    /// Amplitude of the cosine, at the motor (N m).
    pub cosine_nm: f64,
}

/// Limits that are not one joint's.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LimitSettings {
    /// Where these numbers come from.
    pub source: Option<String>,
    /// Width of the zone before each hard stop in which a spring-damper pushes back (rad). Default 0.1.
    pub soft_zone_rad: f64,
    /// Tip speed that faults (m/s). Default 1.
    pub tip_speed_m_per_s: f64,
    /// Greatest acceleration of a tip trajectory (m/s^2). Default 10.
    pub tip_acceleration_m_per_s2: f64,
    /// Distance of the tip from its reference that faults while tracking or probing (m). Default 0.25.
    pub tracking_error_m: f64,
    /// Distance of a joint from where its own loop wants it that faults, on moves and where it is held
    /// (rad). Default 0.2.
    pub joint_tracking_error_rad: f64,
    /// Cycles without a new state that are tolerated. Default 1: a single lost encoder reply.
    pub stale_cycles: u32,
    /// Greatest distance of the tip from the start of a trajectory that is asked for (m). Default 0.02.
    pub start_error_m: f64,
    /// Greatest stiffness that may be asked for (N/m). Default 1000.
    pub greatest_stiffness_n_per_m: f64,
    /// Greatest damping that may be asked for (N s/m). Default 100.
    pub greatest_damping_n_s_per_m: f64,
}

/// External forces that end the motion: observed from motion and torques, without a sensor. The joints' own
/// thresholds are `collision_torque_nm` of each.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CollisionSettings {
    /// Where these numbers come from.
    pub source: Option<String>,
    /// Observed force on the tip (N). Default 60.
    pub tip_force_n: f64,
    /// Share of all thresholds that counts in the modes with stiff joint loops: move, excite, breakaway.
    /// Default 0.5.
    pub move_share: f64,
}

/// How far measurements, commands and model may be apart before one of them is taken to be wrong.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PlausibleSettings {
    /// Where these numbers come from.
    pub source: Option<String>,
    /// Lost replies of an encoder that are tolerated, where each is made up for by eight that came. Default 3.
    pub lost_replies: u32,
    /// Travel of a joint's reference in which its encoder may say the very same angle (rad). Default 0.05.
    pub stuck_rad: f64,
    /// Share of a joint's torque limit by which it may be driven one way while it gathers speed the other way.
    /// Default 0.05.
    pub against_share: f64,
    /// Force on the tip along gravity, in gravity hold and where a move has ended, that is a load which the model
    /// does not have (N). Default 5.
    pub load_n: f64,
}

/// Where the tip may be, base axes. Before every border is a margin in which the tip is pushed back.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct WorkspaceSettings {
    /// Where these numbers come from.
    pub source: Option<String>,
    /// Width of the margin (m). Default 0.05.
    pub margin_m: f64,
    /// Stiffness in the margin (N/m). Default 400.
    pub stiffness_n_per_m: f64,
    /// Damping in the margin, and of a tip that is too fast for its zone (N s/m). Default 20.
    pub damping_n_s_per_m: f64,
    /// Planes that the tip does not cross; at most 8 borders in all, a box to stay in counts six.
    pub wall: Vec<WallSettings>,
    /// A box that the tip stays in.
    pub keep_in: Option<BoxSettings>,
    /// Boxes that the tip stays out of.
    pub keep_out: Vec<BoxSettings>,
    /// Boxes with limits of their own; at most 8.
    pub zone: Vec<ZoneSettings>,
}

/// A plane: the tip stays where `normal . x <= offset_m`.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WallSettings {
    /// Points out of the allowed side; any length but zero.
    pub normal: [f64; 3],
    /// Distance from the base's origin along the normal (m).
    pub offset_m: f64,
}

/// A box with edges parallel to the base axes.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxSettings {
    /// Corner of the least coordinates (m).
    pub lower_m: [f64; 3],
    /// Corner of the greatest coordinates (m).
    pub upper_m: [f64; 3],
}

/// A box with limits of its own.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ZoneSettings {
    /// Corner of the least coordinates (m).
    pub lower_m: [f64; 3],
    /// Corner of the greatest coordinates (m).
    pub upper_m: [f64; 3],
    /// Tip speed that faults (m/s). Default: no other than everywhere.
    pub tip_speed_m_per_s: Option<f64>,
    /// Observed force on the tip that faults; the law's spring pushes with no more (N). Default: no other than
    /// everywhere.
    pub tip_force_n: Option<f64>,
}

/// Velocity at which the friction feed-forward is taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FrictionVelocity {
    /// Joint velocity of the reference: the error sees a dissipative difference.
    #[default]
    Reference,
    /// Estimated joint velocity: cancels the damping of the arm and runs away at low gains.
    Measured,
}

/// The impedance law.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LawSettings {
    /// Where these numbers come from.
    pub source: Option<String>,
    /// `K` along the base axes (N/m), zero or more. Default 5 on each.
    pub stiffness_n_per_m: [f64; 3],
    /// `B` along the base axes (N s/m), zero or more. Default 1.5 on each.
    pub damping_n_s_per_m: [f64; 3],
    /// `M`, chosen, base axes (kg), exactly symmetric, positive definite; needs a force sensor. Default: the
    /// arm's own.
    pub apparent_inertia_kg: Option<[[f64; 3]; 3]>,
    /// Velocity in the friction feed-forward. Default `reference`.
    pub friction_velocity: FrictionVelocity,
    /// Adds `M Xo''`. Default true.
    pub inertial_feedforward: bool,
    /// Damping of motions that do not move the tip, where more than three joints are active
    /// (N m s/rad), zero or more. Default 2.
    pub nullspace_damping_nm_s_per_rad: f64,
}

/// The contact latch: takes the friction feed-forward away when the tip has met something.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LatchSettings {
    /// Where these numbers come from.
    pub source: Option<String>,
    /// Fades the friction feed-forward on contact. Default true.
    pub fade: bool,
    /// Bandwidth of the momentum observer (rad/s). Default 40.
    pub observer_rad_per_s: f64,
    /// Force against the reference's motion that latches where friction is not in doubt (N). Default 3.
    pub threshold_n: f64,
    /// Relative error of the friction model in steady sliding. Default 0.05.
    pub friction_error: f64,
    /// Time after a reversal or start of the reference in which the threshold is doubled (s).
    /// Default 0.2.
    pub reversal_s: f64,
    /// Share of the dry friction feed-forward that stays on in contact. Default 0.
    pub contact_share: f64,
    /// Time for the feed-forward to fade to nothing (s). Default 0.01.
    pub fade_s: f64,
    /// Time for it to come back after release (s). Default 0.05.
    pub restore_s: f64,
}

/// What is mounted at the tip, in tip frame coordinates: force sensor and cap.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ToolSettings {
    /// Where these numbers come from.
    pub source: Option<String>,
    /// Mass (kg), positive. Default: none, the URDF's last link has it.
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
            greatest_stiffness_n_per_m: 1000.0,
            greatest_damping_n_s_per_m: 100.0,
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

impl Default for PlausibleSettings {
    fn default() -> Self {
        Self {
            source: None,
            lost_replies: 3,
            stuck_rad: 0.05,
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
            acceleration_rad_per_s2: default::acceleration_rad_per_s2(),
            jerk_rad_per_s3: default::jerk_rad_per_s3(),
            collision_torque_nm: None,
            hold_damping_nm_s_per_rad: default::hold_damping_nm_s_per_rad(),
        }
    }
}

impl From<FrictionSettings> for supple_core::Friction {
    fn from(f: FrictionSettings) -> Self {
        supple_core::Friction {
            viscous_nm_s_per_rad: f.viscous_nm_s_per_rad,
            coulomb_nm: f.coulomb_nm,
            breakaway_nm: f.breakaway_nm.unwrap_or(f.coulomb_nm),
            stribeck_rad_per_s: f.stribeck_rad_per_s,
            offset_nm: f.offset_nm,
            band_rad_per_s: f.band_rad_per_s,
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

/// The JSON schema of the TOML, as pretty-printed JSON with a trailing newline.
pub fn schema_json() -> String {
    let schema = schemars::schema_for!(Settings);
    let mut text = format!("{:#}", schema.as_value());
    text.push('\n');
    text
}
