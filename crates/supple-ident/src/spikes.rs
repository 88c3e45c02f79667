//! Removes spikes: one to three samples of a column far from those before and after them, as lost bits of a bus or a bad contact of an
//! encoder write them. A filter would smear each of them over its period.
//!
//! A spike differs from the line through its neighbours by [`FAR`] times the third greatest difference of two samples on either side, so that
//! noise, contact and fast motion, which change several samples, are none; it is replaced by that line.

use crate::error::Warning;
use crate::log::Log;
use nalgebra::DMatrix;

/// Greatest number of samples of a spike.
const MAX_SAMPLES: usize = 3;
/// Number of samples on both sides that show how much the column changes nearby.
const NEARBY: usize = 8;
/// Distance from the line, in greatest differences nearby.
const FAR: f64 = 8.0;
/// Minimum distance from the line, as a fraction of the column's range without its extreme hundredths.
const MIN_SHARE: f64 = 0.05;
/// Fraction of the samples above which what looks like spikes belongs to the signal.
const MAX_SHARE: f64 = 0.01;

/// Returns the log without spikes, if it has any, and a warning for each column that has some.
pub(crate) fn without_spikes(log: &Log) -> Option<(Log, Vec<Warning>)> {
    let mut cleaned = log.clone();
    let mut warnings = Vec::new();
    let matrices = [
        ("q", Some(&mut cleaned.q_rad)),
        ("qd", cleaned.qd_rad_per_s.as_mut()),
        ("tau", Some(&mut cleaned.tau_nm)),
    ];
    for (name, matrix) in matrices {
        let Some(matrix) = matrix else { continue };
        for joint in 0..matrix.ncols() {
            let found = repair(matrix, joint);
            let Some(&(first, distance)) = found.first() else {
                continue;
            };
            warnings.push(Warning {
                column: format!("{name}[{joint}]"),
                problem: format!(
                    "has {} {} of one to {MAX_SAMPLES} samples, the first at {:.3} s, {distance:.3} off",
                    found.len(),
                    if found.len() == 1 { "spike" } else { "spikes" },
                    log.t_s[first]
                ),
                remedy: "they were replaced by lines; look for a bad contact, or lost or damaged messages".to_owned(),
            });
        }
    }
    (!warnings.is_empty()).then_some((cleaned, warnings))
}

/// Replaces the spikes of a column; returns the first sample and the distance from the line of each.
fn repair(matrix: &mut DMatrix<f64>, joint: usize) -> Vec<(usize, f64)> {
    let values: Vec<f64> = matrix.column(joint).iter().copied().collect();
    let range = range_without_extremes(&values);
    // A joint at rest changes by the resolution of its encoder.
    if range == 0.0 {
        return Vec::new();
    }
    let least = MIN_SHARE * range;
    let mut found = Vec::new();
    let mut at = 1;
    while at + 1 < values.len() {
        let Some((samples, distance)) = (1..=MAX_SAMPLES)
            .find_map(|samples| Some((samples, spike(&values, at, samples, least)?)))
        else {
            at += 1;
            continue;
        };
        found.push((at, samples, distance));
        at += samples + 1;
    }
    let all: usize = found.iter().map(|(_, samples, _)| samples).sum();
    if all as f64 > (MAX_SHARE * values.len() as f64).max(1.0) {
        return Vec::new();
    }
    for &(first, samples, _) in &found {
        for k in 0..samples {
            matrix[(first + k, joint)] = line(&values, first, samples, k);
        }
    }
    let places = found.iter().map(|&(first, _, distance)| (first, distance));
    places.collect()
}

/// Returns the least distance from the line of a spike of this many samples; `None` if they are none.
fn spike(values: &[f64], first: usize, samples: usize, least: f64) -> Option<f64> {
    let after = first + samples;
    if after >= values.len() {
        return None;
    }
    let mut distance = f64::INFINITY;
    let mut sign = 0.0;
    for k in 0..samples {
        let off = values[first + k] - line(values, first, samples, k);
        if k > 0 && off.signum() != sign {
            return None;
        }
        sign = off.signum();
        distance = distance.min(off.abs());
    }
    // The two greatest differences of a side may be those of another spike.
    let differences = |range: &[f64]| {
        let pairs = range.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        let mut all: Vec<f64> = pairs.collect();
        all.sort_by(|a, b| b.total_cmp(a));
        all.get(2).or(all.first()).copied().unwrap_or(0.0)
    };
    let across = (values[after] - values[first - 1]).abs();
    let nearby = differences(&values[first.saturating_sub(NEARBY)..first])
        .max(differences(
            &values[after..values.len().min(after + NEARBY)],
        ))
        .max(across);
    (distance > least && distance > FAR * nearby).then_some(distance)
}

/// Returns the value at sample `k` of a spike on the line between its neighbours.
fn line(values: &[f64], first: usize, samples: usize, k: usize) -> f64 {
    let (before, after) = (values[first - 1], values[first + samples]);
    before + (after - before) * (k + 1) as f64 / (samples + 1) as f64
}

fn range_without_extremes(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let hundredth = values.len() / 100;
    sorted[values.len() - 1 - hundredth] - sorted[hundredth]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log(change: impl Fn(usize, usize) -> f64) -> Log {
        let samples = 2000;
        let t_s: Vec<f64> = (0..samples).map(|i| i as f64 / 500.0).collect();
        let swing = |i: usize, j: usize| (t_s[i] * (2.0 + j as f64)).sin();
        Log {
            q_rad: DMatrix::from_fn(samples, 2, swing),
            qd_rad_per_s: None,
            tau_nm: DMatrix::from_fn(samples, 2, |i, j| 10.0 * swing(i, j) + change(i, j)),
            t_s,
        }
    }

    #[test]
    fn spikes_of_up_to_three_samples_are_replaced_and_named() {
        let clean = log(|_, _| 0.0);
        let spiked = log(|i, j| match (i, j) {
            (300, 0) => 40.0,
            (304, 0) => 38.0,
            (900..=902, 1) => -15.0,
            (1500, 1) => 5.0,
            _ => 0.0,
        });
        let (cleaned, warnings) = without_spikes(&spiked).expect("spikes");
        assert!((cleaned.tau_nm - clean.tau_nm).amax() < 1e-2);
        let text: Vec<String> = warnings.iter().map(Warning::to_string).collect();
        assert_eq!(text.len(), 2, "{text:?}");
        assert!(
            text[0].contains("tau[0]: has 2 spikes") && text[0].contains("0.600 s"),
            "{text:?}"
        );
        assert!(text[1].contains("tau[1]: has 2 spikes"), "{text:?}");
    }

    #[test]
    fn noise_steps_contact_and_many_outliers_stay() {
        let noise = |i: usize, j: usize| {
            let x = ((i * 7919 + j * 104_729) as f64 * 0.618_034).fract();
            2.0 * (x - 0.5)
        };
        assert!(without_spikes(&log(noise)).is_none());
        assert!(without_spikes(&log(|i, _| if i < 700 { 0.0 } else { 20.0 })).is_none());
        let push = |i: usize, _| if (700..740).contains(&i) { 60.0 } else { 0.0 };
        assert!(without_spikes(&log(push)).is_none());
        // Every tenth sample: a property of the signal.
        assert!(
            without_spikes(&log(|i, _| if i.is_multiple_of(10) { 50.0 } else { 0.0 })).is_none()
        );
        // A torque that rests and steps by its resolution.
        let steps = |i: usize, _| if i.is_multiple_of(400) { 0.2 } else { 0.0 };
        assert!(without_spikes(&log(steps)).is_none());
        // A joint at rest whose encoder shows another count for a sample.
        let mut resting = log(|_, _| 0.0);
        resting.q_rad.column_mut(1).fill(0.5);
        resting.q_rad[(800, 1)] += 1e-4;
        assert!(without_spikes(&resting).is_none());
    }
}
