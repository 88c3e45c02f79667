//! Report of an identification: one self-contained HTML file, and its summary.

use crate::figures::identification::{Curves, curves};
use askama::Template;
use serde::Serialize;
use supple_cli::exit::Failure;
use supple_experiment::TrackingPrediction;
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
    /// Logs that were fitted.
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
    pub held_out: Vec<HeldOut>,
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
    /// The predicted tracking error on which that verdict is based.
    pub foretold: Option<TrackingPrediction>,
}

/// Prediction of one log.
#[derive(Clone, Debug, Serialize)]
pub struct HeldOut {
    /// Name of the log.
    pub log: String,
    /// RMS error of each moving joint \[N m\].
    pub rms_nm: Vec<f64>,
    /// Relative error of each moving joint.
    pub relative: Vec<f64>,
    /// The same over all joints.
    pub total_relative: f64,
}

/// Friction of one joint.
#[derive(Clone, Debug, Serialize)]
pub struct JointFriction {
    /// Name of the joint.
    pub joint: String,
    /// `V`.
    pub viscous_nm_s_per_rad: f64,
    /// `S`.
    pub coulomb_nm: f64,
    /// `S_0`.
    pub breakaway_nm: f64,
    /// Offset.
    pub offset_nm: f64,
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
    /// The fit.
    pub fit: &'a Fit<N>,
    /// Names of the fitted logs.
    pub logs: Vec<String>,
    /// Held-out logs: name, motion, prediction.
    pub held_out: Vec<(String, Motion, Validation)>,
    /// Predicted tracking error; `None` if the arm cannot reach the sinusoid.
    pub predicted_tracking: Option<TrackingPrediction>,
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
            .map(|(log, _, v)| HeldOut {
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
                coulomb_nm: friction[j].coulomb_nm,
                breakaway_nm: friction[j].breakaway_nm,
                offset_nm: friction[j].offset_nm,
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
        verdict: input
            .held_out
            .first()
            .map_or_else(|| "not validated".to_owned(), |(_, _, v)| v.verdict()),
        verdict_at_5_n_per_m: input.predicted_tracking.as_ref().map_or_else(
            || "no prediction: the arm cannot reach the paper's sinusoid".to_owned(),
            TrackingPrediction::verdict,
        ),
        foretold: input.predicted_tracking.clone(),
    }
}

#[derive(Template)]
#[template(path = "identification.html")]
struct Page<'a> {
    summary: &'a Summary,
    version: &'static str,
    figures: Vec<(String, String, String)>,
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
    };
    page.render()
        .map_err(|error| Failure::ReportGeneration(error.to_string()))
}

/// Curves of measured and predicted torques, and of residuals.
fn drawn<const N: usize>(
    input: &ReportInput<'_, N>,
    motion: &Motion,
) -> Result<(String, String), Failure> {
    let fit = input.fit;
    let predicted: DMatrix<f64> = fit.predict_motion(motion)?;
    let every = motion.samples().div_ceil(POINTS).max(1);
    let (mut torques, mut residuals) = (Vec::new(), Vec::new());
    for (row, &joint) in fit.columns.moving().iter().enumerate() {
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
        curves("Measured and predicted torque of each joint", &torques)?,
        curves("Residual torque of each joint", &residuals)?,
    ))
}
