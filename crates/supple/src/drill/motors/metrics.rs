//! Metrics of a test case, from the arm's trace.

use super::super::trace::TraceRow;
use serde::Serialize;

/// Metrics after the event.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Metrics {
    /// Time from the event until the plant loop reports a loss \[ms\].
    pub named_after_ms: Option<f64>,
    /// Reason of the loss.
    pub reason: Option<String>,
    /// Name of the controller's fault.
    pub fault: Option<&'static str>,
    /// Time from the event to the controller's fault \[ms\].
    pub fault_after_ms: Option<f64>,
    /// Maximum time from a motor's last command until its watchdog ended its torque \[ms\].
    pub torque_gone_ms: Option<f64>,
    /// Number of motors whose watchdog ended their torque.
    pub watchdogs: usize,
    /// Time from the event until all motors were disabled \[s\].
    pub disabled_after_s: Option<f64>,
    /// Speed of the fastest joint from the event until the motors are disabled, without the joint whose motor has no torque
    /// \[rad/s\].
    pub fastest_rad_per_s: f64,
    /// The fastest joint, counted from 0.
    pub fastest_joint: usize,
    /// Speed of the fastest joint before the event \[rad/s\].
    pub before_rad_per_s: f64,
    /// Distance by which the tip sinks from the event until it is laid down \[mm\].
    pub sank_mm: f64,
    /// Whether a motor has torque at the end of the trace.
    pub enabled_at_end: bool,
}

impl Metrics {
    /// Adds the motion from the rows of a trace; `from_s` is the time of the event, `laid_s` the start of laying down, `until_s`
    /// the end of torque \[s\]. The joint `without` is not evaluated.
    pub fn motion(
        &mut self,
        rows: &[TraceRow],
        without: Option<usize>,
        [from_s, laid_s, until_s]: [f64; 3],
    ) {
        let seconds = |row: &TraceRow| row.time_ns as f64 * 1e-9;
        for row in rows {
            let time_s = seconds(row);
            let judged = row
                .joint_rad_per_s
                .iter()
                .enumerate()
                .filter(|(joint, _)| Some(*joint) != without);
            for (joint, speed) in judged {
                if time_s < from_s {
                    // Motion before the task is ignored.
                    if time_s > from_s - 0.3 {
                        self.before_rad_per_s = self.before_rad_per_s.max(speed.abs());
                    }
                } else if time_s <= until_s && speed.abs() > self.fastest_rad_per_s {
                    self.fastest_rad_per_s = speed.abs();
                    self.fastest_joint = joint;
                }
            }
        }
        let held = rows
            .iter()
            .filter(|row| (from_s..laid_s).contains(&seconds(row)));
        let heights: Vec<f64> = held.map(|row| row.tip_m[2]).collect();
        if let Some(first) = heights.first() {
            let lowest = heights.iter().fold(*first, |lowest, z| lowest.min(*z));
            self.sank_mm = 1e3 * (first - lowest);
        }
        self.enabled_at_end = rows.last().is_some_and(|row| row.active);
    }
}
