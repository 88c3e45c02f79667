//! Torques that the given arm does not explain: at some times (contact), or in all poses (torques in another unit of measurement, a payload, an offset).

use super::equal_values::median;
use super::finding::{Consequence, Finding, Problem};
use super::gravity::Gravities;
use super::weighted_fit::{FitContext, FitResult};
use crate::columns::Column;
use crate::error::IdentError;
use crate::motion::Motion;
use crate::regressor::joint_rows;
use nalgebra::DVector;

/// Minimum torque of a contact, relative to the residual's robust standard deviation.
const CONTACT_OVER_NOISE: f64 = 8.0;
/// Minimum torque of a contact, relative to the standard deviation of the joint's torque.
const CONTACT_OVER_TORQUE: f64 = 0.15;
/// Maximum duration of a contact \[s\].
const MAX_CONTACT_S: f64 = 5.0;
/// Time around a contact that is left out too \[s\].
const MARGIN_S: f64 = 0.2;

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

/// Intervals in which the residual of a joint is far above its usual size, largest residual first; one finding for each
/// joint. What lasts longer than a contact is no such interval: the model is wrong there.
fn contacts<const N: usize>(
    context: &FitContext<'_, N>,
    motion: &Motion,
    fit: &FitResult,
    residuals: &[DVector<f64>],
) -> Vec<Finding> {
    let mut findings: Vec<Finding> = Vec::new();
    for (residual, &joint) in residuals.iter().zip(context.columns.moving()) {
        let mut sizes: Vec<f64> = residual.iter().map(|r| r.abs()).collect();
        // Standard deviation of a normal distribution with this median.
        let usual_nm = 1.4826 * median(sizes.clone());
        let torque = motion.tau.column(joint);
        let mean = torque.mean();
        let deviation = torque.map(|t| (t - mean).powi(2)).mean().sqrt();
        // Where a joint reverses, the residual may reach 1.5 times the Coulomb friction without a contact.
        let dry = context.columns.position(Column::Coulomb(joint));
        let dry_nm = dry.map_or(0.0, |i| fit.x[i]);
        let bound = (CONTACT_OVER_NOISE * usual_nm)
            .max(CONTACT_OVER_TORQUE * deviation)
            .max(1.5 * dry_nm + 3.0 * usual_nm);
        let mut intervals_s = Vec::new();
        let mut largest = None;
        while let Some((at, peak)) = largest_of(&sizes).filter(|(_, peak)| *peak >= bound) {
            let level = (3.0 * usual_nm).max(0.2 * peak);
            let first = (0..at).rev().take_while(|&i| sizes[i] > level).last();
            let first = first.unwrap_or(at);
            let end = at + 1 + sizes[at + 1..].iter().take_while(|r| **r > level).count();
            sizes[first..end].fill(0.0);
            if (end - first) as f64 / motion.rate_hz > MAX_CONTACT_S {
                continue;
            }
            let (from_s, to_s) = (motion.time_s(first), motion.time_s(end - 1));
            largest = largest.or(Some((peak, from_s, to_s)));
            intervals_s.push((from_s - MARGIN_S, to_s + MARGIN_S));
        }
        let Some((peak, from_s, to_s)) = largest else {
            continue;
        };
        let others = match intervals_s.len() {
            1 => String::new(),
            count => format!(", and in {} other intervals", count - 1),
        };
        let mut finding = Finding::reject(
            Problem::Contact,
            &[joint],
            "tau",
            format!(
                "{peak:.1} N m that the arm does not explain, its usual residual is {usual_nm:.2} N m, from {from_s:.2} to \
                 {to_s:.2} s{others}: contact or a push"
            ),
            "these intervals are left out; record again without touching the arm",
        )
        .with(Consequence::Mask);
        finding.intervals_s = intervals_s;
        findings.push(finding);
    }
    findings
}

/// The largest value with its index; `None` without any.
fn largest_of(values: &[f64]) -> Option<(usize, f64)> {
    let values = values.iter().copied().enumerate();
    values.max_by(|a, b| a.1.total_cmp(&b.1))
}

/// Offsets of more than 1.5 times the dry friction: in one direction the joint would be driven by its friction.
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
                        "has an offset of {offset:.2} N m, more than 1.5 times its dry friction of {dry:.2} N m, which would \
                         drive the joint one way"
                    ),
                    format!("subtract {offset:.2} N m, or zero the torque sensor or the current"),
                )
                .with(Consequence::Reject),
            );
        }
    }
    findings
}
