//! Report of an identification: one self-contained HTML file, and its summary.

use crate::figures::identification::{Curves, curves};
use askama::Template;
use serde::Serialize;
use supple_cli::exit::Failure;
use supple_core::Friction;
use supple_experiment::WeighingResult;
use supple_experiment::scenario::STIFFNESS_N_PER_M;
use supple_experiment::{ErrorInterval, NO_INTERVAL, TrackingPrediction, error_interval_of};
use supple_ident::{DMatrix, Fit, Motion, Validation};
use supple_model::Description;

/// Maximum number of points of a curve.
const POINTS: usize = 900;
/// Half-width of a 95 % confidence interval in standard deviations.
const CONFIDENCE: f64 = 1.96;

/// Summary of an identification.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Name of the arm.
    pub arm: String,
    /// Names of the fitted logs.
    pub logs: Vec<String>,
    /// Rank: number of identifiable parameter combinations.
    pub rank: usize,
    /// Number of columns of the regressor.
    pub columns: usize,
    /// Condition number of the base regressor, columns scaled to unit length.
    pub condition: f64,
    /// `|tau - tau_hat| / |tau|` on the training data.
    pub training_relative: f64,
    /// Prediction of the held-out data, per log.
    pub held_out: Vec<HeldOutPrediction>,
    /// Fraction of random poses with a positive definite mass matrix.
    pub positive_definite: f64,
    /// Friction of each joint.
    pub friction: Vec<JointFriction>,
    /// Base parameters with 95 % confidence intervals.
    pub base: Vec<BaseParameter>,
    /// Parameter directions that do not affect the torque.
    pub null_space: Vec<String>,
    /// Choices made by cross-validation, as tables.
    pub choices: Vec<(String, String)>,
    /// Warnings.
    pub warnings: Vec<String>,
    /// Verdict from the held-out data, as text.
    pub verdict: String,
    /// Verdict for 5 N/m, as text.
    pub verdict_at_5_n_per_m: String,
    /// Interval of the tracking error at 5 N/m from the held-out residuals; `None` without evidence or if the sinusoid is out of
    /// reach.
    pub interval_at_5_n_per_m: Option<ErrorInterval>,
    /// Result of the trial runs in simulation, as text: the tracking error that the uncertainty of the parameters alone would cause.
    pub trial_runs: String,
    /// Given and identified parameters of each link.
    pub links: Vec<LinkChange>,
    /// Mean residual of each moving joint over its angle, by direction, in the first held-out log.
    pub residual_over_angle: Vec<ResidualOverAngle>,
    /// Time from a logged torque to its action, for each held-out log \[s\]; negative if torques lag.
    pub torque_delay_s: Vec<f64>,
    /// The tracking error of the trial runs.
    pub foretold: Option<TrackingPrediction>,
    /// Torque scales by a weight of known mass, if one was logged.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weighing: Option<WeighingResult>,
}

/// Given and identified parameters of a link.
#[derive(Clone, Debug, Serialize)]
pub struct LinkChange {
    /// Name of the joint that moves the link.
    pub joint: String,
    /// Mass \[kg\].
    pub mass_kg: [f64; 2],
    /// Centre of mass in the link's joint frame \[m\].
    pub com_m: [[f64; 3]; 2],
    /// Rotor inertia of the joint \[kg m^2\].
    pub rotor_kg_m2: [f64; 2],
}

/// Mean residual of a joint over its angle.
#[derive(Clone, Debug, Serialize)]
pub struct ResidualOverAngle {
    /// Name of the joint.
    pub joint: String,
    /// Middle of each twelfth of the joint's range \[rad\].
    pub angle_rad: Vec<f64>,
    /// Mean residual there while the angle increases \[N m\]; none without a sample.
    pub forward_nm: Vec<Option<f64>>,
    /// Mean residual there while the angle decreases \[N m\]; none without a sample.
    pub backward_nm: Vec<Option<f64>>,
}

/// Prediction of one log.
#[derive(Clone, Debug, Serialize)]
pub struct HeldOutPrediction {
    /// Name of the log.
    pub log: String,
    /// RMS error of each moving joint \[N m\].
    pub rms_nm: Vec<f64>,
    /// Relative error of each moving joint.
    pub relative: Vec<f64>,
    /// Relative error over all joints.
    pub total_relative: f64,
}

/// Friction of one joint.
#[derive(Clone, Debug, Serialize)]
pub struct JointFriction {
    /// Name of the joint.
    pub joint: String,
    /// `V`.
    pub viscous_nm_s_per_rad: f64,
    /// `A`, half of the difference of the viscous friction between the positive and the negative direction \[N m s/rad\].
    pub viscous_asymmetry_nm_s_per_rad: f64,
    /// `S`.
    pub coulomb_nm: f64,
    /// `S_0`.
    pub breakaway_nm: f64,
    /// Offset.
    pub offset_nm: f64,
    /// `O_s`, torque at rest in addition to the offset \[N m\].
    pub stribeck_offset_nm: f64,
    /// `v_s`, the speed over which friction falls from `S_0` to `S` \[rad/s\].
    pub stribeck_rad_per_s: f64,
    /// Dry friction for each newton metre of load.
    pub load_coefficient: f64,
    /// Travel over which friction reverses after a reversal \[rad\].
    pub presliding_rad: f64,
    /// `V`, `S`, `S_0` and offset of the given arm, units as above.
    pub given: [f64; 4],
}

/// One base parameter.
#[derive(Clone, Debug, Serialize)]
pub struct BaseParameter {
    /// The combination as text.
    pub combination: String,
    /// Value of the combination.
    pub value: f64,
    /// Half the width of its 95 % confidence interval.
    pub interval: f64,
}

/// Input of the report.
pub struct ReportInput<'a, const N: usize> {
    /// The identified arm.
    pub arm: &'a Description,
    /// Friction of the given model, joint by joint.
    pub given_friction: Vec<Friction>,
    /// The fit.
    pub fit: &'a Fit<N>,
    /// Names of the fitted logs.
    pub logs: Vec<String>,
    /// Held-out logs: name, motion, prediction.
    pub held_out: Vec<(String, Motion, Validation)>,
    /// Predicted tracking error; `None` if the arm cannot reach the sinusoid.
    pub predicted_tracking: Option<TrackingPrediction>,
    /// Torque scales by a weight of known mass.
    pub weighing: Option<WeighingResult>,
}

/// Summarises a fit.
pub fn summary<const N: usize>(input: &ReportInput<'_, N>) -> Summary {
    let fit = input.fit;
    let values = fit.base_parameters();
    let combinations = fit.base.text(&fit.columns.names());
    let base = combinations
        .into_iter()
        .enumerate()
        .map(|(i, combination)| BaseParameter {
            combination,
            value: values[i],
            interval: CONFIDENCE * fit.base_std[i],
        });
    let friction = fit.friction_with(input.arm.friction());
    let names = input.arm.joint_names();
    let moving: Vec<String> = fit
        .columns
        .identified_joints()
        .iter()
        .map(|j| names[*j].clone())
        .collect();
    let named: Vec<(String, &Validation)> = input
        .held_out
        .iter()
        .map(|(log, _, validation)| (log.clone(), validation))
        .collect();
    let interval = interval(input);
    let delays_s = input
        .held_out
        .iter()
        .map(|(_, motion, _)| motion.torque_delay_s);
    Summary {
        arm: input.arm.name().to_owned(),
        logs: input.logs.clone(),
        rank: fit.rank(),
        columns: fit.columns.len(),
        condition: fit.condition(),
        training_relative: fit.training_relative,
        held_out: input
            .held_out
            .iter()
            .map(|(log, _, v)| HeldOutPrediction {
                log: log.clone(),
                rms_nm: v.rms_nm.clone(),
                relative: v.relative.clone(),
                total_relative: v.total_relative,
            })
            .collect(),
        positive_definite: input
            .held_out
            .iter()
            .map(|(_, _, v)| v.positive_definite)
            .fold(1.0, f64::min),
        friction: (0..N)
            .map(|j| JointFriction {
                joint: names[j].clone(),
                viscous_nm_s_per_rad: friction[j].viscous_nm_s_per_rad,
                viscous_asymmetry_nm_s_per_rad: friction[j].viscous_asymmetry_nm_s_per_rad,
                coulomb_nm: friction[j].coulomb_nm,
                breakaway_nm: friction[j].breakaway_nm,
                offset_nm: friction[j].offset_nm,
                stribeck_offset_nm: friction[j].stribeck_offset_nm,
                stribeck_rad_per_s: friction[j].stribeck_rad_per_s,
                load_coefficient: friction[j].load_coefficient,
                presliding_rad: friction[j].presliding_rad,
                given: given_friction(input, j),
            })
            .collect(),
        base: base.collect(),
        null_space: fit.base.null_space_text(&fit.columns.names()),
        choices: fit
            .choices
            .iter()
            .map(|choice| (choice.subject.to_owned(), choice.table.to_string()))
            .collect(),
        warnings: fit.warnings.iter().map(ToString::to_string).collect(),
        verdict: supple_ident::verdict(&named, &moving),
        verdict_at_5_n_per_m: at_5_n_per_m(interval.as_ref(), input, names),
        trial_runs: trial_runs(input.predicted_tracking.as_ref()),
        links: links(input, names),
        residual_over_angle: over_angle(input, names),
        interval_at_5_n_per_m: interval,
        torque_delay_s: delays_s.collect(),
        foretold: input.predicted_tracking.clone(),
        weighing: input.weighing.clone(),
    }
}

fn given_friction<const N: usize>(input: &ReportInput<'_, N>, joint: usize) -> [f64; 4] {
    let of = input.given_friction.get(joint);
    of.map_or([0.0; 4], |of| {
        [
            of.viscous_nm_s_per_rad,
            of.coulomb_nm,
            of.breakaway_nm,
            of.offset_nm,
        ]
    })
}

/// Describes the result of the trial runs.
fn trial_runs(found: Option<&TrackingPrediction>) -> String {
    let Some(found) = found else {
        return "no trial run: the arm cannot reach the paper's sinusoid".to_owned();
    };
    let reasons = found.reasons.join("; ");
    match (found.median_m, found.worst_m) {
        (Some(median_m), Some(worst_m)) if found.reasons.is_empty() => format!(
            "trial runs in simulation, with models drawn from the uncertainty of the parameters alone: tracking error {:.1} mm, \
             worst {:.1} mm",
            1e3 * median_m,
            1e3 * worst_m
        ),
        (Some(_), Some(_)) => format!("trial runs in simulation failed or ended early: {reasons}"),
        _ => format!("no trial run in simulation: {reasons}"),
    }
}

fn links<const N: usize>(input: &ReportInput<'_, N>, names: &[String]) -> Vec<LinkChange> {
    let given = input.fit.nominal();
    let Ok(found) = input.fit.arm() else {
        return Vec::new();
    };
    let both = |k: usize| [given.body(k), found.body(k)];
    let change = |k: usize| LinkChange {
        joint: names[k].clone(),
        mass_kg: both(k).map(|body| body.mass_kg),
        com_m: both(k).map(|body| body.com_m.into()),
        rotor_kg_m2: [given.armature()[k], found.armature()[k]],
    };
    (0..N).map(change).collect()
}

/// Number of parts into which [`ResidualOverAngle`] divides the range.
const CELLS: usize = 12;

fn over_angle<const N: usize>(
    input: &ReportInput<'_, N>,
    names: &[String],
) -> Vec<ResidualOverAngle> {
    let Some((_, motion, _)) = input.held_out.first() else {
        return Vec::new();
    };
    let Ok(predicted) = input.fit.predict_motion(motion) else {
        return Vec::new();
    };
    let of_joint = |(row, &joint): (usize, &usize)| {
        let angles = motion.q.column(joint);
        let (low, high) = (angles.min(), angles.max());
        let mut sums = [[(0.0, 0.0); CELLS]; 2];
        for i in 0..motion.samples() {
            let place = CELLS as f64 * (angles[i] - low) / (high - low).max(f64::MIN_POSITIVE);
            let cell = (place as usize).min(CELLS - 1);
            let sum = &mut sums[usize::from(motion.qd[(i, joint)] > 0.0)][cell];
            sum.0 += 1.0;
            sum.1 += motion.tau[(i, joint)] - predicted[(i, row)];
        }
        let means = |cells: &[(f64, f64); CELLS]| {
            let mean = |(n, sum): &(f64, f64)| (*n > 0.0).then(|| sum / n);
            cells.iter().map(mean).collect()
        };
        let middle = |cell: usize| low + (high - low) * (cell as f64 + 0.5) / CELLS as f64;
        ResidualOverAngle {
            joint: names[joint].clone(),
            angle_rad: (0..CELLS).map(middle).collect(),
            forward_nm: means(&sums[1]),
            backward_nm: means(&sums[0]),
        }
    };
    input
        .fit
        .columns
        .identified_joints()
        .iter()
        .enumerate()
        .map(of_joint)
        .collect()
}

/// Returns the interval of the tracking error at 5 N/m.
fn interval<const N: usize>(input: &ReportInput<'_, N>) -> Option<ErrorInterval> {
    let motions: Vec<_> = input.held_out.iter().map(|held_out| &held_out.1).collect();
    let moving = input.fit.columns.identified_joints();
    error_interval_of::<N>(input.arm, moving, &motions, STIFFNESS_N_PER_M).ok()?
}

/// Describes the verdict for 5 N/m, from the held-out residuals.
fn at_5_n_per_m<const N: usize>(
    interval: Option<&ErrorInterval>,
    input: &ReportInput<'_, N>,
    names: &[String],
) -> String {
    let Some(interval) = interval else {
        return NO_INTERVAL.to_owned();
    };
    let (log, joint) = interval.worst;
    let joint = format!("{} in {}", names[joint], input.held_out[log].0);
    interval.verdict(STIFFNESS_N_PER_M, &joint)
}

#[derive(Template)]
#[template(path = "identification.html")]
struct Page<'a> {
    summary: &'a Summary,
    version: &'static str,
    figures: Vec<(String, String, String)>,
    friction: String,
    over_angle: String,
}

/// Renders the HTML report.
///
/// # Errors
/// [`Failure::ReportGeneration`], [`Failure::Figure`].
pub fn html<const N: usize>(
    input: &ReportInput<'_, N>,
    summary: &Summary,
) -> Result<String, Failure> {
    let mut figures = Vec::new();
    for (name, motion, _) in &input.held_out {
        let (torques, residuals) = drawn(input, motion)?;
        figures.push((name.clone(), torques, residuals));
    }
    let page = Page {
        summary,
        version: env!("CARGO_PKG_VERSION"),
        figures,
        friction: friction_curves(input)?,
        over_angle: over_angle_curves(summary)?,
    };
    page.render()
        .map_err(|error| Failure::ReportGeneration(error.to_string()))
}

/// Greatest speed of the friction curves of a joint that does not move in the held-out logs \[rad/s\].
const CURVE_RAD_PER_S: f64 = 0.5;
/// Number of speeds of a friction curve.
const CURVE_POINTS: usize = 400;

/// Draws the friction of each identified joint over its speed in the held-out logs, without load: given and identified.
fn friction_curves<const N: usize>(input: &ReportInput<'_, N>) -> Result<String, Failure> {
    let found = input.fit.friction_with(input.arm.friction());
    let of_joint = |joint: &usize| {
        let (joint, given) = (*joint, input.given_friction.get(*joint).copied());
        let speeds = input
            .held_out
            .iter()
            .map(|(_, motion, _)| motion.qd.column(joint).amax());
        let greatest = match speeds.fold(0.0, f64::max) {
            0.0 => CURVE_RAD_PER_S,
            greatest => greatest,
        };
        let points = |friction: Friction| {
            let speed = |i: usize| greatest * (2.0 * i as f64 / CURVE_POINTS as f64 - 1.0);
            let point = |i| (speed(i), friction.torque_nm(speed(i)));
            (0..=CURVE_POINTS).map(point).collect()
        };
        Curves {
            title: input.arm.joint_names()[joint].clone(),
            unit: "friction [N m]",
            first: ("given", points(given.unwrap_or(Friction::NONE))),
            second: ("identified", points(found[joint])),
        }
    };
    let joints = input.fit.columns.identified_joints();
    let panels: Vec<Curves> = joints.iter().map(of_joint).collect();
    Ok(curves(
        "Friction of each joint over its speed, given and identified",
        "speed [rad/s]",
        &panels,
    )?)
}

/// Draws the mean residual of each joint over its angle, in both directions.
fn over_angle_curves(summary: &Summary) -> Result<String, Failure> {
    let of_joint = |of: &ResidualOverAngle| {
        let points = |means: &[Option<f64>]| {
            let pairs = of.angle_rad.iter().zip(means);
            pairs
                .filter_map(|(angle, mean)| mean.map(|nm| (*angle, nm)))
                .collect()
        };
        Curves {
            title: of.joint.clone(),
            unit: "residual [N m]",
            first: ("forwards", points(&of.forward_nm)),
            second: ("backwards", points(&of.backward_nm)),
        }
    };
    let panels: Vec<Curves> = summary.residual_over_angle.iter().map(of_joint).collect();
    Ok(curves(
        "Mean residual of each joint over its angle, forwards and backwards",
        "angle [rad]",
        &panels,
    )?)
}

/// Draws the curves of measured and predicted torques, and of residuals.
fn drawn<const N: usize>(
    input: &ReportInput<'_, N>,
    motion: &Motion,
) -> Result<(String, String), Failure> {
    let fit = input.fit;
    let predicted: DMatrix<f64> = fit.predict_motion(motion)?;
    let every = motion.samples().div_ceil(POINTS).max(1);
    let (mut torques, mut residuals) = (Vec::new(), Vec::new());
    for (row, &joint) in fit.columns.identified_joints().iter().enumerate() {
        let points = |value: &dyn Fn(usize) -> f64| -> Vec<(f64, f64)> {
            (0..motion.samples())
                .step_by(every)
                .map(|i| (i as f64 / motion.rate_hz, value(i)))
                .collect()
        };
        let title = input.arm.joint_names()[joint].clone();
        torques.push(Curves {
            title: title.clone(),
            unit: "torque [N m]",
            first: ("measured", points(&|i| motion.tau[(i, joint)])),
            second: ("predicted", points(&|i| predicted[(i, row)])),
        });
        residuals.push(Curves {
            title,
            unit: "residual [N m]",
            first: ("zero", points(&|_| 0.0)),
            second: (
                "measured - predicted",
                points(&|i| motion.tau[(i, joint)] - predicted[(i, row)]),
            ),
        });
    }
    Ok((
        curves(
            "Measured and predicted torque of each joint",
            "time [s]",
            &torques,
        )?,
        curves("Residual torque of each joint", "time [s]", &residuals)?,
    ))
}
