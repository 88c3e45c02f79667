//! What a fit would do at 5 N/m, before any arm moves: the sinusoid followed on the arm that was found by
//! controllers whose models differ from it as the fit's own uncertainty lets them.
//!
//! It knows the noise of the logs, not what the columns have no word for: on a real arm expect more.

use crate::error::ExperimentError;
use crate::metrics::median;
use crate::run::{Plan, run};
use crate::scenario;
use serde::Serialize;
use supple_ident::Fit;
use supple_model::Description;
use supple_plant::{LuGre, PlantConfig};

/// Greatest error that is called good at 5 N/m \[m\].
pub const GOOD_M: f64 = 0.010;

/// Tracking error to expect \[m\].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Foretold {
    /// Middle of the draws.
    pub median_m: f64,
    /// Worst of the draws.
    pub worst_m: f64,
    /// Draws that a fault ended.
    pub faults: usize,
}

/// Draws `draws` models and follows the sinusoid with each; `None` where the arm cannot reach it.
///
/// # Errors
/// [`ExperimentError`].
pub fn foretell<const N: usize>(
    identified: &Description,
    fit: &Fit<N>,
    draws: u64,
) -> Result<Option<Foretold>, ExperimentError> {
    let mut plant = PlantConfig::<N>::from_description(identified)?;
    plant.friction = plant.friction.map(LuGre::without_load);
    let (trajectory, duration_s) = scenario::sinusoid(1.0);
    let (mut errors, mut faults) = (Vec::new(), 0);
    for seed in 0..draws {
        let (arm, friction) = fit.draw(seed)?;
        let mut config = identified.config::<N>()?;
        config.arm = arm;
        for joint in fit.columns.moving() {
            config.friction[*joint] = friction[*joint];
        }
        config.law.gains = scenario::gains(scenario::STIFFNESS_N_PER_M);
        let plan = Plan {
            name: "sinusoid".to_owned(),
            config,
            plant: plant.clone(),
            trajectory,
            duration_s,
        };
        match run(&plan, &mut |_, _| Ok(())) {
            Ok(run) => {
                faults += usize::from(run.ended.is_some());
                errors.push(run.rms_error_m);
            }
            Err(ExperimentError::Unreachable { .. }) => return Ok(None),
            Err(error) => return Err(error),
        }
    }
    Ok(median(&errors).map(|median_m| Foretold {
        median_m,
        worst_m: errors.iter().copied().fold(0.0, f64::max),
        faults,
    }))
}

impl Foretold {
    /// In plain words.
    pub fn verdict(&self) -> String {
        let mm = |m: f64| format!("{:.1} mm", 1e3 * m);
        let (median, worst) = (mm(self.median_m), mm(self.worst_m));
        if self.faults > 0 {
            format!(
                "not good for 5 N/m: {} of the draws ended by a fault",
                self.faults
            )
        } else if self.worst_m <= GOOD_M {
            format!("good for 5 N/m: predicted tracking error {median}, worst {worst}")
        } else {
            format!(
                "not good for 5 N/m: predicted tracking error {median}, worst {worst}; excite longer, \
                 or work at a higher stiffness"
            )
        }
    }
}
