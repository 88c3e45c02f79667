//! Predicts the tracking error of an identified model at 5 N/m: simulates the identified arm with controllers
//! whose models are drawn from the uncertainty of the fit.
//!
//! The prediction includes log noise and friction that depends on load and direction as in every simulated arm, but no
//! other effects: learned parameters and compliance are left out in plant and controller. Expect larger errors on a real arm, as
//! `docs/effects.md` shows effect by effect.

use crate::error::ExperimentError;
use crate::metrics::median;
use crate::run::{Plan, run};
use crate::scenario;
use serde::Serialize;
use supple_core::Vector;
use supple_core::learned::LearnedTerms;
use supple_ident::Fit;
use supple_model::Description;
use supple_plant::PlantConfig;

/// Maximum error that counts as good at 5 N/m \[m\].
pub const GOOD_M: f64 = 0.010;

/// Predicted tracking error \[m\].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrackingPrediction {
    /// Median over the draws.
    pub median_m: Option<f64>,
    /// Maximum over the draws.
    pub worst_m: Option<f64>,
    /// Number of draws that ended in a fault.
    pub faults: usize,
    /// Reasons why trial runs failed or ended early, each reason once.
    pub reasons: Vec<String>,
}

/// Draws `draws` models and tracks the sinusoid with each; `None` if the arm cannot reach the sinusoid. The result contains the
/// reason why a trial run is impossible; this is not an error.
///
/// # Errors
/// [`ExperimentError`] for a description that is not one of `N` joints.
pub fn predict_tracking_error<const N: usize>(
    identified: &Description,
    fit: &Fit<N>,
    draws: u64,
) -> Result<Option<TrackingPrediction>, ExperimentError> {
    let plant = PlantConfig::<N>::from_description(identified)?;
    let (trajectory, duration_s) = identified.paths().sinusoid(1.0);
    let (mut errors, mut faults) = (Vec::new(), 0);
    let mut reasons: Vec<String> = Vec::new();
    let mut note = |reason: String| {
        if !reasons.contains(&reason) {
            reasons.push(reason);
        }
    };
    for seed in 0..draws {
        let (arm, friction) = match fit.draw(seed) {
            Ok(drawn) => drawn,
            Err(error) => {
                note(error.to_string());
                continue;
            }
        };
        let mut config = identified.config::<N>()?;
        config.arm = arm;
        // The simulated plant of a description has none of the effects that these parameters compensate.
        config.learned = LearnedTerms::zero();
        config.compliance_rad_per_nm = Vector::zeros();
        for joint in fit.columns.identified_joints() {
            config.friction[*joint] = friction[*joint];
        }
        config.law.gains = scenario::gains_like(&config.law.gains, scenario::STIFFNESS_N_PER_M);
        let plan = Plan {
            name: "sinusoid".to_owned(),
            config,
            plant: plant.clone(),
            trajectory,
            duration_s,
            learning: false,
            gain_change: None,
        };
        match run(&plan, &mut |_, _| Ok(())) {
            Ok(run) => {
                if let Some(ended) = &run.ended {
                    faults += 1;
                    note(format!("{} at {:.2} s", ended.fault, ended.ended_s));
                }
                errors.push(run.rms_error_m);
            }
            Err(ExperimentError::BeyondJointStop { .. }) => return Ok(None),
            Err(error) => note(error.to_string()),
        }
    }
    Ok(Some(TrackingPrediction {
        median_m: median(&errors),
        worst_m: errors.iter().copied().reduce(f64::max),
        faults,
        reasons,
    }))
}

impl TrackingPrediction {
    /// Returns the verdict as text.
    pub fn verdict(&self) -> String {
        let mm = |m: f64| format!("{:.1} mm", 1e3 * m);
        let reasons = self.reasons.join("; ");
        let (Some(median_m), Some(worst_m)) = (self.median_m, self.worst_m) else {
            return format!("no trial run at 5 N/m: {reasons}");
        };
        let (median, worst) = (mm(median_m), mm(worst_m));
        if self.faults > 0 {
            format!(
                "not good for 5 N/m: {} of the draws ended by a fault: {reasons}",
                self.faults
            )
        } else if worst_m <= GOOD_M {
            format!("good for 5 N/m: predicted tracking error {median}, worst {worst}")
        } else {
            format!(
                "not good for 5 N/m: predicted tracking error {median}, worst {worst}; excite longer, \
                 or work at a higher stiffness"
            )
        }
    }
}
