//! Evaluates an identified model: tracks the sinusoid on the plant with a tip stiffness of 5 N/m.

use crate::error::ExperimentError;
use crate::run::{Plan, run};
use crate::scenario;
use serde::Serialize;
use supple_model::Description;
use supple_plant::PlantConfig;

/// RMS tip error \[m\] for two friction feed-forwards.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct IdentifiedModelTracking {
    /// With viscous and Coulomb friction only.
    pub coulomb_m: f64,
    /// With the identified Stribeck effect.
    pub stribeck_m: f64,
}

/// Tracks the sinusoid with a controller configured from `identified`; `None` if the arm cannot reach the sinusoid.
/// If a fault ends a run early, the tracking error is measured before the fault.
///
/// # Errors
/// [`ExperimentError`].
pub fn track_with_identified_model<const N: usize>(
    identified: &Description,
    plant: &PlantConfig<N>,
) -> Result<Option<IdentifiedModelTracking>, ExperimentError> {
    let error_m = |stribeck: bool| {
        let mut config = identified.config::<N>()?;
        config.law.gains = scenario::gains_like(&config.law.gains, scenario::STIFFNESS_N_PER_M);
        if !stribeck {
            for friction in &mut config.friction {
                friction.breakaway_nm = friction.coulomb_nm;
            }
        }
        let (trajectory, duration_s) = identified.paths().sinusoid(1.0);
        let plan = Plan {
            name: "sinusoid".to_owned(),
            config,
            plant: plant.clone(),
            trajectory,
            duration_s,
            learning: false,
            gain_change: None,
        };
        run(&plan, &mut |_, _| Ok(())).map(|run| run.rms_error_m)
    };
    let coulomb_m = match error_m(false) {
        Err(ExperimentError::BeyondJointStop { .. }) => return Ok(None),
        found => found?,
    };
    Ok(Some(IdentifiedModelTracking {
        coulomb_m,
        stribeck_m: error_m(true)?,
    }))
}
