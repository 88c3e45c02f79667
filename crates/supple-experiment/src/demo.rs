//! The paper's experiments, all of them: the main job.

use crate::error::ExperimentError;
use crate::job::{Done, Job, QUADRANT, QUADRANT_FAST, QUADRANT_PERTURBED, SEEDS, SPEEDS, jobs};
use crate::metrics::{LineFit, spread};
use crate::probing::{Stroke, median_stroke};
use crate::run::Run;
use crate::scenario;
use crate::setup::Setup;
use crate::summary::{
    AtSpeed, Contact, ExactModel, Exploration, QuadrantSummary, Summary, TorqueRms, Tracking,
};
use rayon::prelude::*;
use std::path::PathBuf;
use supple_model::{Description, with_dof};

/// What to run and where to put the logs.
#[derive(Clone, Debug)]
pub struct DemoOptions {
    /// Seed of the perturbed models and of every noise.
    pub seed: u64,
    /// Folder for one MCAP a run; it exists. `None` writes no logs.
    pub log_dir: Option<PathBuf>,
    /// What every controller knows of the arm, unperturbed; `None` for the arm's own parameters,
    /// perturbed where a run says so.
    pub model: Option<Description>,
}

/// How far the demo is.
#[derive(Clone, Debug)]
pub struct Progress {
    /// Simulated time done \[s\].
    pub done_s: f64,
    /// Simulated time in all \[s\].
    pub total_s: f64,
    /// The run that has just ended.
    pub finished: String,
}

/// A probing run.
#[derive(Clone, Debug)]
pub struct ProbingRun {
    /// The run.
    pub run: Run,
    /// Stroke by stroke.
    pub strokes: Vec<Stroke>,
    /// Its line of the summary.
    pub exploration: Exploration,
}

/// What the demo gave.
#[derive(Clone, Debug)]
pub struct Demo {
    /// All numbers.
    pub summary: Summary,
    /// Figure 3a and 4, at each pace.
    pub sinusoids: Vec<(f64, Run)>,
    /// The arc.
    pub arc: Run,
    /// Figure 3b; the same with the perturbed model; the same at the paper's greatest speed.
    pub quadrants: [Run; 3],
    /// Figures 5 and 6.
    pub probing: Vec<ProbingRun>,
    /// The same with the friction feed-forward left on in contact.
    pub probing_fade_off: Vec<ProbingRun>,
    /// (3.6) to the letter.
    pub paper_letter: Run,
}

/// Runs everything, on all cores.
///
/// # Errors
/// [`ExperimentError`]: an arm that cannot do the experiments, a log that cannot be written.
pub fn demo(
    description: &Description,
    options: &DemoOptions,
    progress: &(dyn Fn(&Progress) + Sync),
) -> Result<Demo, ExperimentError> {
    with_dof!(description.dof(), N => sized::<N>(description, options, progress))?
}

fn sized<const N: usize>(
    description: &Description,
    options: &DemoOptions,
    progress: &(dyn Fn(&Progress) + Sync),
) -> Result<Demo, ExperimentError> {
    let setup = match &options.model {
        Some(model) => Setup::<N>::with_model(description, model, options.seed)?,
        None => Setup::<N>::new(description, options.seed)?,
    };
    let jobs = jobs();
    let plans = jobs
        .iter()
        .map(|job| job.plan(&setup, options.seed))
        .collect::<Result<Vec<_>, _>>()?;
    let total_s = plans.iter().map(|plan| plan.duration_s).sum();
    let done_s = std::sync::Mutex::new(0.0);
    let results = jobs
        .par_iter()
        .zip(&plans)
        .map(|(job, plan)| {
            let done = job.run(plan, description, options)?;
            let mut done_s = done_s
                .lock()
                .unwrap_or_else(|poisoned| poisoned.into_inner());
            *done_s += plan.duration_s;
            progress(&Progress {
                done_s: *done_s,
                total_s,
                finished: plan.name.clone(),
            });
            Ok(done)
        })
        .collect::<Result<Vec<Done>, ExperimentError>>()?;
    Ok(assemble(description, options, &jobs, results))
}

fn tracking(run: &Run) -> Tracking {
    Tracking {
        rms_error_m: run.rms_error_m,
        max_error_m: run.max_error_m,
        ended: run.ended.clone(),
    }
}

fn exploration(stiffness_n_per_m: f64, done: &Done) -> Exploration {
    Exploration {
        stiffness_n_per_m,
        damping_n_s_per_m: scenario::gains(stiffness_n_per_m).damping_n_s_per_m.x,
        contact: median_stroke(&done.strokes),
        free_rms_m: done.free_rms_m,
        ended: done.run.ended.clone(),
    }
}

fn contact(explorations: &[Exploration]) -> Contact {
    let from_five = || {
        explorations
            .iter()
            .filter(|e| e.stiffness_n_per_m >= scenario::STIFFNESS_N_PER_M)
    };
    let points: Vec<_> = from_five()
        .map(|e| (e.stiffness_n_per_m, e.contact.impulse_newton_s))
        .collect();
    let peaks: Vec<_> = from_five().map(|e| e.contact.peak_filtered_n).collect();
    let over_speed: Vec<_> = from_five()
        .map(|e| e.contact.peak_filtered_n / e.contact.approach_m_per_s)
        .collect();
    Contact {
        impulse_fit: LineFit::new(&points),
        peak_spread: spread(&peaks),
        peak_over_speed_spread: spread(&over_speed),
    }
}

/// Hands every result to its place.
struct Results {
    jobs: Vec<Job>,
    done: Vec<Option<Done>>,
}

impl Results {
    fn take(&mut self, job: Job) -> Done {
        let place = self.jobs.iter().position(|other| *other == job);
        let done = place.and_then(|place| self.done[place].take());
        done.expect("every job is run once and taken once")
    }

    fn probing(&mut self, fade: bool) -> Vec<ProbingRun> {
        scenario::PROBING_STIFFNESS_N_PER_M
            .map(|stiffness_n_per_m| {
                let done = self.take(Job::Probing {
                    stiffness_n_per_m,
                    fade,
                });
                ProbingRun {
                    exploration: exploration(stiffness_n_per_m, &done),
                    run: done.run,
                    strokes: done.strokes,
                }
            })
            .into()
    }

    fn quadrant(&mut self, job: Job) -> (Run, QuadrantSummary) {
        let done = self.take(job);
        let speed_m_per_s = match job {
            Job::Quadrant { speed_m_per_s, .. } => speed_m_per_s,
            _ => 0.0,
        };
        let summary = QuadrantSummary {
            speed_m_per_s,
            tracking: tracking(&done.run),
            edges: done.edges,
        };
        (done.run, summary)
    }
}

fn assemble(
    description: &Description,
    options: &DemoOptions,
    jobs: &[Job],
    done: Vec<Done>,
) -> Demo {
    let mut results = Results {
        jobs: jobs.to_vec(),
        done: done.into_iter().map(Some).collect(),
    };
    let sinusoids: Vec<(f64, Run)> = SPEEDS
        .iter()
        .map(|speed| (*speed, results.take(Job::Sinusoid { speed: *speed }).run))
        .collect();
    let headline = &sinusoids[1].1;
    let arc = results.take(Job::Arc).run;
    let (slow, quadrant) = results.quadrant(QUADRANT);
    let (perturbed, quadrant_perturbed) = results.quadrant(QUADRANT_PERTURBED);
    let (fast, quadrant_at_paper_speed) = results.quadrant(QUADRANT_FAST);
    let probing = results.probing(true);
    let probing_fade_off = results.probing(false);
    let lines = |runs: &[ProbingRun]| -> Vec<Exploration> {
        runs.iter().map(|run| run.exploration.clone()).collect()
    };
    let exploration = lines(&probing);
    let exploration_fade_off = lines(&probing_fade_off);
    let paper_letter = results.take(Job::PaperLetter).run;
    let exact =
        |results: &mut Results, stribeck| tracking(&results.take(Job::Exact { stribeck }).run);
    let seed_runs: Vec<Tracking> = (0..SEEDS)
        .map(|seed| tracking(&results.take(Job::Seed(seed)).run))
        .collect();
    let summary = Summary {
        version: env!("CARGO_PKG_VERSION"),
        arm: description.name().to_owned(),
        seed: options.seed,
        model: options.model.as_ref().map(|model| {
            let source = model.settings().source.clone();
            source.unwrap_or_else(|| model.name().to_owned())
        }),
        sinusoid: tracking(headline),
        sinusoid_by_speed: sinusoids
            .iter()
            .map(|(speed, run)| AtSpeed {
                speed: *speed,
                tracking: tracking(run),
            })
            .collect(),
        arc: tracking(&arc),
        torque_rms: TorqueRms {
            shoulder_pitch: headline.torque_rms[0],
            elbow: headline.torque_rms[1],
        },
        quadrant,
        quadrant_perturbed,
        quadrant_at_paper_speed,
        contact: contact(&exploration),
        exploration,
        fade_off: contact(&exploration_fade_off),
        exploration_fade_off,
        sinusoid_exact_model: ExactModel {
            coulomb: exact(&mut results, false),
            stribeck: exact(&mut results, true),
        },
        paper_letter: tracking(&paper_letter),
        seeds: seed_runs.iter().map(|run| run.rms_error_m).collect(),
        seed_runs,
    };
    Demo {
        summary,
        sinusoids,
        arc,
        quadrants: [slow, perturbed, fast],
        probing,
        probing_fade_off,
        paper_letter,
    }
}
