//! The pose mode: the tip follows the sinusoid while it rotates, with every joint of a six- or seven-joint arm active.

use crate::error::ExperimentError;
use crate::metrics::Rms;
use crate::request_sequence::{RequestSequence, Step};
use crate::run::in_words;
use crate::scenario;
use crate::setup::{Setup, Variant};
use crate::start::spread_poses;
use serde::Serialize;
use supple_core::config::{Role, RotationalGains};
use supple_core::controller::{Request, check_motion};
use supple_core::dynamics::{Terms, terms, tip_pose};
use supple_core::inverse_kinematics::inverse_kinematics;
use supple_core::math::Vector3;
use supple_core::pose::rotation_vector;
use supple_core::task::Task;
use supple_core::trajectory::Rotation;
use supple_core::{Config, Controller, Trajectory, Vector};
use supple_plant::Scene;

/// Rotational stiffness \[N m/rad\].
const STIFFNESS_NM_PER_RAD: f64 = 0.5;
/// Angle of the rotation \[rad\].
const TURN_RAD: f64 = 0.4;
/// Duration of the rotation \[s\].
const TURN_S: f64 = 8.0;
/// Duration of gravity hold before the trajectory \[s\].
const SETTLE_S: f64 = 0.3;
/// Number of start poses that are tried.
const CANDIDATES: u32 = 100;
/// Number of points of a motion at which a start pose is evaluated.
const PATH_POINTS: u32 = 64;

/// Errors of the tip in the pose mode.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PoseTracking {
    /// Root mean square distance of the true tip from its reference \[m\].
    pub rms_error_m: f64,
    /// Maximum distance \[m\].
    pub max_error_m: f64,
    /// Root mean square angle between the true orientation of the tip and its reference \[rad\].
    pub rms_rotation_rad: f64,
    /// Maximum angle \[rad\].
    pub max_rotation_rad: f64,
}

/// Tracks the sinusoid at 5 N/m and a rotation by 0.4 rad about the vertical at 0.5 N m/rad, with every joint active.
///
/// # Errors
/// [`ExperimentError::Refused`] if no start pose of the arm allows the motion; [`ExperimentError::Fault`].
pub fn track_pose<const N: usize>(
    setup: &Setup<N>,
    variant: &Variant,
) -> Result<PoseTracking, ExperimentError> {
    const NAME: &str = "pose";
    let mut config = setup.config(variant)?;
    config.roles = [Role::Active; N];
    config.law.gains = scenario::gains_like(&config.law.gains, scenario::STIFFNESS_N_PER_M);
    config.pose.gains = RotationalGains {
        stiffness_nm_per_rad: Vector3::repeat(STIFFNESS_NM_PER_RAD),
        ..config.pose.gains
    };
    let (trajectory, duration_s) = setup.paths().sinusoid(1.0);
    let motion = PoseMotion {
        trajectory,
        rotation: Rotation {
            axis: Vector3::z(),
            angle_rad: TURN_RAD,
            duration_s: TURN_S,
        },
        duration_s,
    };
    let plant = setup.plant(variant, Scene::default());
    let true_arm = plant.arm;
    let sequence = RequestSequence {
        name: NAME.to_owned(),
        start_rad: pose_start(&config, NAME, &motion)?,
        config,
        plant,
        steps: vec![
            Step::wait(Request::GravityHold, SETTLE_S),
            Step::wait(motion.request(), duration_s),
        ],
    };
    let (mut distance, mut angle) = (Rms::default(), Rms::default());
    sequence.perform(&mut |cycle, _| {
        let output = &cycle.output;
        if let (Some(reference), Some(orientation)) = (output.reference, output.orientation) {
            let tip = tip_pose(&true_arm, &cycle.truth.position_rad);
            distance.add((reference.position - tip.translation).norm());
            let turn = orientation.base_from_tip * tip.rotation.transpose();
            angle.add(rotation_vector(&turn).norm());
        }
        Ok(())
    })?;
    Ok(PoseTracking {
        rms_error_m: distance.rms(),
        max_error_m: distance.max_abs(),
        rms_rotation_rad: angle.rms(),
        max_rotation_rad: angle.max_abs(),
    })
}

/// A motion of the tip's position and orientation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseMotion {
    /// Trajectory of the position.
    pub trajectory: Trajectory,
    /// Rotation of the orientation.
    pub rotation: Rotation,
    /// Duration \[s\].
    pub duration_s: f64,
}

impl PoseMotion {
    /// Returns the request of this motion.
    pub fn request<const N: usize>(&self) -> Request<N> {
        Request::TrackPose {
            trajectory: self.trajectory,
            rotation: self.rotation,
        }
    }
}

/// Selects a start pose from evenly spread poses with the tip at the start of the trajectory: the controller accepts the motion
/// from it, and errors of the friction model disturb the tip least.
///
/// # Errors
/// [`ExperimentError::Refused`] with the reason of the last pose if no pose allows the motion.
pub fn pose_start<const N: usize>(
    config: &Config<N>,
    experiment: &str,
    motion: &PoseMotion,
) -> Result<Vector<N>, ExperimentError> {
    let controller = Controller::new(*config)?;
    let limits = &config.limits;
    let start_m = motion.trajectory.at(0.0).position;
    let mut candidates: Vec<(f64, Vector<N>)> = spread_poses(config, CANDIDATES)
        .map(|seed| inverse_kinematics(&config.arm, &config.roles, limits, &seed, &start_m))
        .filter_map(|found| found.reached().then_some(found.position_rad))
        .map(|q| (friction_at_tip_n(config, motion, &q), q))
        .collect();
    candidates.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut refused = supple_core::controller::Refusal::Singular;
    for (_, q) in candidates {
        match check_motion(&controller, &q, &motion.request()) {
            Ok(()) => return Ok(q),
            Err(refusal) => refused = refusal,
        }
    }
    Err(ExperimentError::Refused {
        experiment: experiment.to_owned(),
        reason: in_words(config, &refused),
    })
}

/// Returns the maximum, along the motion, of the force on the tip to which the law's inverse maps the dry friction of all joints
/// (root of the sum of squares) \[N\]; [`f64::MAX`] if the motion reaches a singular pose. The joints move as the task's inverse
/// moves them.
fn friction_at_tip_n<const N: usize>(
    config: &Config<N>,
    motion: &PoseMotion,
    start_rad: &Vector<N>,
) -> f64 {
    let mut q = *start_rad;
    let mut state = Terms::default();
    let start = tip_pose(&config.arm, &q).rotation;
    let mut max_n2 = 0.0_f64;
    for k in 0..=PATH_POINTS {
        let time_s = motion.duration_s * f64::from(k) / f64::from(PATH_POINTS);
        terms(&config.arm, &q, &Vector::zeros(), &mut state);
        let Some(task) = Task::of_pose(&state, &config.roles).filter(|task| !task.is_damped) else {
            return f64::MAX;
        };
        let of_joint = |i: usize| {
            task.inverse.fixed_view::<1, 3>(i, 0).norm_squared()
                * config.friction[i].coulomb_nm.powi(2)
        };
        max_n2 = max_n2.max((0..N).map(of_joint).sum());
        let distance = motion.trajectory.at(time_s).position - state.base_from_tip.translation;
        let wanted = motion.rotation.at(&start, time_s).base_from_tip;
        let angle = rotation_vector(&(wanted * state.base_from_tip.rotation.transpose()));
        q += task.inverse * Vector::<6>::from_fn(|i, _| [distance, angle][i / 3][i % 3]);
    }
    max_n2.sqrt()
}
