//! Evaluates an identified model: tracks the sinusoid on the plant with a tip stiffness of 5 N/m.

use crate::effects::result_or_error;
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

/// Tracks the sinusoid with a controller configured from `identified`. A sinusoid that the arm cannot reach or start is a result:
/// the reason. If a fault ends a run early, the tracking error is measured before the fault.
///
/// # Errors
/// [`ExperimentError`].
pub fn track_with_identified_model<const N: usize>(
    identified: &Description,
    plant: &PlantConfig<N>,
) -> Result<Result<IdentifiedModelTracking, String>, ExperimentError> {
    let error_m = |stribeck: bool| {
        let mut config = identified.config::<N>()?;
        config.law.gains = scenario::gains_like(&config.law.gains, scenario::STIFFNESS_N_PER_M);
        if !stribeck {
            for friction in &mut config.friction {
                friction.breakaway_nm = friction.coulomb_nm;
                friction.stribeck_offset_nm = 0.0;
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
    let both = || {
        Ok(IdentifiedModelTracking {
            coulomb_m: error_m(false)?,
            stribeck_m: error_m(true)?,
        })
    };
    match both() {
        Err(error @ ExperimentError::BeyondJointStop { .. }) => Ok(Err(error.to_string())),
        found => result_or_error(found),
    }
}
