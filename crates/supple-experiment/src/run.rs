//! One run: gravity hold, a stiff move to the start, then the trajectory under the impedance law.

use crate::error::ExperimentError;
use crate::metrics::Rms;
use crate::rig::{Cycle, Rig};
use crate::start::{active_joints, start_pose};
use crate::trace::{JointTorque, Sample, Trace, xyz};
use serde::Serialize;
use supple_core::controller::{Mode, Request};
use supple_core::dynamics::tip_pose;
use supple_core::{Config, Controller, Trajectory, Vector};
use supple_plant::PlantConfig;

/// Angle of the active joints from the start pose at which the plant begins \[rad\].
const AWAY_RAD: f64 = 0.1;
/// Gravity hold before the move \[s\].
const SETTLE_S: f64 = 0.1;
/// The move to the start \[s\].
const MOVE_S: f64 = 1.0;
/// Rest in the start pose before the trajectory \[s\].
const REST_S: f64 = 0.4;
/// What is still run after a fault, so that the safe action can be seen \[s\].
const AFTER_FAULT_S: f64 = 0.5;
/// Cycles between samples of the trace in free motion. A probing run keeps every cycle: its first
/// transient lasts a few of them.
const TRACE_EVERY: u64 = 10;

/// What to run.
#[derive(Clone, Debug)]
pub struct Plan<const N: usize> {
    /// Name of the experiment, and of its log.
    pub name: String,
    /// The controller's configuration: its model, its law, its gains.
    pub config: Config<N>,
    /// The plant with its scene.
    pub plant: PlantConfig<N>,
    /// What the tip is to follow.
    pub trajectory: Trajectory,
    /// For how long \[s\].
    pub duration_s: f64,
}

/// A run that a fault ended.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Ended {
    /// Time since the trajectory began \[s\].
    pub ended_s: f64,
    /// The fault, in words.
    pub fault: String,
}

/// What a run gave.
#[derive(Clone, Debug)]
pub struct Run {
    /// Name of the experiment.
    pub name: String,
    /// Distance of the true tip from its reference: root mean square and greatest \[m\].
    pub rms_error_m: f64,
    /// Greatest of it \[m\].
    pub max_error_m: f64,
    /// Root mean square of each torque term of shoulder pitch and elbow \[N m\].
    pub torque_rms: [JointTorque; 2],
    /// The fault that ended it early.
    pub ended: Option<Ended>,
    /// Samples for figures.
    pub trace: Trace,
    /// Simulated time with the way to the start \[s\].
    pub simulated_s: f64,
}

/// Sees every cycle of a run, with the time since the trajectory began \[s\], `None` on the way to the
/// start. An error ends the run.
pub type Watch<'a, const N: usize> =
    dyn FnMut(&Cycle<'_, N>, Option<f64>) -> Result<(), ExperimentError> + 'a;

/// Runs a plan. `watch` sees every cycle from the very first; its second argument is the time since the
/// trajectory began \[s\], `None` on the way to the start.
///
/// # Errors
/// [`ExperimentError`]; a fault while the trajectory runs is a result, see [`Run::ended`].
pub fn run<const N: usize>(
    plan: &Plan<N>,
    watch: &mut Watch<'_, N>,
) -> Result<Run, ExperimentError> {
    let controller = Controller::new(plan.config)?;
    let config = &plan.config;
    let start = start_pose(config, &plan.name, &plan.trajectory, plan.duration_s)?;
    let mut rig = Rig::new(controller, plan.plant.clone(), away_from(config, &start))?;
    let cycles = |seconds: f64| (seconds / config.period_s).round() as u64;
    let move_at = cycles(SETTLE_S);
    let track_at = move_at + cycles(MOVE_S + REST_S);
    let end = track_at + cycles(plan.duration_s);

    let active = active_joints(config);
    let shown = [active[1], active[2]];
    let mut error = Rms::default();
    let mut torques = [[Rms::default(); 4]; 2];
    let mut trace = Trace::default();
    let trace_every = match plan.trajectory {
        Trajectory::Probe(_) => 1,
        _ => TRACE_EVERY,
    };
    let mut ended: Option<(Ended, u64)> = None;
    let mut k = 0;
    while k < end && ended.as_ref().is_none_or(|(_, until)| k <= *until) {
        let request = match k {
            0 => Some(Request::GravityHold),
            _ if k == move_at => Some(Request::Move {
                target_rad: start,
                duration_s: MOVE_S,
            }),
            _ if k == track_at => Some(Request::Track(plan.trajectory)),
            _ => None,
        };
        let cycle = rig.cycle(request);
        let output = &cycle.output;
        if let Some(refusal) = output.refusal {
            return Err(ExperimentError::Refused {
                experiment: plan.name.clone(),
                refusal,
            });
        }
        let tracking = matches!(output.mode, Mode::Track | Mode::Probe);
        let time_s = tracking.then_some(output.mode_time_s);
        watch(&cycle, time_s)?;
        if let (Some(fault), None) = (output.fault, &ended) {
            if k < track_at {
                return Err(ExperimentError::FaultAtStart {
                    experiment: plan.name.clone(),
                    fault,
                });
            }
            let ended_s = (k - track_at) as f64 * config.period_s;
            let fault = fault.to_string();
            ended = Some((Ended { ended_s, fault }, k + cycles(AFTER_FAULT_S)));
        }
        if let (Some(time_s), Some(reference)) = (time_s, output.reference) {
            error.add((reference.position - cycle.truth.tip_position_m).norm());
            let terms = shown.map(|i| JointTorque::of(output, i));
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
    Ok(Run {
        name: plan.name.clone(),
        rms_error_m: error.rms(),
        max_error_m: error.greatest(),
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

/// A pose a little away from `start`, so that the move has something to do: each active joint turned the
/// way that lifts the tip, clear of whatever stands beneath; held joints in place.
fn away_from<const N: usize>(config: &Config<N>, start: &Vector<N>) -> Vector<N> {
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
        let (up, down) = (turned(AWAY_RAD), turned(-AWAY_RAD));
        q = if height(&up) >= height(&down) {
            up
        } else {
            down
        };
    }
    q
}
