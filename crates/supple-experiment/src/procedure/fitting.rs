//! Reads the logs of the calibration's motions, and fits models to them.

use super::error::ProcedureError;
use super::progress::FitQuality;
use crate::breakaway::JointBreakaway;
use crate::calibrate::{Knowledge, SLOW_RAD_PER_S, identify_with, without_ripple};
use nalgebra::DMatrix;
use std::path::Path;
use supple_core::controller::Mode;
use supple_core::dynamics::rnea;
use supple_core::{Config, Vector};
use supple_ident::{Fit, FrictionColumns, Log, Motion, ReadError};
use supple_log::Reader;
use supple_model::{Description, IdentifiedModel, WideThresholds};

/// Fraction of the first excitation, at its end, that is held out from the fit and validates it.
const HELD_OUT_FRACTION: f64 = 0.25;
/// Time in the excite mode up to which the start of an excitation counts as logged; its first cycles may be missing \[s\].
const MAX_START_TIME_S: f64 = 0.1;
/// Minimum range of angles of each joint in a motion that is fitted \[rad\].
const MIN_RANGE_RAD: f64 = 0.05;
/// Minimum collision threshold of a joint, as a fraction of the one in the description.
const MIN_THRESHOLD_FRACTION: f64 = 0.5;
/// Minimum and maximum ratio of measured to described breakaway torque by which the dry friction is scaled.
const BREAKAWAY_RATIO_RANGE: (f64, f64) = (0.2, 5.0);

/// Ratio of the limit for torque against a joint's acceleration to the dry friction, for geared motors.
const AGAINST_TO_DRY_FRICTION: f64 = 1.3;
/// Prior weight of the described link parameters for geared motors, whose motions show little of the inertia, in equivalent
/// samples.
const LINKS_WEIGHT: f64 = 100.0;
/// Prior standard deviation of their rotor inertias, relative to the described ones.
const ROTOR_DEVIATION: f64 = 1.0;
/// Minimum speed of the samples that are fitted, as a fraction of the peak speed of the slowest joint.
const MIN_SPEED_FRACTION: f64 = 0.3;
/// Time over which the speed of a joint is averaged \[s\].
const SPEED_AVERAGING_S: f64 = 0.1;

/// The excitations in a log, in order, one log each.
///
/// # Errors
/// A log that cannot be read.
pub fn excitations<const N: usize>(file: &Path) -> Result<Vec<Log>, ProcedureError> {
    let reader = Reader::open(file)?;
    let mut logs = Vec::new();
    let mut rows: Vec<(f64, Vector<N>, Vector<N>)> = Vec::new();
    let mut last_s = f64::INFINITY;
    for record in reader.records::<N>()? {
        let record = record?;
        let value = record.value;
        let excited_s = match value.mode() {
            Some(Mode::Excite) => value.mode_time_s,
            _ => f64::INFINITY,
        };
        if excited_s.is_infinite() || excited_s < last_s {
            logs.extend(log_of(&mut rows));
        }
        // A log may begin while the arm rests at the end of an earlier excitation.
        let begins = excited_s < MAX_START_TIME_S && excited_s < last_s;
        if begins || (excited_s.is_finite() && !rows.is_empty()) {
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

/// `model` with its dry friction scaled to the measured breakaway torques.
///
/// # Errors
/// If the description cannot be edited.
pub fn with_breakaway<const N: usize>(
    model: &Description,
    breakaway: &[JointBreakaway],
) -> Result<Description, ProcedureError> {
    let config = model.config::<N>()?;
    let friction = core::array::from_fn(|joint| {
        let mut friction = config.friction[joint];
        if let Some(found) = breakaway.get(joint)
            && friction.breakaway_nm > 0.0
        {
            let (min, max) = BREAKAWAY_RATIO_RANGE;
            let ratio = (found.breakaway_nm() / friction.breakaway_nm).clamp(min, max);
            friction.breakaway_nm *= ratio;
            friction.coulomb_nm *= ratio;
        }
        friction
    });
    Ok(model.with_model(&IdentifiedModel {
        arm: &config.arm,
        friction: &friction,
        ripple: None,
        source: "dry friction scaled to measured breakaway torques",
    })?)
}

/// All motions with position control in a log, moves and excitations; empty if no motion is long enough.
///
/// # Errors
/// A log that cannot be read.
pub fn all_motion<const N: usize>(file: &Path) -> Result<Vec<Log>, ProcedureError> {
    match supple_ident::read_mcap::<N>(file) {
        Ok(logs) => Ok(logs.into_iter().filter(all_move).collect()),
        Err(ReadError::Table { .. }) => Ok(Vec::new()),
        Err(error) => Err(ProcedureError::Resume {
            file: file.to_owned(),
            problem: error.to_string(),
        }),
    }
}

/// Whether every joint moves: only such motions can be fitted.
fn all_move(log: &Log) -> bool {
    let mut columns = log.q_rad.column_iter();
    columns.all(|q| q.max() - q.min() > MIN_RANGE_RAD)
}

/// Fits `others` and the first excitation without its end, which validates the fit. `None` if the fit predicts the torques there
/// no better than `model`.
///
/// # Errors
/// A log that cannot be used.
pub fn fit_first<const N: usize>(
    model: &Description,
    excitation: &Log,
    others: &[Log],
) -> Result<Option<(Description, FitQuality)>, ProcedureError> {
    let config = model.config::<N>()?;
    let rows = excitation.t_s.len();
    let cut = ((1.0 - HELD_OUT_FRACTION) * rows as f64) as usize;
    let (fitted, unseen) = (part(excitation, 0, cut), part(excitation, cut, rows - cut));
    let mut logs = vec![fitted];
    logs.extend_from_slice(others);
    let (fit, _) = identify_with(
        &config,
        &logs,
        &[],
        &knowledge(model),
        min_fitted_rad_per_s(&logs),
    )?;
    let unseen = prepared(&unseen, &fit)?;
    let quality = quality(&config, &fit, &unseen)?;
    let is_better = quality.unseen_relative < quality.unseen_relative_before;
    if !is_better {
        return Ok(None);
    }
    Ok(Some((fit.description(model, None)?, quality)))
}

/// Fits the excitation, the slow motions and the runs at constant speed, and validates the fit on `unseen`. The collision
/// thresholds come from the residuals on these and on `others`, such as moves.
///
/// # Errors
/// A log that cannot be used.
pub fn fit_all<const N: usize>(
    model: &Description,
    logs: &[Log],
    constant_speed: &[Log],
    unseen: &Log,
    others: &[Log],
) -> Result<(Description, FitQuality), ProcedureError> {
    let config = model.config::<N>()?;
    let (known, min_rad_per_s) = (knowledge(model), min_fitted_rad_per_s(logs));
    let (fit, ripple) = identify_with(&config, logs, constant_speed, &known, min_rad_per_s)?;
    let motor_from_joint = *supple_core::Controller::new(config)?.motor_from_joint();
    let unseen = without_ripple(unseen, &ripple, &motor_from_joint);
    let unseen = prepared(&unseen, &fit)?;
    let quality = quality(&config, &fit, &unseen)?;
    let described = fit.description(model, Some(&ripple))?;
    let mut validations = vec![fit.validate_motion(&unseen)?];
    for log in logs.iter().chain(others) {
        let log = without_ripple(log, &ripple, &motor_from_joint);
        validations.push(fit.validate_motion(&prepared(&log, &fit)?)?);
    }
    let present_nm = config.collision.move_joint_torque_nm;
    let mut thresholds = fit.move_collision_nm(&validations, &config);
    for (joint, threshold_nm) in thresholds.iter_mut().enumerate() {
        // The observer is faster than the filter of the residuals.
        let min_nm = MIN_THRESHOLD_FRACTION * present_nm[joint];
        *threshold_nm = threshold_nm.map(|nm| nm.max(min_nm));
    }
    let described = match model.bus() {
        Some(_) => with_friction_either_way::<N>(&described)?,
        None => described,
    };
    Ok((described.with_move_collision(&thresholds)?, quality))
}

/// `model` with a limit for torque against a joint's acceleration that is above the dry friction: at rest this acts in either
/// direction.
fn with_friction_either_way<const N: usize>(
    model: &Description,
) -> Result<Description, ProcedureError> {
    let config = model.config::<N>()?;
    let limits_nm = &config.limits.joint_torque_nm;
    let dry = Vector::<N>::from_fn(|j, _| config.friction[j].breakaway_nm / limits_nm[j]);
    let wide = WideThresholds {
        move_share: 0.0,
        joint_torque_nm: None,
        tip_force_n: 0.0,
        hold_pose: false,
        load_n: 0.0,
        against_share: AGAINST_TO_DRY_FRICTION * dry.max(),
    };
    Ok(model.with_wide_thresholds(&wide)?)
}

/// Prior knowledge of an arm. The friction of geared motors (those on a bus) grows with their load. Gravity leaves them
/// little torque, so that they move slowly and their torques show little of the inertia: without a prior, errors of the friction
/// model would appear as inertias of rotors and links.
fn knowledge(model: &Description) -> Knowledge {
    match model.bus() {
        None => Knowledge::of(FrictionColumns::OFFSET),
        Some(_) => Knowledge {
            friction: FrictionColumns {
                load: true,
                ..FrictionColumns::OFFSET
            },
            links_weight: LINKS_WEIGHT,
            rotor_deviation: Some(ROTOR_DEVIATION),
        },
    }
}

/// Minimum speed of the samples that are fitted \[rad/s\]: lower than usual if a joint is always slow.
fn min_fitted_rad_per_s(logs: &[Log]) -> f64 {
    let joints = logs.first().map_or(0, |log| log.q_rad.ncols());
    let slowest = (0..joints).map(|joint| {
        let of_log = |log: &Log| peak_rad_per_s(log, joint);
        logs.iter().map(of_log).fold(0.0, f64::max)
    });
    SLOW_RAD_PER_S.min(MIN_SPEED_FRACTION * slowest.fold(f64::INFINITY, f64::min))
}

/// Peak speed of a joint in a log, averaged over [`SPEED_AVERAGING_S`].
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

fn part(log: &Log, first: usize, rows: usize) -> Log {
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
    unseen: &Motion,
) -> Result<FitQuality, ProcedureError> {
    let validation = fit.validate_motion(unseen)?;
    let (mut error, mut torque) = (0.0, 0.0);
    for row in 0..unseen.samples() {
        let at = |m: &DMatrix<f64>| Vector::<N>::from_fn(|j, _| m[(row, j)]);
        let (q, qd, qdd, tau) = (
            at(&unseen.q),
            at(&unseen.qd),
            at(&unseen.qdd),
            at(&unseen.tau),
        );
        let friction = Vector::from_fn(|j, _| before.friction[j].torque_nm(qd[j]));
        error += (rnea(&before.arm, &q, &qd, &qdd) + friction - tau).norm_squared();
        torque += tau.norm_squared();
    }
    Ok(FitQuality {
        training_relative: fit.training_relative,
        unseen_relative: validation.total_relative,
        unseen_relative_before: (error / torque.max(f64::MIN_POSITIVE)).sqrt(),
        unseen_rms_nm: validation.rms_nm.clone(),
        verdict: validation.verdict(),
    })
}
