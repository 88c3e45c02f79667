//! Compares measured velocities with the slopes of the angles, which checks units, order, signs and the clock without a model.

use super::finding::{Finding, Problem};
use crate::log::Log;

/// Difference from one at which a ratio counts as wrong.
const TOLERANCE: f64 = 0.04;

/// Returns the regression of a velocity on a slope: coefficient and correlation.
fn ratio(log: &Log, velocity: usize, angle: usize) -> Option<(f64, f64)> {
    let qd = log.qd_rad_per_s.as_ref()?;
    let n = log.t_s.len();
    // Slopes are taken over some 50 ms because the angles are quantised.
    let step_s = (log.t_s[n - 1] - log.t_s[0]) / (n - 1) as f64;
    let reach = ((0.03 / step_s).round() as usize).clamp(1, n / 4);
    let (mut vs, mut ss, mut vv) = (0.0, 0.0, 0.0);
    for i in reach..n - reach {
        let span = log.t_s[i + reach] - log.t_s[i - reach];
        let slope = (log.q_rad[(i + reach, angle)] - log.q_rad[(i - reach, angle)]) / span;
        let window = qd.column(velocity);
        let around = window.rows_range(i - reach..i + reach + 1);
        let v = around.mean();
        vs += v * slope;
        ss += slope * slope;
        vv += v * v;
    }
    (ss > 0.0 && vv > 0.0).then(|| (vs / ss, vs / (ss * vv).sqrt()))
}

pub(super) fn check(log: &Log, identified_joints: &[usize]) -> Vec<Finding> {
    if log.qd_rad_per_s.is_none() {
        return Vec::new();
    }
    let own: Vec<(usize, f64, f64)> = identified_joints
        .iter()
        .filter_map(|&j| ratio(log, j, j).map(|(r, c)| (j, r, c)))
        .collect();
    let mut findings = Vec::new();
    let unlike: Vec<usize> = own
        .iter()
        .filter(|(_, _, c)| c.abs() < 0.9)
        .map(|o| o.0)
        .collect();
    for &j in &unlike {
        let partner = unlike.iter().copied().find(|&k| {
            let pair = [(j, k), (k, j)].map(|(v, a)| ratio(log, v, a));
            k != j
                && pair
                    .iter()
                    .all(|r| r.is_some_and(|(r, c)| c > 0.9 && (r - 1.0).abs() < 0.3))
        });
        match partner {
            Some(k) if j < k => findings.push(Finding::reject(
                Problem::Swapped,
                &[j, k],
                "q",
                format!("the slopes of q[{j}] and q[{k}] are those of qd[{k}] and qd[{j}]: two joints are exchanged"),
                "give angles and velocities in the same order of joints",
            )),
            _ => {}
        }
    }
    let alike: Vec<&(usize, f64, f64)> = own.iter().filter(|(_, _, c)| c.abs() >= 0.9).collect();
    if alike.is_empty() {
        return findings;
    }
    let mut ratios: Vec<f64> = alike.iter().map(|o| o.1).collect();
    ratios.sort_by(f64::total_cmp);
    let middle = ratios[ratios.len() / 2];
    let same = alike.iter().all(|o| (o.1 / middle - 1.0).abs() < TOLERANCE);
    if same && (middle - 1.0).abs() > TOLERANCE && middle > 0.0 && alike.len() > 1 {
        findings.push(common(middle));
        return findings;
    }
    for &&(j, r, _) in &alike {
        if (r - 1.0).abs() <= 3.0 * TOLERANCE {
            continue;
        }
        let (problem, evidence, remedy) = if (r + 1.0).abs() < 0.3 {
            (
                Problem::AngleSign,
                format!("is minus the slope of q[{j}]: the sign of one of the two is flipped"),
                format!("give q[{j}] and qd[{j}] with the same sign"),
            )
        } else if (r * 180.0 / std::f64::consts::PI - 1.0).abs() < 0.1 {
            (
                Problem::Degrees,
                format!("is {r:.4} times the slope of q[{j}]: the angle is in degrees"),
                format!("give radians: multiply q[{j}] by pi / 180"),
            )
        } else if (r * std::f64::consts::PI / 180.0 - 1.0).abs() < 0.1 {
            (
                Problem::Degrees,
                format!(
                    "is {r:.2} times the slope of q[{j}]: the velocity is in degrees per second"
                ),
                format!("give rad/s: multiply qd[{j}] by pi / 180"),
            )
        } else {
            (
                Problem::AngleScale,
                format!(
                    "is {r:.3} times the slope of q[{j}]: one of the two has a wrong scale or gear ratio"
                ),
                format!(
                    "give rad/s and rad of the joint: divide qd[{j}], or multiply q[{j}], by {r:.3}"
                ),
            )
        };
        findings.push(Finding::reject(problem, &[j], "qd", evidence, remedy));
    }
    findings
}

/// Returns the finding for the same wrong ratio of all joints.
fn common(ratio: f64) -> Finding {
    let degrees = 180.0 / std::f64::consts::PI;
    if (ratio * degrees - 1.0).abs() < 0.1 {
        return Finding::reject(
            Problem::Degrees,
            &[],
            "q",
            format!(
                "the velocities are {ratio:.4} times the slopes of the angles: the angles are in degrees"
            ),
            "give radians: multiply q by pi / 180",
        );
    }
    if (ratio / degrees - 1.0).abs() < 0.1 {
        return Finding::reject(
            Problem::Degrees,
            &[],
            "qd",
            format!(
                "is {ratio:.2} times the slope of q for all joints: the velocities are in degrees per second"
            ),
            "give rad/s: multiply qd by pi / 180",
        );
    }
    Finding::reject(
        Problem::TimeScale,
        &[],
        "t",
        format!(
            "the velocities are {ratio:.3} times the slopes of the angles, for all joints alike: the clock is {ratio:.3} \
             times too fast"
        ),
        format!("divide t by {ratio:.3}; check the unit and the source of the times"),
    )
}
