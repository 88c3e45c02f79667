//! The whole of identification on the simulated arm: breakaway, excitation, fit, validation.
//!
//! The controller starts from a model that is off as a data sheet is, and nothing of the plant is known to
//! the fit but what the arm logs: angles through noisy, quantised encoders, and commanded torques. The
//! truth is looked at once, at the end, to say how far the result is from it. This is simulation: on real
//! arms of this kind the best published models leave 6.7 to 8.4 % of the torque.

use crate::breakaway::{JointBreakaway, breakaway};
use crate::error::ExperimentError;
use crate::excite::{constant_speed_runs, excitation, free_of_roles, slow_motion};
use crate::metrics::Rms;
use crate::mismatch::Mismatch;
use crate::ripple::ripple_on;
use crate::session::Recording;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::PathBuf;
use supple_core::dynamics::gravity;
use supple_core::ripple::{Harmonic, compensation_nm};
use supple_core::{Config, RippleTable, Vector};
use supple_ident::design::{Design, Designed, design};
use supple_ident::{
    Fit, FrictionChoice, FrictionColumns, Log, Motion, Preparation, Procedure, RippleSearch,
    Validation, fit_ripple, fit_with_dip,
};
use supple_model::{Description, Replacement};
use supple_plant::{LuGre, PlantConfig, Ripple};

/// Speeds of the friction curve that is compared \[rad/s\].
const CURVE_RAD_PER_S: (f64, f64, usize) = (0.02, 0.5, 49);
/// Poses at which gravity is compared.
const POSES: usize = 500;
/// Rounds of ripple and model.
const ROUNDS: usize = 2;
/// Cutoff of the filters for the model and for ripple, which is faster \[Hz\].
pub(crate) const CUTOFF_HZ: (f64, f64) = (8.0, 40.0);
/// Joints slower than this say nothing of inertia and Coulomb friction \[rad/s\].
const SLOW_RAD_PER_S: f64 = 0.15;

/// How the arm is calibrated, and what its plant is like.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// Seed of the starting model, of the search for a motion and of every noise.
    pub seed: u64,
    /// Errors of the model that it starts from.
    pub start: Mismatch,
    /// Standard deviation of the noise on each motor angle \[rad\].
    pub encoder_noise_rad: f64,
    /// The plant's friction has its part that depends on direction and load.
    pub load: bool,
    /// Amplitude of the torque ripple of each motor, seen at its joint \[N m\]; zero for none.
    pub ripple_nm: f64,
    /// Candidates of the search for a motion.
    pub candidates: usize,
    /// Measure breakaway first.
    pub breakaway: bool,
    /// Folder for the MCAP of the excitation; it exists. `None` writes none.
    pub log_dir: Option<PathBuf>,
}

impl Calibration {
    /// A model that is 5 % off in gravity and 30 % in friction, encoder noise of a third of a count, load
    /// and ripple off.
    pub fn new(seed: u64) -> Calibration {
        Calibration {
            seed,
            start: Mismatch {
                gravity: 0.05,
                friction: 0.3,
                seed,
            },
            encoder_noise_rad: 5e-4,
            load: false,
            ripple_nm: 0.0,
            candidates: 600,
            breakaway: false,
            log_dir: None,
        }
    }
}

/// How far a model is from the plant that it was found on.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Truthfulness {
    /// Root mean square of the gravity error over that of gravity, at random poses.
    pub gravity_relative: f64,
    /// Root mean square error of the friction curve from 0.02 to 0.5 rad/s, both ways, over that of the
    /// curve, joint by joint.
    pub friction_relative: Vec<f64>,
}

/// What came of it.
#[derive(Clone, Debug)]
pub struct Calibrated<const N: usize> {
    /// Breakaway, if it was measured, joint by joint, and the plant's own \[N m\].
    pub breakaway: Vec<(JointBreakaway, f64)>,
    /// The motion.
    pub designed: Designed<N>,
    /// The fit.
    pub fit: Fit<N>,
    /// Ripple of each motor.
    pub ripple: [RippleTable; N],
    /// The identified arm, as the controller loads it.
    pub description: Description,
    /// Against a motion that was not fitted.
    pub validation: Validation,
    /// That motion with the ripple taken out, for figures.
    pub held_out: Motion,
    /// Against the truth.
    pub truth: Truthfulness,
}

/// The plant of a calibration: the description's, with its noises.
///
/// # Errors
/// Where the description has not `N` joints.
pub fn plant_of<const N: usize>(
    description: &Description,
    calibration: &Calibration,
) -> Result<PlantConfig<N>, ExperimentError> {
    let mut plant = PlantConfig::<N>::from_description(description)?;
    plant.seed = calibration.seed;
    plant.drive.encoder_noise_rad = Vector::repeat(calibration.encoder_noise_rad);
    if !calibration.load {
        plant.friction = plant.friction.map(LuGre::without_load);
    }
    if calibration.ripple_nm > 0.0 {
        plant.drive.ripple = ripple(&plant, calibration);
    }
    Ok(plant)
}

/// Two harmonics a motor, of seeded phases, whose amplitudes at the joint add to the one asked for.
fn ripple<const N: usize>(plant: &PlantConfig<N>, calibration: &Calibration) -> Vec<Ripple> {
    let mut random = ChaCha8Rng::seed_from_u64(calibration.seed ^ 0x7269);
    let to_joint = &plant.drive.joint_from_motor;
    let mut lines = Vec::new();
    for motor in 0..N {
        // A torque of 1 N m at the motor is the inverse of the largest ratio at the joints.
        let per_joint = to_joint.column(motor).amax();
        for (harmonic, share) in [(2, 0.4), (6, 0.6)] {
            lines.push(Ripple {
                motor,
                harmonic,
                amplitude_nm: calibration.ripple_nm * share * per_joint,
                phase_rad: std::f64::consts::TAU * random.random::<f64>(),
            });
        }
    }
    lines
}

/// The description of a calibration's plant: `description` with the ripple that its motors have.
///
/// # Errors
/// Where the description has not `N` joints.
pub fn described_plant<const N: usize>(
    description: &Description,
    plant: &PlantConfig<N>,
) -> Result<Description, ExperimentError> {
    let told = description.config::<N>()?;
    let table = |motor| table_of(&plant.drive.ripple, motor).unwrap_or(RippleTable::NONE);
    Ok(description.with_model(&Replacement {
        arm: &told.arm,
        friction: &told.friction,
        ripple: Some(&core::array::from_fn(table)),
        source: "the simulated plant",
    })?)
}

/// Carries it out. `progress` hears what begins.
///
/// # Errors
/// [`ExperimentError`].
pub fn calibrate<const N: usize>(
    description: &Description,
    calibration: &Calibration,
    progress: &mut dyn FnMut(&str),
) -> Result<Calibrated<N>, ExperimentError> {
    let told = description.config::<N>()?;
    let start = calibration.start.apply(&told)?;
    let plant = plant_of::<N>(description, calibration)?;
    let home = description.home::<N>()?;
    let joints: Vec<usize> = (0..N).collect();

    let mut gave_way = Vec::new();
    let free = free_of_roles(&start);
    let slow = slow_motion(&free, &home, &joints)?;
    if calibration.breakaway {
        let mut compensated = start;
        if calibration.ripple_nm > 0.0 {
            progress("torque ripple, from runs at constant speed");
            compensated.ripple = ripple_on(&start, &plant, &home)?;
        }
        progress("breakaway");
        let pose = upright(&start);
        let found = breakaway(&compensated, &plant, &pose, &joints, &mut |_| {})?;
        let truth = plant.friction.iter().map(|f| f.breakaway_nm);
        gave_way = found.into_iter().zip(truth).collect();
    }

    progress("design of the excitation");
    let search = |seed, candidates| Design {
        seed,
        candidates,
        ..Design::of(&joints)
    };
    let wanted = search(calibration.seed, calibration.candidates);
    let designed = design(&free, &home, &wanted, &mut |_, _| {})?;
    let other = search(
        calibration.seed.wrapping_add(1000),
        (calibration.candidates / 10).max(20),
    );
    let mut other = design(&free, &home, &other, &mut |_, _| {})?.series;
    other.duration_s = 2.0 * other.period_s() + other.ramp_s;

    progress("excitation");
    let mut series = vec![designed.series, slow, other];
    if calibration.ripple_nm > 0.0 {
        series.extend(constant_speed_runs(&free, &home, &joints)?);
    }
    let session = excitation("excitation", &free, &plant, &home, &series);
    let folder = calibration.log_dir.as_deref();
    let recordings = session.record(folder, description, calibration.seed)?;
    let logs: Vec<Log> = recordings.iter().map(log_of).collect();

    progress("identification");
    let (fit, ripple) = identify(&start, &logs[..2], &logs[3..])?;
    let motor_from_joint = *supple_core::Controller::new(told)?.motor_from_joint();
    let unrippled = without_ripple(&logs[2], &ripple, &motor_from_joint);
    let (held_out, _) = Motion::prepare(&unrippled, N, &joints, &fit.preparation)?;
    let validation = fit.validate_motion(&held_out)?;
    let described = fit.description(description, Some(&ripple))?;
    let truth = truthfulness(&described.config::<N>()?, &plant, calibration.seed);
    Ok(Calibrated {
        breakaway: gave_way,
        designed,
        fit,
        ripple,
        description: described,
        validation,
        held_out,
        truth,
    })
}

/// A pose with little gravity on the joints: all at zero where they may be.
fn upright<const N: usize>(config: &Config<N>) -> Vector<N> {
    let limits = &config.limits;
    Vector::from_fn(|i, _| {
        let zone = 2.0 * limits.soft_zone_rad;
        let (lower, upper) = (
            limits.position_lower_rad[i] + zone,
            limits.position_upper_rad[i] - zone,
        );
        0.0_f64.clamp(lower.min(upper), upper.max(lower))
    })
}

/// A recording as the columns that identification takes.
pub fn log_of(recording: &Recording) -> Log {
    Log {
        t_s: recording.t_s.clone(),
        q_rad: recording.q_rad.clone(),
        qd_rad_per_s: None,
        tau_nm: recording.tau_nm.clone(),
    }
}

/// How the project's own logs are prepared: commands act in the cycle after, for a cycle.
pub fn preparation(period_s: f64, cutoff_hz: f64) -> Preparation {
    let kept_hz = 12.5 * cutoff_hz;
    let keep_every = ((1.0 / period_s) / kept_hz).round().max(1.0) as usize;
    Preparation {
        rate_hz: Some(1.0 / period_s),
        cutoff_hz: Some(cutoff_hz),
        keep_every,
        torque_delay_s: 1.5 * period_s,
    }
}

/// The log with the torques that the joints received, ripple included.
pub fn without_ripple<const N: usize>(
    log: &Log,
    tables: &[RippleTable; N],
    motor_from_joint: &supple_core::Matrix<N, N>,
) -> Log {
    let mut log = log.clone();
    for i in 0..log.t_s.len() {
        let q = Vector::<N>::from_fn(|j, _| log.q_rad[(i, j)]);
        let against = compensation_nm(tables, motor_from_joint, &q);
        (0..N).for_each(|j| log.tau_nm[(i, j)] -= against[j]);
    }
    log
}

/// The model from a fast and a slow log of all joints, and ripple from `runs` of them at constant speed;
/// without runs there is none.
///
/// # Errors
/// [`ExperimentError::Ident`].
pub fn identify<const N: usize>(
    start: &Config<N>,
    logs: &[Log],
    runs: &[Log],
) -> Result<(Fit<N>, [RippleTable; N]), ExperimentError> {
    let joints: Vec<usize> = (0..N).collect();
    let motor_from_joint = *supple_core::Controller::new(*start)?.motor_from_joint();
    let procedure = Procedure {
        preparation: preparation(start.period_s, CUTOFF_HZ.0),
        friction: FrictionChoice::Columns(FrictionColumns::OFFSET),
        slow_rad_per_s: SLOW_RAD_PER_S,
        prior_weight: Some(1e-2),
        ..Procedure::default()
    };
    let fine = preparation(start.period_s, CUTOFF_HZ.1);
    let mut tables = [RippleTable::NONE; N];
    let mut rounds = if runs.is_empty() { 0 } else { ROUNDS };
    loop {
        let prepare = |logs: &[Log], preparation: &Preparation, tables: &[RippleTable; N]| {
            logs.iter()
                .map(|log| {
                    let log = without_ripple(log, tables, &motor_from_joint);
                    Motion::prepare(&log, N, &joints, preparation).map(|(motion, _)| motion)
                })
                .collect::<Result<Vec<_>, _>>()
        };
        let motions = prepare(logs, &procedure.preparation, &tables)?;
        let fit = fit_with_dip(&start.arm, &motions, &joints, &procedure)?;
        if rounds == 0 {
            return Ok((fit, tables));
        }
        rounds -= 1;
        let raw = prepare(runs, &fine, &[RippleTable::NONE; N])?;
        tables = fit_ripple(&fit, &raw, &motor_from_joint, &RippleSearch::default())?;
    }
}

/// Holds a model against the plant.
pub fn truthfulness<const N: usize>(
    model: &Config<N>,
    plant: &PlantConfig<N>,
    seed: u64,
) -> Truthfulness {
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x7472_7574);
    let limits = &model.limits;
    let (mut wrong, mut whole) = (Rms::default(), Rms::default());
    for _ in 0..POSES {
        let q = Vector::<N>::from_fn(|i, _| {
            let (lower, upper) = (limits.position_lower_rad[i], limits.position_upper_rad[i]);
            lower + (upper - lower) * random.random::<f64>()
        });
        let (a, b) = (gravity(&model.arm, &q), gravity(&plant.arm, &q));
        for j in 0..N {
            wrong.add(a[j] - b[j]);
            whole.add(b[j]);
        }
    }
    let (least, greatest, count) = CURVE_RAD_PER_S;
    let friction_relative = (0..N).map(|j| {
        let (mut wrong, mut whole) = (Rms::default(), Rms::default());
        for k in 0..count {
            let speed = least + (greatest - least) * k as f64 / (count - 1) as f64;
            for v in [speed, -speed] {
                let truth = plant.friction[j].steady_torque_nm(v, 0.0);
                wrong.add(model.friction[j].torque_nm(v) - truth);
                whole.add(truth);
            }
        }
        wrong.rms() / whole.rms().max(f64::MIN_POSITIVE)
    });
    Truthfulness {
        gravity_relative: wrong.rms() / whole.rms().max(f64::MIN_POSITIVE),
        friction_relative: friction_relative.collect(),
    }
}

/// The harmonics of a plant's motor as the controller's table has them.
fn table_of(ripple: &[Ripple], motor: usize) -> Option<RippleTable> {
    let lines: Vec<Harmonic> = ripple
        .iter()
        .filter(|line| line.motor == motor)
        .map(|line| Harmonic {
            harmonic: line.harmonic,
            sine_nm: line.amplitude_nm * line.phase_rad.cos(),
            cosine_nm: line.amplitude_nm * line.phase_rad.sin(),
        })
        .collect();
    RippleTable::new(&lines)
}
