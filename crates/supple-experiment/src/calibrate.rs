//! Complete identification of the simulated arm: breakaway, excitation, fit, validation.
//!
//! The controller starts with data-sheet errors in its model. The fit has this model as a weak prior; all its other information
//! is the log of the arm: noisy, quantised angles and commanded torques. The ground truth is used only to report errors. These
//! are results of a simulation: on real arms of this kind the best published models leave 6.7 to 8.4 % of the torque
//! unexplained.

use crate::breakaway::{JointBreakaway, breakaway};
use crate::error::ExperimentError;
use crate::excite::{constant_speed_runs, excitation, slow_motion, without_held_joints};
use crate::metrics::Rms;
use crate::mismatch::Mismatch;
use crate::recorded_logs::CUTOFF_HZ;
pub use crate::recorded_logs::{log_of, preparation};
use crate::ripple::identify_ripple;
use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::PathBuf;
use supple_core::dynamics::gravity;
use supple_core::ripple::{Harmonic, compensation_nm};
use supple_core::{Config, RippleTable, Vector};
use supple_ident::excitation_design::{DesignOptions, ExcitationDesign, design};
use supple_ident::{
    Effects, Fit, FrictionChoice, FrictionColumns, Log, Motion, Preparation, Procedure,
    RippleSearch, Validation, fit_ripple, fit_with_stribeck,
};
use supple_model::{Description, IdentifiedModel};
use supple_plant::{LuGre, PlantConfig, PlantOptions, Ripple};

/// Speeds of the friction curve that is compared \[rad/s\].
const CURVE_RAD_PER_S: (f64, f64, usize) = (0.02, 0.5, 49);
/// Number of poses at which gravity is compared.
const POSES: usize = 500;
/// Number of alternations between the fits of ripple and model.
const ROUNDS: usize = 2;
/// Samples of joints slower than this are excluded \[rad/s\].
pub(crate) const SLOW_RAD_PER_S: f64 = 0.15;

/// Options of a calibration and of its simulated plant.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// Seed of the starting model, of the excitation design and of all noise.
    pub seed: u64,
    /// Errors of the starting model.
    pub start: Mismatch,
    /// Standard deviation of the noise on each motor angle \[rad\]; `None` for
    /// [`PlantOptions::default_encoder_noise_rad`].
    pub encoder_noise_rad: Option<f64>,
    /// Whether the plant's friction depends on direction and load; true by default.
    pub load: bool,
    /// Effects of a real arm in the plant; none by default.
    pub plant: PlantOptions,
    /// Amplitude of the torque ripple of each motor, reflected to its joint \[N m\]; zero for none.
    pub ripple_nm: f64,
    /// Number of candidates of the excitation design.
    pub candidates: usize,
    /// Whether to measure breakaway first.
    pub breakaway: bool,
    /// Existing folder for the MCAP of the excitation; `None` writes no log.
    pub log_dir: Option<PathBuf>,
}

impl Calibration {
    /// Creates options with model errors of 5 % in gravity and 30 % in friction, the noise of the arm's encoders, no ripple.
    pub fn new(seed: u64) -> Calibration {
        Calibration {
            seed,
            start: Mismatch {
                gravity: 0.05,
                friction: 0.3,
                seed,
            },
            encoder_noise_rad: None,
            load: true,
            plant: PlantOptions::default(),
            ripple_nm: 0.0,
            candidates: 600,
            breakaway: false,
            log_dir: None,
        }
    }
}

impl Calibration {
    /// Returns whether the motors have torque ripple, so that runs at constant speed are needed.
    fn has_ripple(&self) -> bool {
        let options = [self.plant.ripple_nm, self.plant.torque_ripple_fraction];
        self.ripple_nm > 0.0 || options.into_iter().flatten().any(|size| size > 0.0)
    }
}

/// Accuracy of an identified model against the plant.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct ModelAccuracy {
    /// Root mean square error of the gravity torque relative to the root mean square gravity torque, at random poses.
    pub gravity_relative: f64,
    /// Root mean square error of the friction curve from 0.02 to 0.5 rad/s in both directions, relative to the root mean square
    /// of the curve, for each joint.
    pub friction_relative: Vec<f64>,
}

/// Results of a calibration.
#[derive(Clone, Debug)]
pub struct CalibrationResult<const N: usize> {
    /// Measured breakaway torque of each joint, and the plant's breakaway torque \[N m\]; empty if it was not measured.
    pub breakaway: Vec<(JointBreakaway, f64)>,
    /// The designed excitation.
    pub designed: ExcitationDesign<N>,
    /// The fit.
    pub fit: Fit<N>,
    /// Identified torque ripple of each motor.
    pub ripple: [RippleTable; N],
    /// The identified arm as a description that the controller loads.
    pub description: Description,
    /// Validation on a held-out motion.
    pub validation: Validation,
    /// The held-out motion, whose torques include the identified ripple, for figures.
    pub held_out: Motion,
    /// Accuracy against the ground truth.
    pub truth: ModelAccuracy,
}

/// Returns the plant of a calibration: the description's plant with noise and ripple.
///
/// # Errors
/// If the description does not have `N` joints.
pub fn plant_of<const N: usize>(
    description: &Description,
    calibration: &Calibration,
) -> Result<PlantConfig<N>, ExperimentError> {
    let mut plant = PlantConfig::<N>::from_description(description)?;
    plant.seed = calibration.seed;
    let noise_rad = calibration
        .encoder_noise_rad
        .unwrap_or_else(|| PlantOptions::default_encoder_noise_rad(description));
    plant.actuators.encoder_noise_rad = Vector::repeat(noise_rad);
    if !calibration.load {
        plant.friction = plant.friction.map(LuGre::without_load);
    }
    if calibration.ripple_nm > 0.0 {
        plant.actuators.ripple = ripple(&plant, calibration);
    }
    Ok(calibration.plant.apply(plant)?)
}

/// Returns two harmonics for each motor, with seeded phases. If a motor drives one joint alone, their amplitudes at the joint sum
/// to `ripple_nm`; at a differential each of the two motors contributes less.
fn ripple<const N: usize>(plant: &PlantConfig<N>, calibration: &Calibration) -> Vec<Ripple> {
    let mut random = ChaCha8Rng::seed_from_u64(calibration.seed ^ 0x7269);
    let to_joint = &plant.actuators.joint_from_motor;
    let mut lines = Vec::new();
    for motor in 0..N {
        // Motor torque of 1 N m at the joint, if the motor drives that joint alone.
        let per_joint = to_joint.column(motor).amax();
        for (harmonic, fraction) in [(2, 0.4), (6, 0.6)] {
            lines.push(Ripple {
                motor,
                harmonic,
                amplitude_nm: calibration.ripple_nm * fraction * per_joint,
                phase_rad: std::f64::consts::TAU * random.random::<f64>(),
            });
        }
    }
    lines
}

/// Returns the description of a calibration's plant: `description` with the plant's torque ripple.
///
/// # Errors
/// If the description does not have `N` joints.
pub fn described_plant<const N: usize>(
    description: &Description,
    plant: &PlantConfig<N>,
) -> Result<Description, ExperimentError> {
    let nominal = description.config::<N>()?;
    let table = |motor| table_of(&plant.actuators.ripple, motor).unwrap_or(RippleTable::NONE);
    Ok(description.with_model(&IdentifiedModel {
        arm: &nominal.arm,
        friction: &nominal.friction,
        ripple: Some(&core::array::from_fn(table)),
        source: "the simulated plant",
    })?)
}

/// Runs the calibration. `progress` is called with the name of each stage.
///
/// # Errors
/// [`ExperimentError`].
pub fn calibrate<const N: usize>(
    description: &Description,
    calibration: &Calibration,
    progress: &mut dyn FnMut(&str),
) -> Result<CalibrationResult<N>, ExperimentError> {
    let nominal = description.config::<N>()?;
    let start = calibration.start.apply(&nominal)?;
    let plant = plant_of::<N>(description, calibration)?;
    let home = description.home::<N>()?;
    let joints: Vec<usize> = (0..N).collect();

    let mut breakaway_results = Vec::new();
    let free = without_held_joints(&start);
    let slow = slow_motion(&free, &home, &joints)?;
    if calibration.breakaway {
        let mut compensated = start;
        if calibration.has_ripple() {
            progress("torque ripple, from runs at constant speed");
            compensated.ripple = identify_ripple(&start, &plant, &home)?;
        }
        progress("breakaway");
        let pose = upright(&start);
        let found = breakaway(&compensated, &plant, &pose, &joints, &mut |_| {})?;
        let truth = plant.friction.iter().map(|f| f.breakaway_nm);
        breakaway_results = found.into_iter().zip(truth).collect();
    }

    progress("design of the excitation");
    let search = |seed, candidates| DesignOptions {
        seed,
        candidates,
        ..DesignOptions::new(&joints)
    };
    let excitation_options = search(calibration.seed, calibration.candidates);
    let designed = design(&free, &home, &excitation_options, &mut |_, _| {})?;
    let validation_options = search(
        calibration.seed.wrapping_add(1000),
        (calibration.candidates / 10).max(20),
    );
    let mut validation_series = design(&free, &home, &validation_options, &mut |_, _| {})?.series;
    validation_series.duration_s = 2.0 * validation_series.period_s() + validation_series.ramp_s;

    progress("excitation");
    let mut series = vec![designed.series, slow, validation_series];
    if calibration.has_ripple() {
        series.extend(constant_speed_runs(&free, &home, &joints)?);
    }
    let sequence = excitation("excitation", &free, &plant, &home, &series);
    let folder = calibration.log_dir.as_deref();
    let recordings = sequence.record_with_notes(
        folder,
        description,
        calibration.seed,
        calibration.plant.notes(),
    )?;
    let logs: Vec<Log> = recordings.iter().map(log_of).collect();

    progress("identification");
    let (fit, ripple) = identify(&start, &logs[..2], &logs[3..])?;
    let motor_from_joint = *supple_core::Controller::new(nominal)?.motor_from_joint();
    let actual = with_ripple_torque(&logs[2], &ripple, &motor_from_joint);
    let (held_out, _) = Motion::prepare(&actual, N, &joints, &fit.preparation)?;
    let validation = fit.validate_motion(&held_out)?;
    let described = fit.description(description, Some(&ripple))?;
    let thresholds = fit.move_collision_nm(core::slice::from_ref(&validation), &nominal);
    let described = described.with_move_collision(&thresholds)?;
    let truth = model_accuracy(&described.config::<N>()?, &plant, calibration.seed);
    Ok(CalibrationResult {
        breakaway: breakaway_results,
        designed,
        fit,
        ripple,
        description: described,
        validation,
        held_out,
        truth,
    })
}

/// Returns the pose with all joints at zero, or as close to zero as their limits permit: upright for a WAM, with little gravity
/// torque.
pub(crate) fn upright<const N: usize>(config: &Config<N>) -> Vector<N> {
    let limits = &config.limits;
    Vector::from_fn(|i, _| {
        let margin = 2.0 * limits.soft_zone_rad;
        let (lower, upper) = (
            limits.position_lower_rad[i] + margin,
            limits.position_upper_rad[i] - margin,
        );
        0.0_f64.clamp(lower.min(upper), upper.max(lower))
    })
}

/// Returns the log with the torques of the motors according to these tables: commanded torques plus ripple.
pub fn with_ripple_torque<const N: usize>(
    log: &Log,
    tables: &[RippleTable; N],
    motor_from_joint: &supple_core::Matrix<N, N>,
) -> Log {
    let mut log = log.clone();
    let joint_from_motor = motor_from_joint
        .try_inverse()
        .unwrap_or_else(supple_core::Matrix::identity);
    for i in 0..log.t_s.len() {
        let q = Vector::<N>::from_fn(|j, _| log.q_rad[(i, j)]);
        let tau = Vector::<N>::from_fn(|j, _| log.tau_nm[(i, j)]);
        let motor_nm = joint_from_motor.tr_mul(&tau);
        let against = compensation_nm(tables, motor_from_joint, &q, &motor_nm);
        (0..N).for_each(|j| log.tau_nm[(i, j)] -= against[j]);
    }
    log
}

/// Identifies the model from a fast and a slow log of all joints, and torque ripple from `runs` at constant
/// speed; without runs the ripple tables are empty.
///
/// # Errors
/// [`ExperimentError::Ident`].
pub fn identify<const N: usize>(
    start: &Config<N>,
    logs: &[Log],
    runs: &[Log],
) -> Result<(Fit<N>, [RippleTable; N]), ExperimentError> {
    let options = FitOptions::new(FrictionColumns::COULOMB_AND_OFFSET);
    identify_with(start, logs, runs, &options, SLOW_RAD_PER_S)
}

/// Friction terms and priors of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitOptions {
    /// Friction terms that are fitted.
    pub friction: FrictionColumns,
    /// Weight of the link parameters of the starting model as a prior, see
    /// [`supple_ident::constrained_least_squares::Constraints::prior_weight`].
    pub prior_weight: f64,
    /// Prior standard deviation of the rotor inertias relative to those of the starting model; `None`: no prior.
    pub rotor_deviation: Option<f64>,
    /// Whether effects besides friction are fitted where they predict better: springs, tilt, compliance and others.
    pub effects: bool,
}

impl FitOptions {
    /// Creates options with these friction terms, a small prior weight, and no prior of the rotor inertias.
    pub fn new(friction: FrictionColumns) -> FitOptions {
        FitOptions {
            friction,
            prior_weight: 1e-2,
            rotor_deviation: None,
            effects: true,
        }
    }
}

/// Does the same as [`identify`], with friction terms and priors; excludes samples of a joint slower than `slow_rad_per_s`.
///
/// # Errors
/// [`ExperimentError::Ident`].
pub fn identify_with<const N: usize>(
    start: &Config<N>,
    logs: &[Log],
    runs: &[Log],
    options: &FitOptions,
    slow_rad_per_s: f64,
) -> Result<(Fit<N>, [RippleTable; N]), ExperimentError> {
    let joints: Vec<usize> = (0..N).collect();
    let motor_from_joint = *supple_core::Controller::new(*start)?.motor_from_joint();
    let procedure = Procedure {
        preparation: preparation(start.period_s, CUTOFF_HZ.0),
        friction: FrictionChoice::Columns(options.friction),
        slow_rad_per_s,
        prior_weight: Some(options.prior_weight),
        rotor_deviation: options.rotor_deviation,
        effects: match options.effects {
            true => Effects::all(DMatrix::from_fn(N, N, |m, j| motor_from_joint[(m, j)])),
            false => Effects::default(),
        },
        ..Procedure::default()
    };
    let fine = preparation(start.period_s, CUTOFF_HZ.1);
    let mut tables = [RippleTable::NONE; N];
    let mut rounds = if runs.is_empty() { 0 } else { ROUNDS };
    loop {
        let prepare = |logs: &[Log], preparation: &Preparation, tables: &[RippleTable; N]| {
            logs.iter()
                .map(|log| {
                    let log = with_ripple_torque(log, tables, &motor_from_joint);
                    Motion::prepare(&log, N, &joints, preparation).map(|(motion, _)| motion)
                })
                .collect::<Result<Vec<_>, _>>()
        };
        let motions = prepare(logs, &procedure.preparation, &tables)?;
        let fit = fit_with_stribeck(&start.arm, &motions, &joints, &procedure)?;
        if rounds == 0 {
            return Ok((fit, tables));
        }
        rounds -= 1;
        let raw = prepare(runs, &fine, &[RippleTable::NONE; N])?;
        tables = fit_ripple(&fit, &raw, &motor_from_joint, &RippleSearch::default())?;
    }
}

/// Compares a model with the plant.
pub fn model_accuracy<const N: usize>(
    model: &Config<N>,
    plant: &PlantConfig<N>,
    seed: u64,
) -> ModelAccuracy {
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x7472_7574);
    let limits = &model.limits;
    let (mut error, mut reference) = (Rms::default(), Rms::default());
    for _ in 0..POSES {
        let q = Vector::<N>::from_fn(|i, _| {
            let (lower, upper) = (limits.position_lower_rad[i], limits.position_upper_rad[i]);
            lower + (upper - lower) * random.random::<f64>()
        });
        let (a, b) = (gravity(&model.arm, &q), gravity(&plant.arm, &q));
        for j in 0..N {
            error.add(a[j] - b[j]);
            reference.add(b[j]);
        }
    }
    let (min, max, count) = CURVE_RAD_PER_S;
    let friction_relative = (0..N).map(|j| {
        let (mut error, mut reference) = (Rms::default(), Rms::default());
        for k in 0..count {
            let speed = min + (max - min) * k as f64 / (count - 1) as f64;
            for v in [speed, -speed] {
                let truth = plant.friction[j].steady_torque_nm(v, 0.0);
                error.add(model.friction[j].torque_nm(v) - truth);
                reference.add(truth);
            }
        }
        error.rms() / reference.rms().max(f64::MIN_POSITIVE)
    });
    ModelAccuracy {
        gravity_relative: error.rms() / reference.rms().max(f64::MIN_POSITIVE),
        friction_relative: friction_relative.collect(),
    }
}

/// Converts the plant's harmonics of a motor to the controller's ripple table.
fn table_of(ripple: &[Ripple], motor: usize) -> Option<RippleTable> {
    let lines: Vec<Harmonic> = ripple
        .iter()
        .filter(|line| line.motor == motor)
        .map(|line| Harmonic {
            harmonic: line.harmonic,
            sine_nm: line.amplitude_nm * line.phase_rad.cos(),
            cosine_nm: line.amplitude_nm * line.phase_rad.sin(),
            ..Harmonic::default()
        })
        .collect();
    RippleTable::new(&lines)
}
