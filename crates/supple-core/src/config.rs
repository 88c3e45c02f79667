//! Everything that a controller is told before it starts. Plain data: [`crate::Controller::new`]
//! refuses what is not sound, so a `Controller` cannot be wrong.

use crate::arm::Arm;
use crate::friction::Friction;
use crate::math::{Matrix, Matrix3, Vector, Vector3};
pub use crate::ripple::RippleTable;
pub use crate::workspace::{Border, Workspace, Zone};

/// What a joint does while the impedance law runs.
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
    /// The same stiffness \[N/m\] and damping \[N s/m\] along every axis.
    pub fn isotropic(stiffness_n_per_m: f64, damping_n_s_per_m: f64) -> Gains {
        Gains {
            stiffness_n_per_m: Vector3::repeat(stiffness_n_per_m),
            damping_n_s_per_m: Vector3::repeat(damping_n_s_per_m),
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

/// The velocity at which the friction feed-forward is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrictionVelocity {
    /// `J^-1 Xo'`, the velocity of the reference. The default: the error then sees a dissipative
    /// difference.
    Reference,
    /// The estimated joint velocity, as (3.6) is printed: cancels all damping of the arm and runs away
    /// at low gains.
    Measured,
}

/// Choices within the law (3.6).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Law {
    /// `K` and `B` at start; they can be changed on request, by ramps.
    pub gains: Gains,
    /// `M`.
    pub inertia: ApparentInertia,
    /// Velocity in `D`.
    pub friction_velocity: FrictionVelocity,
    /// Adds `M Xo''`, which (3.3) lacks.
    pub inertial_feedforward: bool,
    /// Damping of motions that do not move the tip, where more than three joints are active
    /// \[N m s/rad\], zero or more.
    pub nullspace_damping_nm_s_per_rad: f64,
}

impl Law {
    /// Equation (3.6) to the letter, with the continuous (3.2): measured velocity in the friction, no
    /// `M Xo''`, the arm's own inertia.
    pub fn paper_letter(gains: Gains) -> Law {
        Law {
            gains,
            inertia: ApparentInertia::Own,
            friction_velocity: FrictionVelocity::Measured,
            inertial_feedforward: false,
            nullspace_damping_nm_s_per_rad: 0.0,
        }
    }
}

/// When friction feed-forward is taken away because the tip has met something.
///
/// The threshold on the observed force against the reference's motion is
/// `threshold_n + sum_i |(Jb d)_i| S_i (friction_error + exp(-(v_i / v_s)^2))`: what is known to be
/// uncertain about each joint's friction, seen along the direction `d` of the reference. A joint whose
/// reference `v_i` is slow may stick, and then all of its friction is in doubt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactLatch {
    /// Fades the friction feed-forward on contact. Without it the latch still reports.
    pub fade: bool,
    /// Bandwidth of the momentum observer \[rad/s\], positive.
    pub observer_rad_per_s: f64,
    /// Force against the reference's motion that latches where friction is not in doubt \[N\],
    /// positive.
    pub threshold_n: f64,
    /// Relative error of the friction model in steady sliding, zero or more.
    pub friction_error: f64,
    /// Time after a reversal or start of the reference in which the threshold is doubled \[s\].
    pub reversal_s: f64,
    /// Share of the dry friction feed-forward that stays on in contact, 0 to 1.
    pub contact_share: f64,
    /// Time in which the whole feed-forward would fade \[s\], positive.
    pub fade_s: f64,
    /// Time for it to come back after release \[s\], positive.
    pub restore_s: f64,
}

/// External forces that end the motion, as the momentum observer sees them. They are well above what an
/// inexact model leaves as a residual in free motion, dry friction included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collision<const N: usize> {
    /// External torque of a joint \[N m\], positive.
    pub joint_torque_nm: Vector<N>,
    /// Force on the tip \[N\], positive; away from singular poses.
    pub tip_force_n: f64,
    /// Share of both that ends motion in the modes with stiff joint loops (move, excite, breakaway), above 0,
    /// at most 1.
    pub move_share: f64,
}

impl<const N: usize> Collision<N> {
    /// No force ends the motion: what logs from before there were thresholds are replayed with.
    pub fn never() -> Collision<N> {
        Collision {
            joint_torque_nm: Vector::repeat(f64::MAX),
            tip_force_n: f64::MAX,
            move_share: 1.0,
        }
    }
}

/// How far measurements, commands and model may be apart before one of them is taken to be wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plausible {
    /// Lost replies of an encoder that are tolerated, where each is made up for by eight that came.
    pub lost_replies: u32,
    /// Travel of a joint's reference in which its encoder may say the very same angle \[rad\], positive.
    pub stuck_rad: f64,
    /// Share of a joint's torque limit by which it may be driven one way while it gathers speed the other way,
    /// positive.
    pub against_share: f64,
    /// Force on the tip along gravity that is a load which the model lacks, in gravity hold and where a move
    /// has ended \[N\], positive.
    pub load_n: f64,
}

impl Plausible {
    /// Everything is believed: what logs from before this was looked at are replayed with.
    pub fn anything() -> Plausible {
        Plausible {
            lost_replies: u32::MAX / 16,
            stuck_rad: f64::MAX,
            against_share: f64::MAX,
            load_n: f64::MAX,
        }
    }
}

/// Joint gains of the stiffer `move` mode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MoveGains<const N: usize> {
    /// Proportional gains \[N m/rad\], positive.
    pub stiffness_nm_per_rad: Vector<N>,
    /// Derivative gains \[N m s/rad\], zero or more.
    pub damping_nm_s_per_rad: Vector<N>,
}

/// Limits that the supervisor holds.
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
    /// Greatest acceleration of a tip trajectory that is asked for \[m/s^2\], positive.
    pub tip_acceleration_m_per_s2: f64,
    /// Greatest acceleration of a move that is asked for \[rad/s^2\], positive.
    pub joint_acceleration_rad_per_s2: Vector<N>,
    /// Greatest jerk of a move that is asked for \[rad/s^3\], positive.
    pub joint_jerk_rad_per_s3: Vector<N>,
    /// Distance of the tip from its reference that faults while tracking or probing \[m\], positive.
    pub tracking_error_m: f64,
    /// Distance of a joint from where its own loop wants it that faults, in the move mode and where it is
    /// held \[rad\], positive.
    pub joint_tracking_error_rad: f64,
    /// Joint torque limits \[N m\], positive.
    pub joint_torque_nm: Vector<N>,
    /// Motor torque limits \[N m\] at the motor, positive.
    pub motor_torque_nm: Vector<N>,
    /// Greatest change of joint torque \[N m/s\], positive.
    pub torque_rate_nm_per_s: Vector<N>,
    /// Cycles without a new state that are tolerated, whether the same state is seen again or states
    /// are missing.
    pub stale_cycles: u32,
    /// Greatest distance of the tip from the start of a trajectory that is asked for \[m\], positive.
    pub start_error_m: f64,
    /// Greatest stiffness that may be asked for \[N/m\], positive.
    pub stiffness_n_per_m: f64,
    /// Greatest damping that may be asked for \[N s/m\], positive.
    pub damping_n_s_per_m: f64,
}

/// All of it.
#[derive(Clone, Copy, Debug)]
pub struct Config<const N: usize> {
    /// The arm as the controller believes it.
    pub arm: Arm<N>,
    /// Friction as the controller believes it.
    pub friction: [Friction; N],
    /// What each joint does.
    pub roles: [Role; N],
    /// `m2jp`: joint angles from motor angles, `q = m2jp p`; motor torques are `m2jp^T tau`.
    pub joint_from_motor: Matrix<N, N>,
    /// Torque ripple of each motor, fed forward so that it cancels.
    pub ripple: [RippleTable; N],
    /// Cycle period \[s\], positive.
    pub period_s: f64,
    /// Bandwidth of the velocity estimator \[rad/s\], positive.
    pub estimator_rad_per_s: f64,
    /// The law.
    pub law: Law,
    /// The contact latch.
    pub latch: ContactLatch,
    /// Gains of the move mode.
    pub move_gains: MoveGains<N>,
    /// Joint damping of gravity hold \[N m s/rad\], zero or more.
    pub hold_damping_nm_s_per_rad: Vector<N>,
    /// Time over which a change of mode blends the torque \[s\], positive.
    pub handover_s: f64,
    /// Limits.
    pub limits: Limits<N>,
    /// External forces that end the motion.
    pub collision: Collision<N>,
    /// What is believed.
    pub plausible: Plausible,
    /// Where the tip may be.
    pub workspace: Workspace,
}
