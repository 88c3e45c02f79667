//! One run: gravity hold, a position-controlled move to the start, then the trajectory under the impedance law.

use crate::approach_time::approach_s;
use crate::error::ExperimentError;
use crate::metrics::Rms;
use crate::rig::{Cycle, Rig};
use crate::start::{active_joints, start_pose};
use crate::trace::{JointTorque, Sample, Trace, xyz};
use serde::Serialize;
use supple_core::config::Gains;
use supple_core::controller::{JointLabel, LearningSwitch, Mode, NamesJoints, Request};
use supple_core::dynamics::tip_pose;
use supple_core::{Config, Controller, Trajectory, Vector};
use supple_plant::PlantConfig;

/// Initial offset of the active joints from the start pose \[rad\].
const START_OFFSET_RAD: f64 = 0.1;
/// Duration of gravity hold before the move \[s\].
const SETTLE_S: f64 = 0.1;
/// Rest in the start pose before the trajectory \[s\].
const REST_S: f64 = 0.4;
/// Simulated time after a fault, to record the safe action \[s\].
const AFTER_FAULT_S: f64 = 0.5;
/// Cycles between samples of the trace in free motion. A probing run records every cycle, since its first
/// transient lasts a few cycles only.
const TRACE_EVERY: u64 = 10;

/// An experiment: controller, plant and trajectory.
#[derive(Clone, Debug)]
pub struct Plan<const N: usize> {
    /// Name of the experiment and of its log.
    pub name: String,
    /// Configuration of the controller: model, law and gains.
    pub config: Config<N>,
    /// The plant with its scene.
    pub plant: PlantConfig<N>,
    /// Trajectory of the tip.
    pub trajectory: Trajectory,
    /// Duration of the trajectory \[s\].
    pub duration_s: f64,
    /// Whether the model is refined while the arm moves.
    pub learning: bool,
    /// Change of the gains while the arm tracks.
    pub gain_change: Option<GainChange>,
}

/// A request for other gains while the arm tracks a trajectory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GainChange {
    /// Time of the request since the start of the trajectory \[s\].
    pub time_s: f64,
    /// The new gains.
    pub gains: Gains,
    /// Duration of the change \[s\].
    pub ramp_s: f64,
}

/// A fault that ended a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FaultEnd {
    /// Time since the start of the trajectory \[s\].
    pub ended_s: f64,
    /// The fault as text.
    pub fault: String,
}

/// Results of a run.
#[derive(Clone, Debug)]
pub struct Run {
    /// Name of the experiment.
    pub name: String,
    /// Root mean square distance of the true tip from its reference \[m\].
    pub rms_error_m: f64,
    /// Maximum distance of the true tip from its reference \[m\].
    pub max_error_m: f64,
    /// Root mean square of each torque term of the second and third active joint, shoulder pitch and elbow of a WAM
    /// \[N m\].
    pub torque_rms: [JointTorque; 2],
    /// The fault that ended the run early.
    pub ended: Option<FaultEnd>,
    /// Samples for figures.
    pub trace: Trace,
    /// Simulated time, including the move to the start \[s\].
    pub simulated_s: f64,
}

impl Run {
    /// Returns the result of a run that was left out: no samples, and errors that are not numbers.
    pub(crate) fn left_out(name: String) -> Run {
        Run {
            name,
            rms_error_m: f64::NAN,
            max_error_m: f64::NAN,
            torque_rms: [JointTorque::default(); 2],
            ended: None,
            trace: Trace::default(),
            simulated_s: 0.0,
        }
    }

    /// Returns whether the run has no samples: the demo left it out, or a fault ended it in its first cycle.
    pub fn is_left_out(&self) -> bool {
        self.trace.samples.is_empty()
    }
}

/// Function that [`run()`] calls after every cycle with the time since the start of the trajectory \[s\], `None` before the
/// trajectory and after a fault. An error of the function ends the run.
pub type CycleCallback<'a, const N: usize> =
    dyn FnMut(&Cycle<'_, N>, Option<f64>) -> Result<(), ExperimentError> + 'a;

/// Runs a plan and calls `on_cycle` after every cycle, see [`CycleCallback`].
///
/// # Errors
/// [`ExperimentError`]; a fault during the trajectory is a result, see [`Run::ended`].
pub fn run<const N: usize>(
    plan: &Plan<N>,
    on_cycle: &mut CycleCallback<'_, N>,
) -> Result<Run, ExperimentError> {
    let controller = Controller::new(plan.config)?;
    let config = &plan.config;
    let start = start_pose(config, &plan.name, &plan.trajectory, plan.duration_s)?;
    let from = offset_pose(config, &start);
    let move_s = approach_s(config, &from, &start);
    let mut rig = Rig::new(controller, plan.plant.clone(), from)?;
    if plan.learning {
        rig = rig.with_learner();
    }
    let cycles = |seconds: f64| (seconds / config.period_s).round() as u64;
    let move_at = cycles(SETTLE_S);
    let track_at = move_at + cycles(move_s + REST_S);
    let end = track_at + cycles(plan.duration_s);
    let change = plan.gain_change;
    let change = change.map(|change| (track_at + cycles(change.time_s).max(1), change));

    let active = active_joints(config);
    let plotted = [active[1], active[2]];
    let mut error = Rms::default();
    let mut torques = [[Rms::default(); 4]; 2];
    let mut trace = Trace::default();
    let trace_every = match plan.trajectory {
        Trajectory::Probe(_) => 1,
        _ => TRACE_EVERY,
    };
    let mut ended: Option<(FaultEnd, u64)> = None;
    let mut k = 0;
    while k < end && ended.as_ref().is_none_or(|(_, until)| k <= *until) {
        let request = match k {
            0 => Some(Request::GravityHold),
            1 if plan.learning => Some(Request::Learning(LearningSwitch::On)),
            _ if k == move_at => Some(Request::Move {
                target_rad: start,
                duration_s: move_s,
            }),
            _ if k == track_at => Some(Request::Track(plan.trajectory)),
            _ => change
                .filter(|(at, _)| k == *at)
                .map(|(_, change)| Request::Gains {
                    gains: change.gains,
                    ramp_s: change.ramp_s,
                }),
        };
        let cycle = rig.cycle(request);
        let output = &cycle.output;
        // The learner may send a request in the cycle of a fault.
        if let (Some(refusal), None) = (output.refusal, output.fault) {
            return Err(ExperimentError::Refused {
                experiment: plan.name.clone(),
                reason: in_words(config, &refusal),
            });
        }
        let tracking = matches!(output.mode, Mode::Track | Mode::Probe);
        let time_s = tracking.then_some(output.mode_time_s);
        on_cycle(&cycle, time_s)?;
        if let (Some(fault), None) = (output.fault, &ended) {
            if k < track_at {
                return Err(ExperimentError::FaultAtStart {
                    experiment: plan.name.clone(),
                    fault: in_words(config, &fault),
                });
            }
            let ended_s = (k - track_at) as f64 * config.period_s;
            let fault = in_words(config, &fault);
            ended = Some((FaultEnd { ended_s, fault }, k + cycles(AFTER_FAULT_S)));
        }
        if let (Some(time_s), Some(reference)) = (time_s, output.reference) {
            error.add((reference.position - cycle.truth.tip_position_m).norm());
            let terms = plotted.map(|i| JointTorque::of(output, i));
            for (sums, term) in torques.iter_mut().zip(&terms) {
                let JointTorque {
                    gravity,
                    friction,
                    inertial,
                    feedback,
                } = *term;
                for (sum, value) in sums.iter_mut().zip([gravity, friction, inertial, feedback]) {
                    sum.add(value);
                }
            }
            if (k - track_at).is_multiple_of(trace_every) {
                trace.samples.push(Sample {
                    time_s,
                    reference_m: xyz(&reference.position),
                    tip_m: xyz(&cycle.truth.tip_position_m),
                    torques: terms,
                    force_n: cycle.measurement.force_n.z,
                    in_contact: output.in_contact,
                });
            }
        }
        k += 1;
    }
    // After a fault in the first cycle there is no error value, which must not appear as an error of zero.
    let (rms_m, max_m) = match error.is_empty() {
        true => (f64::NAN, f64::NAN),
        false => (error.rms(), error.max_abs()),
    };
    Ok(Run {
        name: plan.name.clone(),
        rms_error_m: rms_m,
        max_error_m: max_m,
        torque_rms: torques.map(|[gravity, friction, inertial, feedback]| JointTorque {
            gravity: gravity.rms(),
            friction: friction.rms(),
            inertial: inertial.rms(),
            feedback: feedback.rms(),
        }),
        ended: ended.map(|(ended, _)| ended),
        trace,
        simulated_s: k as f64 * config.period_s,
    })
}

/// Returns the label of a joint in messages.
pub(crate) fn joint_label<const N: usize>(config: &Config<N>, joint: usize) -> String {
    JointLabel::new(joint, config.joint_names.as_slice()).to_string()
}

/// Returns a fault or a refusal in words, with the names of the joints.
pub(crate) fn in_words<const N: usize>(config: &Config<N>, message: &impl NamesJoints) -> String {
    message
        .with_names(config.joint_names.as_slice())
        .to_string()
}

/// Returns a pose near `start`, so that the initial move has a distance: each active joint is rotated in the
/// direction that lifts the tip away from obstacles below.
fn offset_pose<const N: usize>(config: &Config<N>, start: &Vector<N>) -> Vector<N> {
    let limits = &config.limits;
    let height = |q: &Vector<N>| tip_pose(&config.arm, q).translation.z;
    let mut q = *start;
    for i in active_joints(config) {
        let turned = |by: f64| {
            let mut turned = q;
            turned[i] = (q[i] + by).clamp(
                limits.position_lower_rad[i] + limits.soft_zone_rad,
                limits.position_upper_rad[i] - limits.soft_zone_rad,
            );
            turned
        };
        let (up, down) = (turned(START_OFFSET_RAD), turned(-START_OFFSET_RAD));
        q = if height(&up) >= height(&down) {
            up
        } else {
            down
        };
    }
    q
}
