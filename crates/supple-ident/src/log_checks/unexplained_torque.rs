//! Torques that the given arm does not explain: at some times (contact), or in all poses (another unit, a payload, an offset).

use super::equal_values::median;
use super::finding::{Consequence, Finding, Problem};
use super::gravity::Gravities;
use super::weighted_fit::{FitContext, FitResult};
use crate::columns::Column;
use crate::error::IdentError;
use crate::motion::Motion;
use crate::regressor::joint_rows;
use nalgebra::DVector;

/// Minimum torque of a contact, relative to the median residual.
const CONTACT_OVER_NOISE: f64 = 8.0;
/// Minimum torque of a contact, relative to the standard deviation of the joint's torque.
const CONTACT_OVER_TORQUE: f64 = 0.15;
/// Maximum duration of a contact \[s\].
const MAX_CONTACT_S: f64 = 5.0;

pub(super) fn check<const N: usize>(
    context: &FitContext<'_, N>,
    motion: &Motion,
) -> Result<Vec<Finding>, IdentError> {
    let fit = context.fit(motion)?;
    let mut findings = Vec::new();
    let residuals = residuals(context, motion, &fit)?;
    findings.extend(contacts(context, motion, &fit, &residuals));
    let gravities = Gravities::new(context, motion, &fit);
    findings.extend(gravities.unit());
    findings.extend(gravities.payload());
    findings.extend(offsets(context, motion, &fit));
    Ok(findings)
}

fn residuals<const N: usize>(
    context: &FitContext<'_, N>,
    motion: &Motion,
    fit: &FitResult,
) -> Result<Vec<DVector<f64>>, IdentError> {
    let joints = joint_rows(context.arm, &context.columns, motion)?;
    Ok(joints
        .iter()
        .map(|rows| &rows.b - &rows.a * &fit.x)
        .collect())
}

/// Intervals in which the residual of a joint is far above its median.
fn contacts<const N: usize>(
    context: &FitContext<'_, N>,
    motion: &Motion,
    fit: &FitResult,
    residuals: &[DVector<f64>],
) -> Vec<Finding> {
    let mut findings: Vec<Finding> = Vec::new();
    for (residual, &joint) in residuals.iter().zip(context.columns.moving()) {
        let usual = 1.4826 * median(residual.iter().map(|r| r.abs()).collect());
        let torque = motion.tau.column(joint);
        let mean = torque.mean();
        let deviation = torque.map(|t| (t - mean).powi(2)).mean().sqrt();
        // Where a joint reverses, the model of dry friction alone may be wrong by this much.
        let dry = context.columns.position(Column::Coulomb(joint));
        let dry_nm = dry.map_or(0.0, |i| fit.x[i]);
        let bound = (CONTACT_OVER_NOISE * usual)
            .max(CONTACT_OVER_TORQUE * deviation)
            .max(1.5 * dry_nm + 3.0 * usual);
        let size = residual.iter().map(|r| r.abs());
        let (at, peak) = size.enumerate().fold(
            (0, 0.0),
            |best, (i, r)| {
                if r > best.1 { (i, r) } else { best }
            },
        );
        if peak < bound {
            continue;
        }
        let level = (3.0 * usual).max(0.2 * peak);
        let mut first = at;
        while first > 0 && residual[first - 1].abs() > level {
            first -= 1;
        }
        let mut end = at + 1;
        while end < residual.len() && residual[end].abs() > level {
            end += 1;
        }
        let span_s = (end - first) as f64 / motion.rate_hz;
        if span_s > MAX_CONTACT_S {
            continue;
        }
        let (from_s, to_s) = (motion.time_s(first), motion.time_s(end - 1));
        let mut finding = Finding::reject(
            Problem::Contact,
            &[joint],
            "tau",
            format!(
                "{peak:.1} N m that the arm does not explain, {:.0} times its usual residual, from {from_s:.2} to {to_s:.2} s: \
                 contact or a push",
                peak / usual
            ),
            "this interval is left out; record again without touching the arm",
        )
        .with(Consequence::Mask);
        let margin_s = 0.2;
        finding.intervals_s = vec![(from_s - margin_s, to_s + margin_s)];
        findings.push(finding);
    }
    findings
}

/// Offsets beyond the dry friction: in one direction the joint would be driven by its friction.
fn offsets<const N: usize>(
    context: &FitContext<'_, N>,
    motion: &Motion,
    fit: &FitResult,
) -> Vec<Finding> {
    let mut findings = Vec::new();
    for &joint in context.columns.moving() {
        let value = |column: Column| context.columns.position(column).map_or(0.0, |i| fit.x[i]);
        let (offset, dry) = (value(Column::Offset(joint)), value(Column::Coulomb(joint)));
        let torque = motion.tau.column(joint);
        let mean = torque.mean();
        let deviation = torque.map(|t| (t - mean).powi(2)).mean().sqrt();
        if offset.abs() > 1.5 * dry && offset.abs() > 0.4 * deviation {
            findings.push(
                Finding::reject(
                    Problem::TorqueOffset,
                    &[joint],
                    "tau",
                    format!(
                        "has an offset of {offset:.2} N m, more than its dry friction of {dry:.2} N m, which would drive the \
                         joint one way"
                    ),
                    format!("subtract {offset:.2} N m, or zero the torque sensor or the current"),
                )
                .with(Consequence::Reject),
            );
        }
    }
    findings
}
