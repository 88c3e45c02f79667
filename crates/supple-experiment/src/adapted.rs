//! If an arm cannot perform an experiment, the demo makes the experiment smaller, or leaves it out.
//!
//! The demo does this for arms whose settings are derived from a URDF, with the plant and the model of that URDF, because such an
//! arm may be unable to perform some of the paper's experiments. A fault of any other arm stays in the results.

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
    /// Size at which the experiment ran, relative to the arm's paths; absent if the demo left it out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<f64>,
    /// Reason why the experiment could not run at full size.
    pub reason: String,
}

/// Result of a job, and how the job was adapted.
pub(crate) struct JobOutcome {
    /// Result at the size in `adapted`; has no values if the job was left out.
    pub result: JobResult,
    /// Set if the job did not run at full size.
    pub adapted: Option<Adapted>,
}

/// Returns whether the demo adapts experiments that the arm cannot perform.
pub(crate) fn may_adapt(description: &Description, options: &DemoOptions) -> bool {
    description.has_derived_settings() && options.model.is_none() && options.plant.is_none()
}

/// Performs a job. If the arm cannot do it at full size and [`may_adapt`] permits it, performs it at a smaller size.
pub(crate) fn perform<const N: usize>(
    job: &Job,
    setup: &Setup<N>,
    description: &Description,
    options: &DemoOptions,
) -> Result<JobOutcome, ExperimentError> {
    if !may_adapt(description, options) {
        let plan = job.plan(setup, options.seed)?;
        let result = job.run(&plan, description, options)?;
        return Ok(JobOutcome {
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
                    return Ok(JobOutcome { result, adapted });
                }
            },
            Err(error) if is_arm_limitation(&error) => {
                remove_partial_log(job, options);
                error.to_string()
            }
            Err(error) => return Err(error),
        };
        first_reason.get_or_insert(reason);
    }
    let plan = job.plan(setup, options.seed).ok();
    Ok(JobOutcome {
        result: JobResult::left_out(job, plan.as_ref()),
        adapted: Some(Adapted {
            run: job.name(),
            scale: None,
            reason: first_reason.unwrap_or_default(),
        }),
    })
}

/// Removes the log of a run that did not begin.
fn remove_partial_log(job: &Job, options: &DemoOptions) {
    if let Some(folder) = &options.log_dir {
        // The file does not exist if the run was rejected before its log began.
        let _ = std::fs::remove_file(folder.join(format!("{}.mcap.part", job.name())));
    }
}

/// Returns whether the error means that the arm cannot perform the experiment.
fn is_arm_limitation(error: &ExperimentError) -> bool {
    matches!(
        error,
        ExperimentError::BeyondJointStop { .. }
            | ExperimentError::Refused { .. }
            | ExperimentError::Fault { .. }
            | ExperimentError::FaultAtStart { .. }
            | ExperimentError::Config(_)
    )
}

/// Returns the simulated time of a job, for the display of progress \[s\].
pub(crate) fn expected_s<const N: usize>(job: &Job, setup: &Setup<N>, seed: u64) -> f64 {
    let plan = job.plan(setup, seed);
    plan.map_or(0.0, |plan: Plan<N>| plan.duration_s)
}
