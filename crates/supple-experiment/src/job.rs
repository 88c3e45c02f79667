//! The runs of the demo and their results.

use crate::demo_options::DemoOptions;
use crate::error::ExperimentError;
use crate::metrics::Rms;
use crate::mismatch::Mismatch;
use crate::probing::{ContactAccumulator, Stroke, effective_mass_kg};
use crate::quadrant::{SegmentErrorAccumulator, SegmentPass};
use crate::record::Recorder;
use crate::run::{Plan, Run, run};
use crate::scenario;
use crate::setup::{Setup, Variant};
use crate::start::start_pose;

use supple_core::Trajectory;
use supple_core::config::ApparentInertia;
use supple_core::inverse_kinematics::inverse_kinematics;
use supple_core::nalgebra::{Matrix3, Vector3};
use supple_core::trajectory::{Probe, ProbePhase, Quadrant};
use supple_model::{Description, Paths};
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
    Sinusoid {
        speed: f64,
    },
    Arc,
    Quadrant {
        speed_m_per_s: f64,
        exact: bool,
    },
    QuadrantDamped,
    QuadrantCornerRamp,
    Seed(u64),
    Exact {
        stribeck: bool,
    },
    LawAsPrinted,
    Probing {
        stiffness_n_per_m: f64,
        kind: ProbingVariant,
    },
    ApparentInertia,
}

/// Variant of a probing run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ProbingVariant {
    /// Model identified on the arm; the latch changes the friction feed-forward in contact.
    Plain,
    /// Perturbed model, the friction feed-forward stays on.
    FadeOff,
    /// The plant's own parameters.
    Exact,
    /// A sheet of rubber on the block.
    Rubber,
    /// Apparent inertia by the force sensor.
    ApparentInertia,
}

impl ProbingVariant {
    /// The variants that run at all stiffnesses.
    pub const OVER_ALL: [ProbingVariant; 2] = [ProbingVariant::Plain, ProbingVariant::FadeOff];
    /// The variants that run only at the stiffnesses of the paper's figure 5.
    pub const AT_TWO: [ProbingVariant; 3] = [
        ProbingVariant::Exact,
        ProbingVariant::Rubber,
        ProbingVariant::ApparentInertia,
    ];

    fn suffix(self) -> &'static str {
        match self {
            ProbingVariant::Plain => "",
            ProbingVariant::FadeOff => "_fade_off",
            ProbingVariant::Exact => "_exact",
            ProbingVariant::Rubber => "_rubber",
            ProbingVariant::ApparentInertia => "_apparent_inertia",
        }
    }
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
    pub edges: Vec<SegmentPass>,
    pub free_rms_m: f64,
    /// Effective mass of the tip at the first touch of the block in a probing run \[kg\]; zero in other runs.
    pub effective_mass_kg: f64,
    /// Damping of the law along base axis x \[N s/m\].
    pub damping_n_s_per_m: f64,
    /// The quadrant of the run, if its trajectory is a quadrant.
    pub quadrant: Option<Quadrant>,
}

impl JobResult {
    /// Returns the result of a job that was left out: no samples, and errors that are not numbers.
    pub fn left_out<const N: usize>(job: &Job, plan: Option<&Plan<N>>) -> JobResult {
        JobResult {
            run: Run::left_out(job.name()),
            strokes: Vec::new(),
            edges: Vec::new(),
            free_rms_m: f64::NAN,
            effective_mass_kg: 0.0,
            damping_n_s_per_m: plan.map_or(0.0, |plan| plan.config.law.gains.damping_n_s_per_m.x),
            quadrant: plan.and_then(|plan| quadrant_of(&plan.trajectory)),
        }
    }
}

fn quadrant_of(trajectory: &Trajectory) -> Option<Quadrant> {
    match trajectory {
        Trajectory::Quadrant(quadrant) => Some(*quadrant),
        _ => None,
    }
}

/// Returns all runs, the longest first so that all cores finish at about the same time.
pub(crate) fn jobs() -> Vec<Job> {
    let mut jobs = Vec::new();
    let mut probing = |stiffness: &[f64], kind| {
        jobs.extend(stiffness.iter().map(|stiffness_n_per_m| Job::Probing {
            stiffness_n_per_m: *stiffness_n_per_m,
            kind,
        }));
    };
    for kind in ProbingVariant::OVER_ALL {
        probing(&scenario::PROBING_STIFFNESS_N_PER_M, kind);
    }
    for kind in ProbingVariant::AT_TWO {
        probing(&scenario::PAPER_STIFFNESS_N_PER_M, kind);
    }
    jobs.extend(SPEEDS.map(|speed| Job::Sinusoid { speed }));
    jobs.push(Job::Arc);
    jobs.extend((0..SEEDS).map(Job::Seed));
    jobs.extend([false, true].map(|stribeck| Job::Exact { stribeck }));
    jobs.extend([QUADRANT, QUADRANT_PERTURBED, QUADRANT_FAST]);
    jobs.extend([Job::QuadrantDamped, Job::QuadrantCornerRamp]);
    jobs.push(Job::ApparentInertia);
    jobs.push(Job::LawAsPrinted);
    jobs
}

impl Job {
    /// Returns whether a fault is an expected result, as with the equation as printed.
    pub fn may_fault(&self) -> bool {
        *self == Job::LawAsPrinted
    }

    /// Returns whether the controller has the model that was identified on the arm, if there is one.
    pub fn uses_identified_model(&self) -> bool {
        use ProbingVariant::{ApparentInertia, Plain, Rubber};
        matches!(
            self,
            Job::Probing {
                kind: Plain | Rubber | ApparentInertia,
                ..
            }
        )
    }

    pub fn name(&self) -> String {
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
            Job::LawAsPrinted => "sinusoid_law_as_printed".to_owned(),
            Job::Probing {
                stiffness_n_per_m,
                kind,
            } => format!("probing_{stiffness_n_per_m}_n_per_m{}", kind.suffix()),
            Job::QuadrantDamped => "quadrant_damped".to_owned(),
            Job::QuadrantCornerRamp => "quadrant_corner_ramp".to_owned(),
            Job::ApparentInertia => "sinusoid_apparent_inertia".to_owned(),
        }
    }

    fn variant(&self, seed: u64) -> Variant {
        let perturbed = |offset| Variant {
            mismatch: Some(Mismatch::identified(seed.wrapping_add(offset))),
            ..Variant::EXACT
        };
        match *self {
            Job::Sinusoid { .. }
            | Job::Arc
            | Job::ApparentInertia
            | Job::Quadrant { exact: false, .. } => perturbed(0),
            Job::Quadrant { exact: true, .. } | Job::QuadrantDamped | Job::QuadrantCornerRamp => {
                Variant::EXACT
            }
            Job::Seed(offset) => perturbed(offset),
            Job::LawAsPrinted => Variant {
                law_as_printed: true,
                stribeck: false,
                ..perturbed(0)
            },
            Job::Exact { stribeck } => Variant {
                stribeck,
                load: false,
                ..Variant::EXACT
            },
            Job::Probing { kind, .. } => Variant {
                fade: kind != ProbingVariant::FadeOff,
                ..match kind {
                    ProbingVariant::Exact => Variant::EXACT,
                    _ => perturbed(0),
                }
            },
        }
    }

    fn trajectory(&self, paths: &Paths, tip_radius_m: f64) -> (Trajectory, f64) {
        match *self {
            Job::Sinusoid { speed } => paths.sinusoid(speed),
            Job::Seed(_) | Job::Exact { .. } | Job::LawAsPrinted | Job::ApparentInertia => {
                paths.sinusoid(1.0)
            }
            Job::Arc => paths.arc(1.0),
            Job::Quadrant { .. } | Job::QuadrantDamped | Job::QuadrantCornerRamp => {
                let (quadrant, duration_s) = self.quadrant(paths);
                (Trajectory::Quadrant(quadrant), duration_s)
            }
            Job::Probing { .. } => {
                let (probe, duration_s) = paths.probe(tip_radius_m);
                (Trajectory::Probe(probe), duration_s)
            }
        }
    }

    /// Returns the quadrant of figure 3b of this job, and its duration \[s\].
    pub fn quadrant(&self, paths: &Paths) -> (Quadrant, f64) {
        let speed_m_per_s = match *self {
            Job::Quadrant { speed_m_per_s, .. } => speed_m_per_s,
            _ => scenario::QUADRANT_PAPER_SPEED_M_PER_S,
        };
        let (quadrant, duration_s) = paths.quadrant(speed_m_per_s);
        if *self != Job::QuadrantCornerRamp {
            return (quadrant, duration_s);
        }
        // Two laps have six corners.
        let with_ramps = quadrant.with_corner_ramp(scenario::CORNER_RAMP_S);
        (with_ramps, duration_s + 6.0 * scenario::CORNER_RAMP_S)
    }

    pub fn plan<const N: usize>(
        &self,
        setup: &Setup<N>,
        seed: u64,
    ) -> Result<Plan<N>, ExperimentError> {
        let variant = self.variant(seed);
        let paths = setup.paths();
        let mut config = setup.config(&variant)?;
        let mut scene = Scene::default();
        config.law.gains = scenario::gains_like(&config.law.gains, scenario::STIFFNESS_N_PER_M);
        let mut apparent = *self == Job::ApparentInertia;
        match *self {
            Job::Probing {
                stiffness_n_per_m,
                kind,
            } => {
                config.law.gains = scenario::gains_like(&config.law.gains, stiffness_n_per_m);
                scene = match kind {
                    ProbingVariant::Rubber => scenario::rubber_block_at(&paths),
                    _ => scenario::block_at(&paths),
                };
                apparent = kind == ProbingVariant::ApparentInertia;
            }
            Job::QuadrantDamped => {
                let damping = Vector3::repeat(scenario::CORNER_DAMPING_N_S_PER_M);
                config.law.gains.damping_n_s_per_m = damping;
            }
            _ => {}
        }
        if apparent {
            let inertia = Matrix3::identity() * scenario::APPARENT_INERTIA_KG;
            config.law.inertia = ApparentInertia::Chosen(inertia);
        }
        let (trajectory, duration_s) = self.trajectory(&paths, setup.tip_radius_m());
        Ok(Plan {
            name: self.name(),
            config,
            plant: setup.plant(&variant, scene),
            trajectory,
            duration_s,
            learning: false,
            gain_change: None,
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
            Trajectory::Probe(probe) => Some((ContactAccumulator::new(probe), probe)),
            _ => None,
        };
        let mut edges = match plan.trajectory {
            Trajectory::Quadrant(quadrant) => Some(SegmentErrorAccumulator::new(quadrant)),
            _ => None,
        };
        let face_m = plan.plant.tip_radius_m + description.paths().face_m();
        let mut free = Rms::default();
        let run = run(plan, &mut |cycle, time_s| {
            if let Some(recorder) = &mut recorder {
                recorder.write_cycle(cycle)?;
            }
            let (Some(time_s), Some(reference)) = (time_s, cycle.output.reference) else {
                return Ok(());
            };
            let error_m = (reference.position - cycle.truth.tip_position_m).norm();
            if let Some((meter, probe)) = &mut contact {
                meter.add_cycle(time_s, &cycle.truth, cycle.steps, &cycle.output);
                if is_free(probe, time_s, reference.position.z - face_m) {
                    free.add(error_m);
                }
            }
            if let Some(accumulator) = &mut edges {
                accumulator.add_cycle(time_s, error_m);
            }
            Ok(())
        })?;
        if let Some(recorder) = recorder {
            recorder.finish()?;
        }
        Ok(JobResult {
            run,
            strokes: contact.map_or_else(Vec::new, |(meter, _)| meter.finish()),
            edges: edges.map_or_else(Vec::new, SegmentErrorAccumulator::finish),
            free_rms_m: free.rms(),
            effective_mass_kg: touch_mass_kg(plan, face_m),
            damping_n_s_per_m: plan.config.law.gains.damping_n_s_per_m.x,
            quadrant: quadrant_of(&plan.trajectory),
        })
    }
}

/// Returns the effective mass of the plant's tip at the first touch of the block, with the centre of the tip at the height
/// `face_m` \[kg\]; zero without a stroke.
fn touch_mass_kg<const N: usize>(plan: &Plan<N>, face_m: f64) -> f64 {
    let Trajectory::Probe(probe) = plan.trajectory else {
        return 0.0;
    };
    let config = &plan.config;
    let start = start_pose(config, &plan.name, &plan.trajectory, probe.stroke_s());
    let mass = start.ok().and_then(|start| {
        let mut touch_m = plan.trajectory.at(0.0).position;
        touch_m.z = face_m;
        let (arm, roles) = (&config.arm, &config.roles);
        let touch = inverse_kinematics(arm, roles, &config.limits, &start, &touch_m);
        effective_mass_kg(&plan.plant.arm, &touch.position_rad, &Vector3::z())
    });
    mass.unwrap_or(0.0)
}

/// Returns whether the reference descends and is not yet near the block.
fn is_free(probe: &Probe, time_s: f64, above_face_m: f64) -> bool {
    probe.phase_at(time_s).0 == ProbePhase::Down && above_face_m > CLEARANCE_M
}
