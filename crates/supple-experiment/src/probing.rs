//! Contact quantities of a probing run: one [`Stroke`] for each stroke.

use crate::error::ExperimentError;
use crate::metrics::{Mean, median};
use crate::run::{FaultEnd, Plan, run};
use serde::Serialize;
use supple_core::dynamics::{crba, jacobian};
use supple_core::nalgebra::Vector3;
use supple_core::trajectory::{Probe, ProbePhase};
use supple_core::{Arm, Output, Trajectory, Vector};
use supple_plant::{StepRecord, Truth};

/// Duration of the first transient, from the first touch on \[s\].
const TRANSIENT_S: f64 = 0.05;
/// Last part of the way down over which [`Stroke::rest_force_n`] is averaged \[s\].
const REST_S: f64 = 0.3;
/// Last part of the dwell over which the force while pressing is averaged \[s\].
const PRESSING_S: f64 = 0.5;

/// Contact in one stroke.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Stroke {
    /// Speed of the tip towards the block just before the first touch \[m/s\].
    pub approach_m_per_s: f64,
    /// Maximum vertical force of the first transient, as the 100 Hz filter of the sensor reports it \[N\].
    pub peak_filtered_n: f64,
    /// Time in contact from the start of this stroke to the start of the next, without the dwell, which the
    /// paper's cycle does not have \[s\].
    pub contact_s: f64,
    /// Integral of the vertical force over the same time \[N s\].
    pub impulse_newton_s: f64,
    /// Integral of the vertical force over the first impact, from the first touch until the tip leaves the block
    /// again \[N s\].
    pub impact_newton_s: f64,
    /// Speed at which the tip leaves the block after the first impact, over `approach_m_per_s`.
    pub restitution: f64,
    /// Integral, over the time of `impulse_newton_s` from the first touch on, of the commanded spring force `K (X - Xo)` with the
    /// true tip, where the force presses \[N s\].
    pub spring_impulse_newton_s: f64,
    /// Integral of the vertical force over the first 50 ms after the first touch \[N s\].
    pub impulse_first_50ms_newton_s: f64,
    /// Mean vertical force over the last 0.3 s of the way down \[N\]: while the reference slows down to rest, the
    /// friction feed-forward decreases to zero. For the force at rest see `pressing_force_n`.
    pub rest_force_n: f64,
    /// Mean vertical force while pressing: over the last 0.5 s of the dwell, in which the reference rests at the
    /// bottom of the stroke \[N\]. Zero without a dwell.
    pub pressing_force_n: f64,
    /// Mean commanded vertical spring force over the same time, `K (X - Xo)` with the true tip \[N\].
    pub spring_force_n: f64,
    /// Time from the first touch until contact was detected \[s\]; `None` if contact was not detected.
    pub latched_after_s: Option<f64>,
}

/// Strokes of a probing run.
#[derive(Clone, Debug, PartialEq)]
pub struct Strokes {
    /// The strokes.
    pub strokes: Vec<Stroke>,
    /// The fault that ended the run early; the last stroke is then incomplete.
    pub ended: Option<FaultEnd>,
}

/// Runs a plan whose trajectory is a [`Probe`]; returns its strokes, none for another trajectory.
///
/// # Errors
/// As [`run()`].
pub fn strokes<const N: usize>(plan: &Plan<N>) -> Result<Vec<Stroke>, ExperimentError> {
    Ok(probe(plan)?.strokes)
}

/// Does the same as [`strokes`]; also returns the fault that ended the run.
///
/// # Errors
/// As [`run()`].
pub fn probe<const N: usize>(plan: &Plan<N>) -> Result<Strokes, ExperimentError> {
    let Trajectory::Probe(probe) = plan.trajectory else {
        return Ok(Strokes {
            strokes: Vec::new(),
            ended: None,
        });
    };
    let mut contact = ContactAccumulator::new(probe);
    let run = run(plan, &mut |cycle, time_s| {
        if let Some(time_s) = time_s {
            contact.add_cycle(time_s, &cycle.truth, cycle.steps, &cycle.output);
        }
        Ok(())
    })?;
    Ok(Strokes {
        strokes: contact.finish(),
        ended: run.ended,
    })
}

/// Phase of the first impact of a stroke.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ImpactPhase {
    Before,
    Touching,
    /// The tip has left the block within the last cycle.
    Left,
    Over,
}

/// Collects strokes from the cycles of a run.
#[derive(Debug)]
pub struct ContactAccumulator {
    probe: Probe,
    current: Option<((u32, u32), Stroke)>,
    first_touch_s: Option<f64>,
    /// Phase of the first impact.
    impact: ImpactPhase,
    last_speed_m_per_s: f64,
    rest_n: Mean,
    pressing_n: Mean,
    spring_n: Mean,
    finished: Vec<Stroke>,
}

impl ContactAccumulator {
    /// Creates an accumulator for a probing cycle.
    pub fn new(probe: Probe) -> ContactAccumulator {
        ContactAccumulator {
            probe,
            current: None,
            first_touch_s: None,
            impact: ImpactPhase::Before,
            last_speed_m_per_s: 0.0,
            rest_n: Mean::default(),
            pressing_n: Mean::default(),
            spring_n: Mean::default(),
            finished: Vec::new(),
        }
    }

    /// Adds one controller cycle. `time_s` is the time since the start of the trajectory, `truth` the plant's
    /// state at the start of the cycle, `output` the controller's answer.
    pub fn add_cycle<const N: usize>(
        &mut self,
        time_s: f64,
        truth: &Truth<N>,
        steps: &[StepRecord],
        output: &Output<N>,
    ) {
        let (phase, phase_time_s, stroke, column) = self.probe.phase_at(time_s);
        let id = (column, stroke);
        if self.current.is_none_or(|(current, _)| current != id) {
            self.finish_stroke();
            self.current = Some((id, Stroke::default()));
        }
        let Some((_, record)) = &mut self.current else {
            return;
        };
        if self.impact == ImpactPhase::Left {
            self.impact = ImpactPhase::Over;
            record.restitution = truth.tip_velocity_m_per_s.z / record.approach_m_per_s;
        }
        let pull_n = output.reference.map_or(0.0, |reference| {
            let above_m = truth.tip_position_m.z - reference.position.z;
            output.gains.stiffness_n_per_m.z * above_m
        });
        let period_s = steps.last().map_or(0.0, |step| step.time_s - truth.time_s);
        if self.first_touch_s.is_some() && phase != ProbePhase::Dwell {
            record.spring_impulse_newton_s += pull_n.max(0.0) * period_s;
        }
        let mut before_s = truth.time_s;
        for step in steps {
            let dt_s = step.time_s - before_s;
            before_s = step.time_s;
            let force_n = step.force_n.z;
            if force_n > 0.0 && self.first_touch_s.is_none() {
                self.first_touch_s = Some(step.time_s);
                self.impact = ImpactPhase::Touching;
                record.approach_m_per_s = self.last_speed_m_per_s;
            }
            if self.impact == ImpactPhase::Touching {
                record.impact_newton_s += force_n * dt_s;
                if force_n <= 0.0 {
                    self.impact = ImpactPhase::Left;
                }
            }
            let outside_dwell = phase != ProbePhase::Dwell;
            if outside_dwell {
                record.impulse_newton_s += force_n * dt_s;
            }
            if outside_dwell && force_n > 0.0 {
                record.contact_s += dt_s;
            }
            if let Some(touch_s) = self.first_touch_s
                && step.time_s - touch_s < TRANSIENT_S
            {
                record.impulse_first_50ms_newton_s += force_n * dt_s;
                record.peak_filtered_n = record.peak_filtered_n.max(step.filtered_force_n.z);
            }
        }
        self.last_speed_m_per_s = -truth.tip_velocity_m_per_s.z;
        if output.in_contact && record.latched_after_s.is_none() {
            record.latched_after_s = self.first_touch_s.map(|touch_s| truth.time_s - touch_s);
        }
        let force_n = truth.contact_force_n.z;
        if phase == ProbePhase::Down && phase_time_s > self.probe.stroke_s() - REST_S {
            self.rest_n.add(force_n);
        }
        if phase == ProbePhase::Dwell && phase_time_s > self.probe.dwell_s - PRESSING_S {
            self.pressing_n.add(force_n);
            self.spring_n.add(pull_n);
        }
    }

    fn finish_stroke(&mut self) {
        if let Some((_, mut stroke)) = self.current.take() {
            stroke.rest_force_n = core::mem::take(&mut self.rest_n).mean();
            stroke.pressing_force_n = core::mem::take(&mut self.pressing_n).mean();
            stroke.spring_force_n = core::mem::take(&mut self.spring_n).mean();
            self.finished.push(stroke);
        }
        (self.first_touch_s, self.impact) = (None, ImpactPhase::Before);
    }

    /// Returns all strokes, including the unfinished last one.
    pub fn finish(mut self) -> Vec<Stroke> {
        self.finish_stroke();
        self.finished
    }
}

/// Returns the effective mass of the tip along `direction`, a unit vector, at the pose `q`: `1 / (n' J H^-1 J' n)`
/// \[kg\], for joints that are free to move. `None` if the pose is singular.
pub fn effective_mass_kg<const N: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
    direction: &Vector3<f64>,
) -> Option<f64> {
    let turning = jacobian(arm, q).fixed_rows::<3>(0).tr_mul(direction);
    let mobility = crba(arm, q).cholesky()?.solve(&turning).dot(&turning);
    (mobility > 0.0).then(|| 1.0 / mobility)
}

/// Returns the median of each quantity over the strokes.
pub fn median_stroke(strokes: &[Stroke]) -> Stroke {
    let median_of = |entry: &dyn Fn(&Stroke) -> f64| {
        let values: Vec<f64> = strokes.iter().map(entry).collect();
        median(&values).unwrap_or_default()
    };
    let latched: Vec<f64> = strokes.iter().filter_map(|s| s.latched_after_s).collect();
    Stroke {
        approach_m_per_s: median_of(&|s| s.approach_m_per_s),
        peak_filtered_n: median_of(&|s| s.peak_filtered_n),
        contact_s: median_of(&|s| s.contact_s),
        impulse_newton_s: median_of(&|s| s.impulse_newton_s),
        impact_newton_s: median_of(&|s| s.impact_newton_s),
        restitution: median_of(&|s| s.restitution),
        spring_impulse_newton_s: median_of(&|s| s.spring_impulse_newton_s),
        impulse_first_50ms_newton_s: median_of(&|s| s.impulse_first_50ms_newton_s),
        rest_force_n: median_of(&|s| s.rest_force_n),
        pressing_force_n: median_of(&|s| s.pressing_force_n),
        spring_force_n: median_of(&|s| s.spring_force_n),
        latched_after_s: median(&latched),
    }
}
