//! Compares the actual with the expected result.

use super::case::{Case, Event, Expected};
use super::course::{ReportedCourse, Stage};
use super::metrics::Metrics;

/// Speed that no joint with a motor may exceed while the arm is held and laid down, if it was slower before
/// \[rad/s\].
const SLOW_RAD_PER_S: f64 = 0.5;
/// Speed that a joint falling against damping does not reach: three times the limit of the joints of OpenArm and YAM \[rad/s\].
const FALL_RAD_PER_S: f64 = 6.0;
/// Ratio by which a joint that was faster may exceed its speed before the event.
const FASTER: f64 = 1.1;
/// Distance by which the tip may sink while the arm is held \[mm\].
const SANK_MM: f64 = 30.0;
/// Stages of an arm that cannot be held: with a joint above its speed limit, the motors damp and are disabled at standstill.
const DAMPED: [Stage; 3] = [Stage::Holding, Stage::Disabling, Stage::Disabled];
/// Stages of an arm that is laid down.
const LAID_DOWN: [Stage; 4] = [
    Stage::Holding,
    Stage::LayingDown,
    Stage::Disabling,
    Stage::Disabled,
];

/// Returns the outcome as text and a list of all deviations from the expectation; the event was at `event_s`.
pub fn evaluate(
    case: &Case,
    joints: usize,
    course: &ReportedCourse,
    metrics: &Metrics,
    event_s: f64,
) -> (String, Vec<String>) {
    let mut deviations = Vec::new();
    let mut expect = |met: bool, message: String| {
        if !met {
            deviations.push(message);
        }
    };
    for error in &course.errors {
        expect(false, error.clone());
    }
    let before = course.stages.iter().find(|(time_s, ..)| *time_s < event_s);
    if let Some((time_s, _, reason)) = before {
        expect(
            false,
            format!("before the event, at {time_s:.3} s: {reason}"),
        );
    }
    let stages = course.stages(event_s);
    let reason = metrics.reason.clone().unwrap_or_default();
    let laid_down = stages == LAID_DOWN;
    match &case.expected {
        Expected::KeepsRunning => {
            expect(
                reason == "the program is shutting down" && metrics.fault.is_none(),
                format!("it does not keep running: {reason}"),
            );
            expect(laid_down, format!("stages {stages:?}"));
        }
        Expected::LaidDown {
            reason: expected,
            within_ms,
        } => {
            expect(
                reason.contains(expected.as_str()),
                format!("the reason is \"{reason}\""),
            );
            expect(
                metrics.named_after_ms <= Some(*within_ms),
                format!(
                    "named after {:.1} ms",
                    metrics.named_after_ms.unwrap_or(f64::NAN)
                ),
            );
            expect(laid_down, format!("stages {stages:?}"));
        }
        Expected::Fault {
            reason: expected,
            names,
            within_ms,
        } => {
            let named = expected.as_ref().is_some_and(|expected| {
                reason.contains(expected.as_str()) && metrics.named_after_ms <= Some(*within_ms)
            });
            let fault = metrics.fault.is_some_and(|fault| names.contains(&fault))
                && metrics.fault_after_ms <= Some(*within_ms);
            expect(
                named || fault,
                format!("neither a fault in time nor a reason: \"{reason}\""),
            );
            expect(
                laid_down || case.is_without_carrier() && stages == DAMPED,
                format!("stages {stages:?}"),
            );
            expect(
                metrics.fastest_rad_per_s <= FALL_RAD_PER_S,
                format!(
                    "joint {} at {:.2} rad/s",
                    metrics.fastest_joint + 1,
                    metrics.fastest_rad_per_s
                ),
            );
        }
        Expected::TorqueEnds {
            reason: expected,
            within_ms,
        } => {
            if let Some(expected) = expected {
                expect(
                    reason.contains(expected),
                    format!("the reason is \"{reason}\""),
                );
            }
            expect(
                metrics.watchdogs == joints,
                format!(
                    "the watchdogs of {} motors ended their torque",
                    metrics.watchdogs
                ),
            );
            expect(
                metrics.torque_gone_ms <= Some(*within_ms),
                format!(
                    "torque {:.1} ms after the last command",
                    metrics.torque_gone_ms.unwrap_or(f64::NAN)
                ),
            );
        }
    }
    expect(
        !metrics.enabled_at_end,
        "a motor is enabled at the end".to_owned(),
    );
    let held = !matches!(case.expected, Expected::TorqueEnds { .. })
        && !case.is_without_carrier()
        && case.event != Event::KillUp;
    if held {
        let bound = SLOW_RAD_PER_S.max(FASTER * metrics.before_rad_per_s);
        expect(
            metrics.fastest_rad_per_s <= bound,
            format!(
                "joint {} at {:.2} rad/s, {bound:.2} allowed",
                metrics.fastest_joint + 1,
                metrics.fastest_rad_per_s
            ),
        );
        // The part of the arm that a motor without torque carries falls.
        if matches!(case.expected, Expected::LaidDown { .. }) && case.without().is_none() {
            expect(
                metrics.sank_mm <= SANK_MM,
                format!("the tip sank by {:.0} mm while held", metrics.sank_mm),
            );
        }
    }
    (outcome(metrics, laid_down), deviations)
}

impl Case {
    /// Whether a motor that carries the arm has no torque, so that its joint is not held.
    fn is_without_carrier(&self) -> bool {
        self.without() == Some(1) || matches!(self.expected, Expected::Fault { .. })
    }
}

fn outcome(metrics: &Metrics, laid_down: bool) -> String {
    let mut parts = Vec::new();
    if let (Some(fault), Some(ms)) = (metrics.fault, metrics.fault_after_ms) {
        parts.push(format!("fault {fault} after {ms:.1} ms"));
    }
    if let (Some(reason), Some(ms)) = (&metrics.reason, metrics.named_after_ms) {
        parts.push(format!("\"{reason}\" after {ms:.1} ms"));
    }
    if let Some(ms) = metrics.torque_gone_ms {
        parts.push(format!(
            "{} motors without torque {ms:.1} ms after the last command",
            metrics.watchdogs
        ));
    }
    if let (true, Some(after_s)) = (laid_down, metrics.disabled_after_s) {
        parts.push(format!("laid down and disabled after {after_s:.1} s"));
    }
    match parts.is_empty() {
        true => "nothing".to_owned(),
        false => parts.join("; "),
    }
}
