//! The runs of the demo and their results.

use crate::demo_options::DemoOptions;
use crate::error::ExperimentError;
use crate::metrics::Rms;
use crate::mismatch::Mismatch;
use crate::probing::{ContactMeter, Stroke};
use crate::quadrant::{Edge, EdgeMeter};
use crate::record::Recorder;
use crate::run::{Plan, Run, run};
use crate::scenario;
use crate::setup::{Setup, Variant};

use supple_core::Trajectory;
use supple_core::trajectory::{Probe, ProbePhase};
use supple_model::Description;
use supple_plant::Scene;

/// Number of perturbed models in the statistics of the sinusoid.
pub(crate) const SEEDS: u64 = 10;
/// Speed factors of the sinusoid.
pub(crate) const SPEEDS: [f64; 3] = [0.5, 1.0, 2.0];
/// Clearance of the reference above the block until which the descent counts as free motion \[m\].
const CLEARANCE_M: f64 = 0.01;

/// One run of the demo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Job {
    Sinusoid { speed: f64 },
    Arc,
    Quadrant { speed_m_per_s: f64, exact: bool },
    Seed(u64),
    Exact { stribeck: bool },
    PaperLetter,
    Probing { stiffness_n_per_m: f64, fade: bool },
}

pub(crate) const QUADRANT: Job = Job::Quadrant {
    speed_m_per_s: scenario::QUADRANT_SPEED_M_PER_S,
    exact: true,
};
pub(crate) const QUADRANT_PERTURBED: Job = Job::Quadrant {
    speed_m_per_s: scenario::QUADRANT_SPEED_M_PER_S,
    exact: false,
};
pub(crate) const QUADRANT_FAST: Job = Job::Quadrant {
    speed_m_per_s: scenario::QUADRANT_PAPER_SPEED_M_PER_S,
    exact: true,
};

/// Results of a job.
pub(crate) struct JobResult {
    pub run: Run,
    pub strokes: Vec<Stroke>,
    pub edges: Vec<Edge>,
    pub free_rms_m: f64,
}

/// All runs, the longest first so that all cores finish at about the same time.
pub(crate) fn jobs() -> Vec<Job> {
    let mut jobs = Vec::new();
    for fade in [true, false] {
        for stiffness_n_per_m in scenario::PROBING_STIFFNESS_N_PER_M {
            jobs.push(Job::Probing {
                stiffness_n_per_m,
                fade,
            });
        }
    }
    jobs.extend(SPEEDS.map(|speed| Job::Sinusoid { speed }));
    jobs.push(Job::Arc);
    jobs.extend((0..SEEDS).map(Job::Seed));
    jobs.extend([false, true].map(|stribeck| Job::Exact { stribeck }));
    jobs.extend([QUADRANT, QUADRANT_PERTURBED, QUADRANT_FAST]);
    jobs.push(Job::PaperLetter);
    jobs
}

impl Job {
    fn name(&self) -> String {
        match self {
            Job::Sinusoid { speed } => format!("sinusoid_speed_{speed}"),
            Job::Arc => "arc".to_owned(),
            Job::Quadrant {
                speed_m_per_s,
                exact,
            } => {
                let model = if *exact { "" } else { "_perturbed" };
                format!("quadrant_{speed_m_per_s:.3}_m_per_s{model}")
            }
            Job::Seed(seed) => format!("sinusoid_model_{seed}"),
            Job::Exact { stribeck: true } => "sinusoid_exact_stribeck".to_owned(),
            Job::Exact { stribeck: false } => "sinusoid_exact_coulomb".to_owned(),
            Job::PaperLetter => "sinusoid_paper_letter".to_owned(),
            Job::Probing {
                stiffness_n_per_m,
                fade,
            } => {
                let fade = if *fade { "" } else { "_fade_off" };
                format!("probing_{stiffness_n_per_m}_n_per_m{fade}")
            }
        }
    }

    fn variant(&self, seed: u64) -> Variant {
        let perturbed = |offset| Variant {
            mismatch: Some(Mismatch::identified(seed.wrapping_add(offset))),
            ..Variant::EXACT
        };
        match *self {
            Job::Sinusoid { .. } | Job::Arc | Job::Quadrant { exact: false, .. } => perturbed(0),
            Job::Quadrant { exact: true, .. } => Variant::EXACT,
            Job::Seed(offset) => perturbed(offset),
            Job::PaperLetter => Variant {
                paper_letter: true,
                stribeck: false,
                ..perturbed(0)
            },
            Job::Exact { stribeck } => Variant {
                stribeck,
                load: false,
                ..Variant::EXACT
            },
            Job::Probing { fade, .. } => Variant {
                fade,
                ..Variant::EXACT
            },
        }
    }

    fn trajectory(&self, tip_radius_m: f64) -> (Trajectory, f64) {
        match *self {
            Job::Sinusoid { speed } => scenario::sinusoid(speed),
            Job::Seed(_) | Job::Exact { .. } | Job::PaperLetter => scenario::sinusoid(1.0),
            Job::Arc => scenario::arc(),
            Job::Quadrant { speed_m_per_s, .. } => {
                let (quadrant, duration_s) = scenario::quadrant(speed_m_per_s);
                (Trajectory::Quadrant(quadrant), duration_s)
            }
            Job::Probing { .. } => {
                let (probe, duration_s) = scenario::probe(tip_radius_m);
                (Trajectory::Probe(probe), duration_s)
            }
        }
    }

    pub fn plan<const N: usize>(
        &self,
        setup: &Setup<N>,
        seed: u64,
    ) -> Result<Plan<N>, ExperimentError> {
        let variant = self.variant(seed);
        let mut config = setup.config(&variant)?;
        let mut scene = Scene::default();
        config.law.gains = scenario::gains(scenario::STIFFNESS_N_PER_M);
        if let Job::Probing {
            stiffness_n_per_m, ..
        } = *self
        {
            config.law.gains = scenario::gains(stiffness_n_per_m);
            scene = scenario::block();
        }
        let (trajectory, duration_s) = self.trajectory(setup.tip_radius_m());
        Ok(Plan {
            name: self.name(),
            config,
            plant: setup.plant(&variant, scene),
            trajectory,
            duration_s,
            learning: false,
        })
    }

    pub fn run<const N: usize>(
        &self,
        plan: &Plan<N>,
        description: &Description,
        options: &DemoOptions,
    ) -> Result<JobResult, ExperimentError> {
        let mut recorder = match &options.log_dir {
            Some(folder) => Some(Recorder::create(
                folder,
                description,
                plan,
                options.seed,
                options.plant.notes(),
            )?),
            None => None,
        };
        let mut contact = match plan.trajectory {
            Trajectory::Probe(probe) => Some((ContactMeter::new(probe), probe)),
            _ => None,
        };
        let mut edges = match plan.trajectory {
            Trajectory::Quadrant(quadrant) => Some(EdgeMeter::new(quadrant)),
            _ => None,
        };
        let face_m = plan.plant.tip_radius_m + scenario::FACE_M;
        let mut free = Rms::default();
        let run = run(plan, &mut |cycle, time_s| {
            if let Some(recorder) = &mut recorder {
                recorder.cycle(cycle)?;
            }
            let (Some(time_s), Some(reference)) = (time_s, cycle.output.reference) else {
                return Ok(());
            };
            let error_m = (reference.position - cycle.truth.tip_position_m).norm();
            if let Some((meter, probe)) = &mut contact {
                meter.cycle(time_s, &cycle.truth, cycle.steps, &cycle.output);
                if is_free(probe, time_s, reference.position.z - face_m) {
                    free.add(error_m);
                }
            }
            if let Some(meter) = &mut edges {
                meter.cycle(time_s, error_m);
            }
            Ok(())
        })?;
        if let Some(recorder) = recorder {
            recorder.finish()?;
        }
        Ok(JobResult {
            run,
            strokes: contact.map_or_else(Vec::new, |(meter, _)| meter.finish()),
            edges: edges.map_or_else(Vec::new, EdgeMeter::finish),
            free_rms_m: free.rms(),
        })
    }
}

/// Whether the reference descends and is not yet near the block.
fn is_free(probe: &Probe, time_s: f64, above_face_m: f64) -> bool {
    probe.phase_at(time_s).0 == ProbePhase::Down && above_face_m > CLEARANCE_M
}
