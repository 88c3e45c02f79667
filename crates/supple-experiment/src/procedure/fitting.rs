//! Reads the logs of the calibration's motions, and fits models to them.

use super::error::ProcedureError;
use super::progress::FitQuality;
use crate::breakaway::JointBreakaway;
use crate::calibrate::{FitOptions, SLOW_RAD_PER_S, identify_with, with_ripple_torque};
use crate::residual_error::{ErrorInterval, error_interval_of, feedforward_residual_nm};
use crate::scenario::STIFFNESS_N_PER_M;
use crate::weighing_result::WeighingResult;
use nalgebra::DMatrix;
use std::path::Path;
use supple_core::controller::Mode;
use supple_core::friction::LoadTorque;
use supple_core::{Config, RippleTable, Vector};
use supple_ident::weigh::weigh;
use supple_ident::{Fit, FrictionColumns, Log, Motion, ReadError};
use supple_log::Reader;
use supple_model::{Description, IdentifiedModel, MinimumThresholds};

/// Fraction of the first excitation, at its end, that is excluded from the fit and validates it.
const HELD_OUT_FRACTION: f64 = 0.25;
/// Maximum time in the excite mode at the first record of an excitation \[s\]: the log may lack its first cycles, but not more.
const MAX_START_TIME_S: f64 = 0.1;
/// Minimum range of angles of each joint in a motion that is fitted \[rad\].
const MIN_RANGE_RAD: f64 = 0.05;
/// Greatest collision threshold that friction may make necessary, as a fraction of the joint's torque limit.
const MAX_THRESHOLD_SHARE: f64 = 0.5;
/// Minimum collision threshold of a joint in the modes with stiff joint loops, as a fraction of the one in the description.
const MIN_THRESHOLD_FRACTION: f64 = 0.5;
/// Minimum and maximum ratio of measured to described breakaway torque by which the dry friction is scaled.
const BREAKAWAY_RATIO_RANGE: (f64, f64) = (0.2, 5.0);

/// Ratio of `plausible.against_share` to the dry friction as a fraction of the torque limit, for arms with `[bus]`.
const AGAINST_TO_DRY_FRICTION: f64 = 1.3;
/// Weight of the link parameters in the description as a prior, for arms with `[bus]`, in equivalent samples. The motions of
/// their geared motors contain little information about the inertia.
const GEARED_PRIOR_WEIGHT: f64 = 100.0;
/// Prior standard deviation of the rotor inertias of such arms, relative to those in the description.
const GEARED_ROTOR_DEVIATION: f64 = 1.0;
/// Minimum speed of the samples that are fitted, as a fraction of the peak speed of the slowest joint.
const MIN_SPEED_FRACTION: f64 = 0.3;
/// Time over which the speed of a joint is averaged \[s\].
const SPEED_AVERAGING_S: f64 = 0.1;

/// Reads the excitations in a log: one [`Log`] for each, in order of time.
///
/// # Errors
/// A log that cannot be read.
pub fn read_excitations<const N: usize>(file: &Path) -> Result<Vec<Log>, ProcedureError> {
    let reader = Reader::open(file)?;
    let mut logs = Vec::new();
    let mut rows: Vec<(f64, Vector<N>, Vector<N>)> = Vec::new();
    let mut last_s = None;
    for record in reader.records::<N>()? {
        let record = record?;
        let value = record.value;
        let excited_s = match value.mode() {
            Some(Mode::Excite) => Some(value.mode_time_s),
            _ => None,
        };
        let continues = match (excited_s, last_s) {
            (Some(now_s), Some(last_s)) => now_s >= last_s,
            _ => false,
        };
        if !continues {
            logs.extend(log_of(&mut rows));
        }
        // A log may begin while the arm rests at the end of an earlier excitation: such a rest is not an excitation.
        let begins = !continues && excited_s.is_some_and(|time_s| time_s < MAX_START_TIME_S);
        if begins || (continues && !rows.is_empty()) {
            // The compensation of the ripple cancels that of the motor: the joint gets the rest.
            let torque_nm = value.torque_nm - value.torques.ripple;
            rows.push((record.time_ns as f64 * 1e-9, value.position_rad, torque_nm));
        }
        last_s = excited_s;
    }
    logs.extend(log_of(&mut rows));
    Ok(logs)
}

fn log_of<const N: usize>(rows: &mut Vec<(f64, Vector<N>, Vector<N>)>) -> Option<Log> {
    let rows = std::mem::take(rows);
    let start_s = rows.first()?.0;
    Some(Log {
        t_s: rows.iter().map(|row| row.0 - start_s).collect(),
        q_rad: DMatrix::from_fn(rows.len(), N, |i, j| rows[i].1[j]),
        qd_rad_per_s: None,
        tau_nm: DMatrix::from_fn(rows.len(), N, |i, j| rows[i].2[j]),
    })
}

/// Returns `model` with its dry friction scaled to the measured breakaway torques.
///
/// # Errors
/// If the description cannot be edited.
pub fn scale_dry_friction<const N: usize>(
    model: &Description,
    breakaway: &[JointBreakaway],
) -> Result<Description, ProcedureError> {
    let config = model.config::<N>()?;
    let friction = core::array::from_fn(|joint| {
        let friction = config.friction[joint];
        if let Some(found) = breakaway.get(joint)
            && friction.breakaway_nm > 0.0
        {
            let (min, max) = BREAKAWAY_RATIO_RANGE;
            let ratio = (found.breakaway_nm() / friction.breakaway_nm).clamp(min, max);
            return friction.with_dry_scaled(ratio);
        }
        friction
    });
    let source = "dry friction scaled to measured breakaway torques";
    let scaled = model.with_model(&IdentifiedModel {
        arm: &config.arm,
        friction: &friction,
        ripple: None,
        source,
    })?;
    match model.settings().learned {
        Some(_) => Ok(scaled.with_learned(&config.learned, source)?),
        None => Ok(scaled),
    }
}

/// Reads the motions of a log that have no contact and a reference for at least 2 s, and in which every joint moves.
///
/// # Errors
/// A log that cannot be read.
pub fn read_position_controlled_motions<const N: usize>(
    file: &Path,
) -> Result<Vec<Log>, ProcedureError> {
    match supple_ident::read_mcap::<N>(file) {
        Ok(logs) => Ok(logs.into_iter().filter(every_joint_moves).collect()),
        Err(ReadError::Table { .. }) => Ok(Vec::new()),
        Err(error) => Err(ProcedureError::ReadLog {
            file: file.to_owned(),
            problem: error.to_string(),
        }),
    }
}

/// Returns whether every joint moves by [`MIN_RANGE_RAD`] or more: only such motions can be fitted.
fn every_joint_moves(log: &Log) -> bool {
    let mut columns = log.q_rad.column_iter();
    columns.all(|q| q.max() - q.min() > MIN_RANGE_RAD)
}

/// Result of the first fit.
pub enum FirstFit {
    /// The model of the fit.
    Better(Box<Description>, FitQuality),
    /// The model before the fit stays, for this reason.
    Rejected(String),
}

/// Fits a model to `others` and to the excitation without its end, which validates the fit. The fit is rejected if it predicts the
/// torques of that end no better than `model`, or if no controller starts with it even with less damping: after so little motion
/// the identified rotor inertias may be zero, and any damping would then make the joint unstable.
///
/// # Errors
/// A log that cannot be used.
pub fn fit_first<const N: usize>(
    model: &Description,
    excitation: &Log,
    others: &[Log],
) -> Result<FirstFit, ProcedureError> {
    let config = model.config::<N>()?;
    let rows = excitation.t_s.len();
    let cut = ((1.0 - HELD_OUT_FRACTION) * rows as f64) as usize;
    let (fitted, held_out) = (
        log_rows(excitation, 0, cut),
        log_rows(excitation, cut, rows - cut),
    );
    let mut logs = vec![fitted];
    logs.extend_from_slice(others);
    // Some twenty seconds at a quarter of the amplitude do not determine springs and tilt.
    let (fit, _) = identify_best(model, &config, &logs, &[], false)?;
    let quality = quality(&config, &fit, &prepared(&held_out, &fit)?)?;
    let is_better = quality.validation_relative < quality.validation_relative_before;
    if !is_better {
        return Ok(FirstFit::Rejected(format!(
            "it leaves {:.1} % of the torque at the end of the pass unexplained, the model before it {:.1} %",
            100.0 * quality.validation_relative,
            100.0 * quality.validation_relative_before
        )));
    }
    let found = fit.description(model, None)?.with_stable_damping::<N>();
    let found = found.and_then(|(found, _)| found.completed().map(|_| found));
    Ok(match found {
        Ok(found) => FirstFit::Better(Box::new(found), quality),
        Err(error) => FirstFit::Rejected(format!("no controller starts with it: {error}")),
    })
}

/// Fits a model to `logs` (excitations and slow motions) and the torque ripple to `constant_speed`, and validates both on the
/// motion `validation`. The joints that `start` holds are also held for the interval of the tracking error. The collision
/// thresholds are derived from the residuals of `logs`, `validation` and `others`, such as moves.
///
/// # Errors
/// A log that cannot be used.
pub fn fit_all<const N: usize>(
    model: &Description,
    start: &Description,
    logs: &[Log],
    constant_speed: &[Log],
    validation: &Log,
    others: &[Log],
) -> Result<(Description, FitQuality), ProcedureError> {
    let config = model.config::<N>()?;
    let (fit, ripple) = identify_best(model, &config, logs, constant_speed, true)?;
    let motor_from_joint = *supple_core::Controller::new(config)?.motor_from_joint();
    let validation = with_ripple_torque(validation, &ripple, &motor_from_joint);
    let validation = prepared(&validation, &fit)?;
    let mut quality = quality(&config, &fit, &validation)?;
    let described = fit.description(model, Some(&ripple))?;
    quality.interval_at_5_n_per_m = interval(&fit, &described, start, &validation);
    let mut validations = vec![fit.validate_motion(&validation)?];
    for log in logs.iter().chain(others) {
        let log = with_ripple_torque(log, &ripple, &motor_from_joint);
        validations.push(fit.validate_motion(&prepared(&log, &fit)?)?);
    }
    let described = match model.bus() {
        Some(_) => raise_thresholds(&described, &fit.collision_nm(&validations, &config))?,
        None => described,
    };
    let config = described.config::<N>()?;
    let present_nm = config.collision.move_joint_torque_nm;
    let mut thresholds = fit.move_collision_nm(&validations, &config);
    for (joint, threshold_nm) in thresholds.iter_mut().enumerate() {
        // The filter of the residuals has a lower cutoff than the collision observer and removes its peaks.
        let min_nm = MIN_THRESHOLD_FRACTION * present_nm[joint];
        *threshold_nm = threshold_nm.map(|nm| nm.max(min_nm));
    }
    Ok((described.with_move_collision(&thresholds)?, quality))
}

/// Estimates the torque scales from the motions of [`fit_all`] and a log with a weight of `weight_kg` \[kg\].
///
/// # Errors
/// Logs that cannot be used, or that do not determine the scales.
pub fn weigh_arm<const N: usize>(
    model: &Description,
    [logs, constant_speed]: &[Vec<Log>; 2],
    weighted: &Log,
    weight_kg: f64,
) -> Result<WeighingResult, ProcedureError> {
    let config = model.config::<N>()?;
    let (fit, ripple) = identify_best(model, &config, logs, constant_speed, true)?;
    let motor_from_joint = *supple_core::Controller::new(config)?.motor_from_joint();
    let motion_of = |log: &Log| {
        let log = with_ripple_torque(log, &ripple, &motor_from_joint);
        prepared(&log, &fit)
    };
    let without = logs.iter().map(motion_of).collect::<Result<Vec<_>, _>>()?;
    let found = weigh(&fit, &without, &[motion_of(weighted)?], weight_kg)?;
    Ok(WeighingResult::new(weight_kg, &found, model.joint_names()))
}

/// Returns `model` with thresholds that its dry friction does not exceed: the collision thresholds of its joints are at least
/// `least_nm`, up to half of their torque limits, and `plausible.against_share`, the limit for torque against a joint's
/// acceleration, is above the dry friction: when a joint begins to move, the torque may still have the other sign by that much.
fn raise_thresholds<const N: usize>(
    model: &Description,
    least_nm: &[Option<f64>; N],
) -> Result<Description, ProcedureError> {
    let config = model.config::<N>()?;
    let limits_nm = &config.limits.joint_torque_nm;
    let raised_nm = |j: usize| {
        let present_nm = config.collision.joint_torque_nm[j];
        let least_nm = least_nm[j].unwrap_or(0.0);
        present_nm.max(least_nm.min(MAX_THRESHOLD_SHARE * limits_nm[j]))
    };
    let dry = Vector::<N>::from_fn(|j, _| {
        let friction = &config.friction[j];
        // Friction that grows with the load of a gear is greatest at the torque limit.
        let loaded_nm =
            friction.load_coefficient * (limits_nm[j] - friction.coulomb_at_nm).max(0.0);
        (friction.breakaway_nm + loaded_nm) / limits_nm[j]
    });
    let minimum = MinimumThresholds {
        move_share: 0.0,
        joint_torque_nm: Some((0..N).map(raised_nm).collect()),
        tip_force_n: 0.0,
        hold_pose: false,
        load_n: 0.0,
        stiction_factor: 1.0,
        against_share: AGAINST_TO_DRY_FRICTION * dry.max(),
        joint_tracking_error_rad: 0.0,
    };
    Ok(model.with_minimum_thresholds(&minimum)?)
}

/// Runs [`identify_with`] for all [`fit_options`], and returns the fit that leaves the smallest part of the torques unexplained.
fn identify_best<const N: usize>(
    model: &Description,
    config: &Config<N>,
    logs: &[Log],
    constant_speed: &[Log],
    effects: bool,
) -> Result<(Fit<N>, [RippleTable; N]), ProcedureError> {
    let min_rad_per_s = min_fitted_rad_per_s(logs);
    let (first, others) = fit_options(model);
    let with = |options: FitOptions| FitOptions { effects, ..options };
    let (first, others) = (
        with(first),
        others.into_iter().map(with).collect::<Vec<_>>(),
    );
    let mut best = identify_with(config, logs, constant_speed, &first, min_rad_per_s)?;
    for options in &others {
        let other = identify_with(config, logs, constant_speed, options, min_rad_per_s)?;
        if other.0.training_relative < best.0.training_relative {
            best = other;
        }
    }
    Ok(best)
}

/// Returns friction terms and priors of the fits to try. Arms with `[bus]` have geared motors, whose friction grows with their
/// load. These motors need most of their torque against gravity, so that they move slowly and their torques contain little
/// information about the inertia: without a prior, errors of the friction model would be fitted as inertias of rotors and links.
fn fit_options(model: &Description) -> (FitOptions, Vec<FitOptions>) {
    let geared = |load: LoadTorque| FitOptions {
        friction: FrictionColumns {
            load: Some(load),
            asymmetry: true,
            ..FrictionColumns::COULOMB_AND_OFFSET
        },
        prior_weight: GEARED_PRIOR_WEIGHT,
        rotor_deviation: Some(GEARED_ROTOR_DEVIATION),
        effects: true,
    };
    match model.bus() {
        None => (
            FitOptions::new(FrictionColumns::COULOMB_AND_OFFSET),
            Vec::new(),
        ),
        Some(_) => (geared(LoadTorque::Joint), vec![geared(LoadTorque::Motor)]),
    }
}

/// Returns the minimum speed of the samples that are fitted \[rad/s\]: [`SLOW_RAD_PER_S`], or less if a joint never reaches that
/// speed.
fn min_fitted_rad_per_s(logs: &[Log]) -> f64 {
    let joints = logs.first().map_or(0, |log| log.q_rad.ncols());
    let slowest = (0..joints).map(|joint| {
        let of_log = |log: &Log| peak_rad_per_s(log, joint);
        logs.iter().map(of_log).fold(0.0, f64::max)
    });
    SLOW_RAD_PER_S.min(MIN_SPEED_FRACTION * slowest.fold(f64::INFINITY, f64::min))
}

/// Returns the peak speed of a joint in a log, averaged over [`SPEED_AVERAGING_S`].
fn peak_rad_per_s(log: &Log, joint: usize) -> f64 {
    let mut first = 0;
    let mut peak: f64 = 0.0;
    for (last, t_s) in log.t_s.iter().enumerate() {
        let elapsed_s = t_s - log.t_s[first];
        if elapsed_s >= SPEED_AVERAGING_S {
            let travel_rad = log.q_rad[(last, joint)] - log.q_rad[(first, joint)];
            peak = peak.max(travel_rad.abs() / elapsed_s);
            first = last;
        }
    }
    peak
}

fn log_rows(log: &Log, first: usize, rows: usize) -> Log {
    Log {
        t_s: log.t_s[first..first + rows].to_vec(),
        q_rad: log.q_rad.rows(first, rows).into_owned(),
        qd_rad_per_s: None,
        tau_nm: log.tau_nm.rows(first, rows).into_owned(),
    }
}

fn prepared<const N: usize>(log: &Log, fit: &Fit<N>) -> Result<Motion, ProcedureError> {
    let joints: Vec<usize> = (0..N).collect();
    Ok(Motion::prepare(log, N, &joints, &fit.preparation)?.0)
}

fn quality<const N: usize>(
    before: &Config<N>,
    fit: &Fit<N>,
    motion: &Motion,
) -> Result<FitQuality, ProcedureError> {
    let validation = fit.validate_motion(motion)?;
    let joints: Vec<usize> = (0..N).collect();
    let error = feedforward_residual_nm(before, &joints, motion).norm();
    let torque = motion.tau.norm();
    Ok(FitQuality {
        training_relative: fit.training_relative,
        validation_relative: validation.total_relative,
        validation_relative_before: error / torque.max(f64::MIN_POSITIVE),
        validation_rms_nm: validation.rms_nm.clone(),
        verdict: validation.verdict(),
        interval_at_5_n_per_m: None,
    })
}

/// Returns the interval of the tracking error at 5 N/m of a controller with the model `described`, which holds the joints that
/// `start` holds; `None` also for a model that no controller accepts.
fn interval<const N: usize>(
    fit: &Fit<N>,
    described: &Description,
    start: &Description,
    motion: &Motion,
) -> Option<ErrorInterval> {
    let described = described.with_held_joints_of(start).ok()?;
    let moving = fit.columns.identified_joints();
    error_interval_of::<N>(&described, moving, &[motion], STIFFNESS_N_PER_M)
        .ok()
        .flatten()
}
