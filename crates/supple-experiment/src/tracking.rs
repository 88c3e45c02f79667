//! What a model that was found is worth: the sinusoid at 5 N/m, followed with it on the plant.

use crate::error::ExperimentError;
use crate::run::{Plan, run};
use crate::scenario;
use serde::Serialize;
use supple_model::Description;
use supple_plant::PlantConfig;

/// RMS error of the tip \[m\], by what the friction feed-forward knows and what the plant does.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Tracking {
    /// With viscous and Coulomb friction alone.
    pub coulomb_m: f64,
    /// With the Stribeck dip that was found.
    pub stribeck_m: f64,
}

/// Follows the sinusoid with the controller of `identified`; `None` where the arm cannot reach it.
///
/// # Errors
/// [`ExperimentError`]; a fault ends a run early, with the error up to there.
pub fn tracking<const N: usize>(
    identified: &Description,
    plant: &PlantConfig<N>,
) -> Result<Option<Tracking>, ExperimentError> {
    let error_m = |dip: bool| {
        let mut config = identified.config::<N>()?;
        config.law.gains = scenario::gains(scenario::STIFFNESS_N_PER_M);
        if !dip {
            for friction in &mut config.friction {
                friction.breakaway_nm = friction.coulomb_nm;
            }
        }
        let (trajectory, duration_s) = scenario::sinusoid(1.0);
        let plan = Plan {
            name: "sinusoid".to_owned(),
            config,
            plant: plant.clone(),
            trajectory,
            duration_s,
        };
        run(&plan, &mut |_, _| Ok(())).map(|run| run.rms_error_m)
    };
    let coulomb_m = match error_m(false) {
        Err(ExperimentError::Unreachable { .. }) => return Ok(None),
        found => found?,
    };
    Ok(Some(Tracking {
        coulomb_m,
        stribeck_m: error_m(true)?,
    }))
}
