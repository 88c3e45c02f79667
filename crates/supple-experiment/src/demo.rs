//! Runs all experiments of the paper.

use crate::adapted::{Adapted, JobOutcome, expected_s, may_adapt, perform};
use crate::calibrated_runs::{CalibratedRuns, SEED_S, calibrated_seed};
use crate::demo_options::DemoOptions;
use crate::effects::{calibrated, result_or_error};
use crate::error::ExperimentError;
use crate::job::{
    Job, JobResult, ProbingVariant, QUADRANT, QUADRANT_FAST, QUADRANT_PERTURBED, SEEDS, SPEEDS,
    jobs,
};
use crate::metrics::{LineFit, spread};
use crate::probing::{Stroke, median_stroke};
use crate::run::Run;
use crate::scenario;
use crate::setup::Setup;
use crate::summary::{
    ContactStatistics, DerivedArm, ExactModel, ImpulseSlope, ProbingSummary, QuadrantSummary,
    Summary, TorqueRms, TrackingAtSpeed, TrackingError,
};
use rayon::prelude::*;
use supple_core::trajectory::Quadrant;
use supple_model::{Description, Paths, tip_weight_n, with_dof};
use supple_plant::PlantOptions;

/// Maximum number of calibrated arms without effects of a real one.
const IDEAL_SEEDS: u64 = 3;

/// Progress of the demo.
#[derive(Clone, Debug)]
pub struct Progress {
    /// Planned simulated time of the completed runs \[s\].
    pub done_s: f64,
    /// Planned simulated time of all runs \[s\].
    pub total_s: f64,
    /// Name of the last completed run.
    pub finished: String,
}

/// A probing run.
#[derive(Clone, Debug)]
pub struct ProbingRun {
    /// The run.
    pub run: Run,
    /// Contact of each stroke.
    pub strokes: Vec<Stroke>,
    /// Summary of the run.
    pub summary: ProbingSummary,
}

/// Results of the demo.
#[derive(Clone, Debug)]
pub struct Demo {
    /// All numbers.
    pub summary: Summary,
    /// Figures 3a and 4, for each speed factor.
    pub sinusoids: Vec<(f64, Run)>,
    /// The arc.
    pub arc: Run,
    /// Figure 3b: with the exact model, with the perturbed model, at the paper's maximum speed, and at that speed with
    /// more damping and with ramps at the corners.
    pub quadrants: [(Quadrant, Run); 5],
    /// Figures 5 and 6.
    pub probing: Vec<ProbingRun>,
    /// Probing with the friction feed-forward left on in contact.
    pub probing_fade_off: Vec<ProbingRun>,
    /// Probing on rubber, at 5 and 125 N/m.
    pub probing_rubber: Vec<ProbingRun>,
    /// Equation (3.6) exactly as printed.
    pub law_as_printed: Run,
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
    let setup = setup.with_plant_options(&options.plant)?;
    let model = match options.model {
        Some(_) => None,
        None => Some(result_or_error(calibrated::<N>(
            description,
            &options.plant,
            options.seed,
        ))?),
    };
    let probing_setup = match &model {
        Some(Ok(model)) => Setup::<N>::with_model(description, model, options.seed)?
            .with_plant_options(&options.plant)?,
        _ => setup.clone(),
    };
    let setup_of = |job: &Job| match job.uses_identified_model() {
        true => &probing_setup,
        false => &setup,
    };
    let (realistic_plant, realistic_model) = realistic_arm(description, options);
    let jobs = jobs();
    let expected = |job: &Job| expected_s(job, &setup, options.seed);
    let seeds = options.realistic_seeds;
    let ideal_seeds = match options.plant.is_none() && options.model.is_none() {
        true => seeds.min(IDEAL_SEEDS),
        false => 0,
    };
    let total_s = jobs.iter().map(expected).sum::<f64>() + (seeds + ideal_seeds) as f64 * SEED_S;
    let done_s = std::sync::Mutex::new(0.0);
    let report = |duration_s: f64, finished: String| {
        let mut done_s = done_s
            .lock()
            .unwrap_or_else(|poisoned| poisoned.into_inner());
        *done_s += duration_s;
        progress(&Progress {
            done_s: *done_s,
            total_s,
            finished,
        });
    };
    let results = jobs
        .par_iter()
        .map(|job| {
            let done = perform(job, setup_of(job), description, options)?;
            report(expected(job), job.name());
            Ok(done)
        })
        .collect::<Result<Vec<JobOutcome>, ExperimentError>>()?;
    let adapted = results.iter().filter_map(|done| done.adapted.clone());
    let adapted: Vec<Adapted> = adapted.collect();
    let results = results.into_iter().map(|done| done.result).collect();
    let runs = |name: &'static str, plant: &PlantOptions, count: u64| {
        let of_seed = |offset: u64| {
            let seed = options.seed.wrapping_add(offset);
            let found = match (realistic_model, &model) {
                (Some(given), _) => Ok(given.clone()),
                (None, Some(first)) if offset == 0 && *plant == options.plant => first.clone(),
                _ => result_or_error(calibrated::<N>(description, plant, seed))?,
            };
            let done = match found {
                Ok(model) => calibrated_seed::<N>(description, &model, plant, seed)?,
                Err(reason) => Err(reason),
            };
            report(SEED_S, format!("{name} plant, seed {seed}"));
            Ok(done)
        };
        let found = (0..count).into_par_iter().map(of_seed);
        let found = found.collect::<Result<Vec<_>, ExperimentError>>()?;
        Ok::<_, ExperimentError>((count > 0).then(|| CalibratedRuns::of(&found)))
    };
    let realistic = runs("realistic", &realistic_plant, seeds)?;
    let ideal = runs("ideal", &options.plant, ideal_seeds)?;
    let mut demo = assemble(description, options, &jobs, results);
    demo.summary.realistic = realistic;
    demo.summary.ideal = ideal;
    demo.summary.not_identified = model.and_then(Result::err);
    demo.summary.adapted = adapted;
    if may_adapt(description, options) {
        let tip_weight_n = tip_weight_n::<N>(description)?;
        demo.summary.derived = Some(DerivedArm {
            tip_weight_n,
            allowed_error_m: scenario::allowed_error_m(tip_weight_n),
        });
    }
    Ok(demo)
}

/// Returns the effects of the arm of the realistic runs, and the model that they use instead of calibrating.
fn realistic_arm<'a>(
    description: &Description,
    options: &'a DemoOptions,
) -> (PlantOptions, Option<&'a Description>) {
    match options.plant.is_none() {
        // A given model belongs to another plant, so each seed is calibrated.
        true => (PlantOptions::realistic_of(description), None),
        false => (options.plant.clone(), options.model.as_ref()),
    }
}

fn tracking(run: &Run) -> TrackingError {
    TrackingError {
        rms_error_m: run.rms_error_m,
        max_error_m: run.max_error_m,
        ended: run.ended.clone(),
    }
}

fn probing_summary(stiffness_n_per_m: f64, done: &JobResult) -> ProbingSummary {
    let contact = median_stroke(&done.strokes);
    ProbingSummary {
        stiffness_n_per_m,
        damping_n_s_per_m: done.damping_n_s_per_m,
        effective_mass_kg: done.effective_mass_kg,
        impact_theory_newton_s: done.effective_mass_kg
            * contact.approach_m_per_s
            * (1.0 + contact.restitution),
        contact,
        free_rms_m: done.free_rms_m,
        ended: done.run.ended.clone(),
    }
}

fn contact(runs: &[ProbingSummary]) -> ContactStatistics {
    let from_paper_stiffness = || {
        runs.iter()
            .filter(|e| e.stiffness_n_per_m >= scenario::STIFFNESS_N_PER_M)
    };
    let points: Vec<_> = from_paper_stiffness()
        .map(|e| (e.stiffness_n_per_m, e.contact.impulse_newton_s))
        .collect();
    let peaks: Vec<_> = from_paper_stiffness()
        .map(|e| e.contact.peak_filtered_n)
        .collect();
    let per_approach_speed: Vec<_> = from_paper_stiffness()
        .map(|e| e.contact.peak_filtered_n / e.contact.approach_m_per_s)
        .collect();
    ContactStatistics {
        impulse_fit: LineFit::new(&points),
        impulse_slopes: slopes(runs),
        peak_spread: spread(&peaks),
        peak_per_approach_speed_spread: spread(&per_approach_speed),
    }
}

fn slopes(runs: &[ProbingSummary]) -> Vec<ImpulseSlope> {
    let pairs = runs.windows(2);
    pairs
        .map(|pair| {
            let (low, high) = (&pair[0], &pair[1]);
            let (from_n_per_m, to_n_per_m) = (low.stiffness_n_per_m, high.stiffness_n_per_m);
            let impulse_newton_s = high.contact.impulse_newton_s - low.contact.impulse_newton_s;
            ImpulseSlope {
                from_n_per_m,
                to_n_per_m,
                slope: impulse_newton_s / (to_n_per_m - from_n_per_m),
            }
        })
        .collect()
}

/// Results of all jobs, from which each result is taken once.
struct JobResults {
    paths: Paths,
    jobs: Vec<Job>,
    done: Vec<Option<JobResult>>,
}

impl JobResults {
    fn take(&mut self, job: Job) -> JobResult {
        let index = self.jobs.iter().position(|other| *other == job);
        let done = index.and_then(|index| self.done[index].take());
        done.expect("every job is run once and taken once")
    }

    fn probing(&mut self, stiffness: &[f64], kind: ProbingVariant) -> Vec<ProbingRun> {
        let runs = stiffness.iter().filter_map(|stiffness_n_per_m| {
            let stiffness_n_per_m = *stiffness_n_per_m;
            let done = self.take(Job::Probing {
                stiffness_n_per_m,
                kind,
            });
            (!done.run.is_left_out()).then(|| ProbingRun {
                summary: probing_summary(stiffness_n_per_m, &done),
                run: done.run,
                strokes: done.strokes,
            })
        });
        runs.collect()
    }

    fn quadrant(&mut self, job: Job) -> ((Quadrant, Run), QuadrantSummary) {
        let done = self.take(job);
        let quadrant = done.quadrant.unwrap_or_else(|| job.quadrant(&self.paths).0);
        let summary = QuadrantSummary {
            speed_m_per_s: quadrant.speed_m_per_s(),
            tracking: tracking(&done.run),
            edges: done.edges,
        };
        ((quadrant, done.run), summary)
    }
}

fn assemble(
    description: &Description,
    options: &DemoOptions,
    jobs: &[Job],
    done: Vec<JobResult>,
) -> Demo {
    let mut results = JobResults {
        paths: description.paths(),
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
    let (damped, quadrant_damped) = results.quadrant(Job::QuadrantDamped);
    let (ramped, quadrant_corner_ramp) = results.quadrant(Job::QuadrantCornerRamp);
    let all = &scenario::PROBING_STIFFNESS_N_PER_M;
    let two = &scenario::PAPER_STIFFNESS_N_PER_M;
    let probing = results.probing(all, ProbingVariant::Plain);
    let probing_fade_off = results.probing(all, ProbingVariant::FadeOff);
    let [probing_exact, probing_rubber, probing_apparent] =
        ProbingVariant::AT_TWO.map(|kind| results.probing(two, kind));
    let apparent_inertia = results.take(Job::ApparentInertia).run;
    let summaries = |runs: &[ProbingRun]| -> Vec<ProbingSummary> {
        runs.iter().map(|run| run.summary.clone()).collect()
    };
    let fade_on = summaries(&probing);
    let fade_off = summaries(&probing_fade_off);
    let law_as_printed = results.take(Job::LawAsPrinted).run;
    let exact =
        |results: &mut JobResults, stribeck| tracking(&results.take(Job::Exact { stribeck }).run);
    let perturbed_runs: Vec<TrackingError> = (0..SEEDS)
        .map(|seed| tracking(&results.take(Job::Seed(seed)).run))
        .collect();
    let summary = Summary {
        version: env!("CARGO_PKG_VERSION"),
        arm: description.name().to_owned(),
        paths: description.paths(),
        seed: options.seed,
        model: options.model.as_ref().map(|model| {
            let source = model.settings().source.clone();
            source.unwrap_or_else(|| model.name().to_owned())
        }),
        plant: options.plant.clone(),
        realistic: None,
        ideal: None,
        not_identified: None,
        sinusoid: tracking(headline),
        sinusoid_by_speed: sinusoids
            .iter()
            .map(|(speed, run)| TrackingAtSpeed {
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
        contact: contact(&fade_on),
        probing: fade_on,
        fade_off: contact(&fade_off),
        probing_fade_off: fade_off,
        probing_exact_model: summaries(&probing_exact),
        probing_rubber: summaries(&probing_rubber),
        probing_apparent_inertia: summaries(&probing_apparent),
        sinusoid_apparent_inertia: tracking(&apparent_inertia),
        quadrant_damped,
        quadrant_corner_ramp,
        sinusoid_exact_model: ExactModel {
            coulomb: exact(&mut results, false),
            stribeck: exact(&mut results, true),
        },
        law_as_printed: tracking(&law_as_printed),
        perturbed_rms_m: perturbed_runs
            .iter()
            .map(|run| run.rms_error_m)
            .filter(|error_m| error_m.is_finite())
            .collect(),
        perturbed_runs,
        adapted: Vec::new(),
        derived: None,
    };
    Demo {
        summary,
        sinusoids,
        arc,
        quadrants: [slow, perturbed, fast, damped, ramped],
        probing,
        probing_fade_off,
        probing_rubber,
        law_as_printed,
    }
}

#[cfg(test)]
mod tests {
    use super::{DemoOptions, realistic_arm};
    use supple_model::Description;
    use supple_plant::PlantOptions;

    #[test]
    fn a_given_model_is_used_only_with_the_given_plant() {
        let arm = Description::asset("wam4").expect("a built-in arm");
        let mut options = DemoOptions {
            seed: 0,
            log_dir: None,
            model: Some(arm.clone()),
            plant: PlantOptions::default(),
            realistic_seeds: 1,
        };
        let (plant, model) = realistic_arm(&arm, &options);
        assert_eq!(plant, PlantOptions::realistic_of(&arm));
        assert!(model.is_none());

        options.plant.encoder_noise_rad = Some(5e-4);
        let (plant, model) = realistic_arm(&arm, &options);
        assert_eq!(plant, options.plant);
        assert!(model.is_some());
    }
}
