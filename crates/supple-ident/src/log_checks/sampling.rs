//! Checks of single columns without a model: unit of time, lost samples, frozen or held values, saturation.

use super::equal_values::{Run, median, quantum, runs};
use super::finding::{Consequence, Finding, Problem};
use crate::log::Log;

/// Plausible sampling rates; a rate outside means that the time is not in seconds \[Hz\].
const RATES_HZ: std::ops::RangeInclusive<f64> = 8.0..=30_000.0;
/// Minimum time without a change after which a column counts as frozen \[s\].
const MIN_FROZEN_S: f64 = 0.1;
/// Minimum number of changes of a column per period of the cutoff frequency: with fewer, its steps are within the frequencies
/// that are fitted, and it counts as held.
const REFRESHES_PER_PERIOD: f64 = 6.0;
/// Minimum ratio of a step to its neighbours, equal for all joints, that indicates lost samples.
const MIN_LOST_RATIO: f64 = 1.6;
/// Minimum ratio of a joint's speed to its change from step to step for the check of lost samples.
const SPEED_TO_NOISE: f64 = 5.0;
/// For independent errors of the angles: ratio of the deviation of a speed change to the deviation of its second difference.
const BEND_TO_CHANGE: f64 = 0.548;

pub(super) fn check(log: &Log, identified_joints: &[usize], cutoff_hz: f64) -> Vec<Finding> {
    let steps: Vec<f64> = log.t_s.windows(2).map(|w| w[1] - w[0]).collect();
    let step_s = median(steps);
    if let Some(finding) = time_unit(step_s) {
        return vec![finding];
    }
    let mut findings = Vec::new();
    let mut frozen = false;
    for &joint in identified_joints {
        let angles: Vec<f64> = log.q_rad.column(joint).iter().copied().collect();
        let torques: Vec<f64> = log.tau_nm.column(joint).iter().copied().collect();
        let held = held(&angles, "q", joint, step_s, cutoff_hz);
        if let Some(finding) = &held {
            findings.push(finding.clone());
        } else if let Some(finding) = frozen_angle(log, &angles, joint, step_s) {
            frozen = true;
            findings.push(finding);
        }
        if let Some(finding) = held_or_frozen_torque(log, &torques, joint, step_s, cutoff_hz) {
            findings.push(finding);
        }
        findings.extend(saturated(log, &torques, joint));
    }
    if !frozen && !findings.iter().any(|f| f.problem == Problem::Held) {
        findings.extend(lost_samples(log, identified_joints, step_s));
    }
    findings
}

fn time_unit(step_s: f64) -> Option<Finding> {
    let rate_hz = 1.0 / step_s;
    if RATES_HZ.contains(&rate_hz) {
        return None;
    }
    let units = [
        ("milliseconds", 1e3),
        ("microseconds", 1e6),
        ("nanoseconds", 1e9),
    ];
    let fits = |(_, per_s): &&(&str, f64)| RATES_HZ.contains(&(rate_hz * per_s));
    let (unit, per_s) = *units.iter().find(fits)?;
    Some(Finding::reject(
        Problem::TimeUnit,
        &[],
        "t",
        format!(
            "steps of {step_s} look like {unit}: {:.0} samples per second",
            rate_hz * per_s
        ),
        format!("give seconds: divide t by {per_s:e}"),
    ))
}

/// Returns the slope before sample `i` over about 50 ms, three samples or more \[rad/s\].
fn slope_before(log: &Log, angles: &[f64], i: usize, step_s: f64) -> Option<f64> {
    let back = ((0.05 / step_s).round() as usize).max(3);
    let from = i.checked_sub(back)?;
    Some((angles[i] - angles[from]) / (log.t_s[i] - log.t_s[from]))
}

/// Finds an angle that stops changing within one sample while the joint moves, and later jumps to the true angle.
fn frozen_angle(log: &Log, angles: &[f64], joint: usize, step_s: f64) -> Option<Finding> {
    let quantum = quantum(angles);
    let column = log.q_rad.column(joint);
    let range = column.max() - column.min();
    let is_frozen = |run: &Run| {
        let span_s = log.t_s[run.end - 1] - log.t_s[run.first];
        let speed = slope_before(log, angles, run.first, step_s)?;
        let missed = speed.abs() * span_s;
        let last = (angles[run.first] - angles[run.first.checked_sub(1)?]).abs();
        let own_step = speed.abs() * (log.t_s[run.first] - log.t_s[run.first - 1]);
        let sudden = own_step > 3.0 * quantum && last > 0.5 * own_step;
        let coarse = own_step <= 3.0 * quantum && missed > 30.0 * quantum;
        let jump = angles
            .get(run.end)
            .map(|next| (next - angles[run.first]).abs());
        // The angle of a joint that really stopped does not jump afterwards.
        let leaps = jump.is_none_or(|jump| jump > 0.3 * missed);
        let long =
            span_s >= MIN_FROZEN_S && run.len() >= 5 && missed > (10.0 * quantum).max(0.01 * range);
        (long && leaps && (sudden || (coarse && jump.is_some()))).then_some((span_s, speed))
    };
    let all = runs(angles);
    let (run, (span_s, speed)) = all.iter().find_map(|run| Some((run, is_frozen(run)?)))?;
    Some(Finding::reject(
        Problem::FrozenAngle,
        &[joint],
        "q",
        format!(
            "stands at {:.4} rad for {span_s:.2} s from {:.2} s on, from a speed of {speed:.2} rad/s within a sample: the \
             encoder is frozen",
            angles[run.first], log.t_s[run.first],
        ),
        "leave this interval out, or record again with the encoder repaired",
    ))
}

/// Returns the mean length of a run, weighted with its length.
fn mean_run_length(all: &[Run]) -> f64 {
    let (mut squares, mut total) = (0.0, 0.0);
    for run in all {
        squares += (run.len() as f64).powi(2);
        total += run.len() as f64;
    }
    squares / total
}

/// Finds a column that changes by large steps, rarely and at a constant rate.
fn held(values: &[f64], name: &str, joint: usize, step_s: f64, cutoff_hz: f64) -> Option<Finding> {
    let all = runs(values);
    // Ignore longer runs: the arm is at rest.
    let short: Vec<Run> = all
        .iter()
        .filter(|run| (run.len() as f64) * step_s < 0.5)
        .copied()
        .collect();
    if short.len() < 10 {
        return None;
    }
    let lengths: Vec<f64> = short.iter().map(|run| run.len() as f64).collect();
    let length = median(lengths.clone());
    let regular = lengths
        .iter()
        .filter(|l| (**l - length).abs() <= 1.0)
        .count();
    let rate_hz = 1.0 / (length * step_s);
    let changes = values
        .windows(2)
        .map(|w| (w[1] - w[0]).abs())
        .filter(|c| *c > 0.0);
    let change = median(changes.collect());
    let coarse = change < 4.0 * quantum(values);
    let rare = length >= 3.0 && rate_hz < REFRESHES_PER_PERIOD * cutoff_hz;
    if coarse || !rare || regular * 2 < lengths.len() {
        return None;
    }
    Some(Finding::reject(
        Problem::Held,
        &[joint],
        name,
        format!(
            "changes only {rate_hz:.0} times per second, in a log of {:.0} samples per second: it is held at a low rate",
            1.0 / step_s
        ),
        format!(
            "record it at {:.0} Hz or more, or give a lower cutoff and the log at its own rate",
            REFRESHES_PER_PERIOD * cutoff_hz
        ),
    ))
}

fn held_or_frozen_torque(
    log: &Log,
    torques: &[f64],
    joint: usize,
    step_s: f64,
    cutoff_hz: f64,
) -> Option<Finding> {
    if let Some(finding) = held(torques, "tau", joint, step_s, cutoff_hz) {
        return Some(finding);
    }
    let all = runs(torques);
    let range = torques.iter().copied().fold(f64::NEG_INFINITY, f64::max)
        - torques.iter().copied().fold(f64::INFINITY, f64::min);
    let quantum = quantum(torques);
    // Commands of a controller at rest are constant; the joint must move meanwhile.
    let moves = |run: &Run| {
        let travel = log
            .q_rad
            .column(joint)
            .rows_range(run.first..run.end)
            .into_owned();
        travel.max() - travel.min()
    };
    let whole = log.q_rad.column(joint).max() - log.q_rad.column(joint).min();
    let usual = mean_run_length(&all[..all.len().min(all.len() - 1).max(1)]);
    let longest = all.iter().max_by_key(|run| run.len())?;
    let span_s = log.t_s[longest.end - 1] - log.t_s[longest.first];
    let (low, high) = (
        torques.iter().copied().fold(f64::INFINITY, f64::min),
        torques.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    );
    let value = torques[longest.first];
    let at_limit = value == low || value == high;
    let fine = quantum < 0.02 * range;
    let others = mean_run_length_without(&all, longest);
    if at_limit || !fine || span_s < 3.0 * MIN_FROZEN_S || moves(longest) < 0.02 * whole {
        return None;
    }
    if (longest.len() as f64) < 30.0 * others.max(1.0) || usual < others {
        return None;
    }
    Some(Finding::reject(
        Problem::FrozenTorque,
        &[joint],
        "tau",
        format!(
            "stands at {value:.3} for {span_s:.2} s from {:.2} s on while the joint moves: the torque is frozen",
            log.t_s[longest.first]
        ),
        "leave this interval out, or record again",
    ))
}

fn mean_run_length_without(all: &[Run], left_out: &Run) -> f64 {
    let rest: Vec<Run> = all.iter().filter(|run| *run != left_out).copied().collect();
    if rest.is_empty() {
        1.0
    } else {
        mean_run_length(&rest)
    }
}

/// Finds a torque that stays at its maximum in either direction.
fn saturated(log: &Log, torques: &[f64], joint: usize) -> Option<Finding> {
    let high = torques.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let low = torques.iter().copied().fold(f64::INFINITY, f64::min);
    let range = high - low;
    if range <= 0.0 {
        return None;
    }
    let quantum = quantum(torques);
    let mut intervals = Vec::new();
    let mut count = 0;
    let mut limit_nm = 0.0_f64;
    for (end, inward) in [(high, -1.0), (low, 1.0)] {
        let at = |x: f64| (x - end).abs() <= 1e-9 * range;
        let here = torques.iter().filter(|x| at(**x)).count();
        // If as many samples are within the next quantum, or the next hundredth of the range, as at the extreme value, the value
        // is not a limit.
        let next = quantum.max(0.01 * range) * 1.5;
        let near = torques
            .iter()
            .filter(|x| !at(**x) && (**x - end) * inward <= next)
            .count();
        let long: Vec<Run> = runs(torques)
            .into_iter()
            .filter(|run| run.len() >= 4 && at(torques[run.first]))
            .collect();
        let samples: usize = long.iter().map(Run::len).sum();
        if long.is_empty() || here < 10 || here < 2 * near || samples * 2 < here {
            continue;
        }
        count += here;
        limit_nm = limit_nm.max(end.abs());
        for run in long {
            intervals.push((log.t_s[run.first], log.t_s[run.end - 1]));
        }
    }
    if count == 0 {
        return None;
    }
    let mut finding = Finding::reject(
        Problem::Saturated,
        &[joint],
        "tau",
        format!(
            "rests on its limit of {limit_nm:.2} N m in {:.1} % of the samples: the motor or its log is saturated",
            100.0 * count as f64 / torques.len() as f64
        ),
        "these samples are left out; move more slowly, or log the torque over its whole range",
    )
    .with(Consequence::Mask);
    finding.intervals_s = intervals;
    Some(finding)
}

/// Finds steps in which all joints travel several times as far as in the neighbouring steps: samples are missing there.
fn lost_samples(log: &Log, identified_joints: &[usize], step_s: f64) -> Option<Finding> {
    let n = log.t_s.len();
    let reach = 4;
    if n < 4 * reach {
        return None;
    }
    let quanta: Vec<f64> = identified_joints
        .iter()
        .map(|&j| quantum(log.q_rad.column(j).clone_owned().as_slice()))
        .collect();
    let step = |i: usize, j: usize| log.q_rad[(i + 1, j)] - log.q_rad[(i, j)];
    let span = |i: usize| log.t_s[i + 1] - log.t_s[i];
    let (mut places, mut lost_s, mut first_s) = (0, 0.0, None);
    let (mut jumps, mut jump_s) = (0, 0.0);
    // The step at nearly the largest speed of each joint.
    let fastest: Vec<f64> = identified_joints
        .iter()
        .map(|&j| {
            let mut steps: Vec<f64> = (0..n - 1).map(|i| step(i, j).abs()).collect();
            steps.sort_by(f64::total_cmp);
            steps[(n - 2) * 99 / 100]
        })
        .collect();
    for i in reach..n - 1 - reach {
        let mut ratios = Vec::new();
        let mut leaps = 0;
        for (row, &j) in identified_joints.iter().enumerate() {
            let speed = |k: usize| step(k, j) / span(k);
            let around = (i - reach..i).chain(i + 1..=i + reach);
            let speeds: Vec<f64> = around.map(speed).collect();
            // Second differences, since a motion accelerates.
            let neighbours = (i - reach + 1..i - 1).chain(i + 2..i + reach);
            let bend = |k: usize| (speed(k + 1) - 2.0 * speed(k) + speed(k - 1)).abs();
            let noise = BEND_TO_CHANGE * median(neighbours.map(bend).collect());
            let spread = median(speeds.iter().map(|v| v.abs()).collect());
            let largest = speeds.iter().map(|v| v.abs()).fold(0.0, f64::max);
            let usual = mean_of_middle(speeds) * span(i);
            // A smaller speed cannot be distinguished from the noise of the encoder.
            let fine = (5.0 * quanta[row]).max(SPEED_TO_NOISE * noise * span(i));
            if step(i, j).abs() > (8.0 * largest * span(i)).max(3.0 * fastest[row]) {
                leaps += 1;
            }
            // A joint that reverses has no speed to compare with.
            if usual.abs() > 0.7 * spread * span(i) && usual.abs() > fine {
                ratios.push(step(i, j) / usual);
            }
        }
        if leaps >= 2 || (leaps == 1 && identified_joints.len() == 1) {
            jumps += 1;
            jump_s = log.t_s[i];
        }
        if ratios.len() < identified_joints.len().min(2) || ratios.is_empty() {
            continue;
        }
        let ratio = median(ratios.clone());
        let alike = ratios.iter().all(|r| (r / ratio - 1.0).abs() < 0.25);
        if ratio > MIN_LOST_RATIO && alike {
            places += 1;
            lost_s += (ratio - 1.0) * span(i);
            first_s = first_s.or(Some(log.t_s[i]));
        }
    }
    let remedy = "log the time of each sample, not its number times the period; split the log where samples are missing";
    if jumps > 0 && places < 3 {
        return Some(Finding::reject(
            Problem::LostSamples,
            &[],
            "t",
            format!(
                "{jumps} jumps of several joints at once, the last at {jump_s:.3} s: samples were lost and the times do not \
                 show it"
            ),
            remedy,
        ));
    }
    let enough = places >= 3 || lost_s > 20.0 * step_s;
    if !enough || lost_s < 5e-4 * (log.t_s[n - 1] - log.t_s[0]) {
        return None;
    }
    Some(Finding::reject(
        Problem::LostSamples,
        &[],
        "t",
        format!(
            "all joints jump at {places} samples, first at {:.3} s, as if {lost_s:.3} s were missing: samples were lost \
             and the times do not show it",
            first_s.unwrap_or(0.0)
        ),
        remedy,
    ))
}

fn mean_of_middle(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let cut = values.len() / 4;
    let middle = &values[cut..values.len() - cut];
    middle.iter().sum::<f64>() / middle.len() as f64
}
