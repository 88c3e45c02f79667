//! What the demo does with an experiment that an arm cannot perform: it is made smaller, or left out.
//!
//! This is for arms whose settings are derived from a URDF, with the plant and the model of that URDF: whether they can do all
//! of the paper's experiments is not known. A fault of any other arm is a result that nobody may overlook.

use crate::demo_options::DemoOptions;
use crate::error::ExperimentError;
use crate::job::{Job, JobResult};
use crate::run::Plan;
use crate::setup::Setup;
use serde::Serialize;
use supple_model::{Description, Paths};

/// Sizes that are tried, relative to the arm's paths.
const SCALES: [f64; 3] = [1.0, 0.5, 0.25];

/// An experiment that the arm cannot perform at the size of its paths.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Adapted {
    /// Name of the run, as in its log.
    pub run: String,
    /// Size at which it ran, relative to the arm's paths; absent if it was left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<f64>,
    /// Why it could not run at full size.
    pub reason: String,
}

/// What came of a run.
pub(crate) struct Performed {
    /// The result, of the size in `adapted`; of a run that was left out, without values.
    pub result: JobResult,
    /// Set if it did not run at full size.
    pub adapted: Option<Adapted>,
}

/// Whether experiments that the arm cannot perform are made smaller or left out.
pub(crate) fn may_adapt(description: &Description, options: &DemoOptions) -> bool {
    description.has_derived_settings() && options.model.is_none() && options.plant.is_none()
}

/// Performs a job, smaller if the arm cannot do it at full size and `may_adapt`.
pub(crate) fn perform<const N: usize>(
    job: &Job,
    setup: &Setup<N>,
    description: &Description,
    options: &DemoOptions,
) -> Result<Performed, ExperimentError> {
    if !may_adapt(description, options) {
        let plan = job.plan(setup, options.seed)?;
        let result = job.run(&plan, description, options)?;
        return Ok(Performed {
            result,
            adapted: None,
        });
    }
    let mut first_reason = None;
    for scale in SCALES {
        let paths = setup.paths();
        let smaller = setup.clone().with_paths(Paths {
            scale: paths.scale * scale,
            ..paths
        });
        let attempt = job
            .plan(&smaller, options.seed)
            .and_then(|plan| job.run(&plan, description, options));
        let reason = match attempt {
            Ok(result) => match &result.run.ended {
                Some(ended) if !job.may_fault() => {
                    format!("{} at {:.2} s", ended.fault, ended.ended_s)
                }
                _ => {
                    let adapted = first_reason.map(|reason| Adapted {
                        run: job.name(),
                        scale: Some(scale),
                        reason,
                    });
                    return Ok(Performed { result, adapted });
                }
            },
            Err(error) if is_of_the_arm(&error) => {
                remove_part(job, options);
                error.to_string()
            }
            Err(error) => return Err(error),
        };
        first_reason.get_or_insert(reason);
    }
    let plan = job.plan(setup, options.seed).ok();
    Ok(Performed {
        result: JobResult::left_out(job, plan.as_ref()),
        adapted: Some(Adapted {
            run: job.name(),
            scale: None,
            reason: first_reason.unwrap_or_default(),
        }),
    })
}

/// Removes the log of a run that did not begin.
fn remove_part(job: &Job, options: &DemoOptions) {
    if let Some(folder) = &options.log_dir {
        // It is not there if the run was rejected before its log began.
        let _ = std::fs::remove_file(folder.join(format!("{}.mcap.part", job.name())));
    }
}

/// Whether the error means that the arm cannot perform the experiment, not that something else is wrong.
fn is_of_the_arm(error: &ExperimentError) -> bool {
    matches!(
        error,
        ExperimentError::BeyondJointStop { .. }
            | ExperimentError::Refused { .. }
            | ExperimentError::Fault { .. }
            | ExperimentError::FaultAtStart { .. }
            | ExperimentError::Config(_)
    )
}

/// Simulated time of a job for the display of progress \[s\].
pub(crate) fn expected_s<const N: usize>(job: &Job, setup: &Setup<N>, seed: u64) -> f64 {
    let plan = job.plan(setup, seed);
    plan.map_or(0.0, |plan: Plan<N>| plan.duration_s)
}
