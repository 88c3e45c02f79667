//! Torques that the given arm does not explain: at some times (contact), or in all poses (torques in another unit of measurement, a payload, an offset).

use super::equal_values::median;
use super::finding::{Consequence, Finding, Problem};
use super::gravity::GravityComparison;
use super::weighted_fit::{FitContext, FitResult};
use crate::columns::Column;
use crate::error::IdentError;
use crate::motion::Motion;
use crate::regressor::joint_rows;
use core::ops::Range;
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
    let gravities = GravityComparison::new(context, motion, &fit);
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

/// Finds intervals in which the residual of a joint is far above its usual size, largest residual first; one finding for each
/// joint. Longer intervals than [`MAX_CONTACT_S`] are ignored: the model is wrong there.
fn contacts<const N: usize>(
    context: &FitContext<'_, N>,
    motion: &Motion,
    fit: &FitResult,
    residuals: &[DVector<f64>],
) -> Vec<Finding> {
    let mut findings: Vec<Finding> = Vec::new();
    for (residual, &joint) in residuals.iter().zip(context.columns.identified_joints()) {
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
        let longest = (MAX_CONTACT_S * motion.rate_hz) as usize;
        let peaks = peaks(&mut sizes, bound, 3.0 * usual_nm);
        let contacts: Vec<_> = peaks
            .into_iter()
            .filter(|(_, samples)| samples.len() <= longest)
            .map(|(peak, samples)| {
                let to_s = motion.time_s(samples.end - 1);
                (peak, motion.time_s(samples.start), to_s)
            })
            .collect();
        let Some(&(peak, from_s, to_s)) = contacts.first() else {
            continue;
        };
        let others = match contacts.len() {
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
        finding.intervals_s = contacts
            .iter()
            .map(|(_, from_s, to_s)| (from_s - MARGIN_S, to_s + MARGIN_S))
            .collect();
        findings.push(finding);
    }
    findings
}

/// Returns peaks of at least `bound`, largest first, each with the surrounding samples above `level` and above a fifth of the
/// peak. The values of these samples are set to zero.
fn peaks(sizes: &mut [f64], bound: f64, level: f64) -> Vec<(f64, Range<usize>)> {
    let mut found = Vec::new();
    while let Some((at, &peak)) = sizes.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)) {
        if peak <= 0.0 || peak < bound {
            break;
        }
        let level = level.max(0.2 * peak);
        let before = sizes[..at].iter().rev().take_while(|size| **size > level);
        let first = at - before.count();
        let after = sizes[at + 1..].iter().take_while(|size| **size > level);
        let end = at + 1 + after.count();
        sizes[first..end].fill(0.0);
        found.push((peak, first..end));
    }
    found
}

/// Finds offsets of more than 1.5 times the dry friction: in one direction the friction would drive the joint.
fn offsets<const N: usize>(
    context: &FitContext<'_, N>,
    motion: &Motion,
    fit: &FitResult,
) -> Vec<Finding> {
    let mut findings = Vec::new();
    for &joint in context.columns.identified_joints() {
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

#[cfg(test)]
mod tests {
    use super::peaks;

    #[test]
    fn every_peak_is_found_with_the_samples_around_it() {
        let mut sizes = [0.1, 0.1, 2.0, 5.0, 2.0, 0.1, 0.1, 3.0, 3.5, 0.1];
        assert_eq!(peaks(&mut sizes, 1.0, 0.3), [(5.0, 2..5), (3.5, 7..9)]);
    }

    #[test]
    fn a_residual_of_zero_has_no_peak() {
        assert_eq!(peaks(&mut [0.0; 5], 0.0, 0.0), []);
    }
}
