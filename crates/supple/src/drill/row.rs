//! Results of test cases and their table.

use super::metrics::RowMetrics;
use super::spec::{Event, Expected, ProcessFailure, Spec, TestTask};
use super::trace::TraceAfterLoss;
use comfy_table::{ContentArrangement, Table, presets};
use serde::Serialize;
use std::fmt::Write;

/// Maximum rise of a motor torque after the commands stop \[N m\]: the fallback torque is gravity compensation, which
/// may exceed the last command.
const MAX_TORQUE_RISE_NM: f64 = 1.0;
/// Maximum rise of a motor torque in a downward motion along joint references, whose last torque is below the weight.
const MAX_DESCENT_TORQUE_RISE_NM: f64 = 10.0;

/// Result of a test case.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Name of the test case.
    pub name: String,
    /// Plant.
    pub plant: String,
    /// Task of the arm.
    pub mode: TestTask,
    /// Name of the failed process, if the event is a process failure.
    pub process: Option<&'static str>,
    /// How the process failed.
    pub loss: Option<ProcessFailure>,
    /// Expected result.
    pub expected: String,
    /// Actual result.
    pub outcome: String,
    /// Whether the result matches the expectation.
    pub as_expected: bool,
    /// Deviations from the expectation.
    #[serde(rename = "wrong")]
    pub deviations: Vec<String>,
    /// Metrics of a test case in virtual time.
    #[serde(flatten)]
    pub metrics: RowMetrics,
    /// Metrics of a test case in wall-clock time.
    #[serde(flatten)]
    pub wall_clock: Option<WallClockMetrics>,
}

/// Metrics of a process failure.
#[derive(Clone, Debug, Serialize)]
pub struct WallClockMetrics {
    /// Maximum rise of the magnitude of a motor torque before the motors braked \[N m\].
    pub torque_rise_nm: f64,
    /// Maximum force on the block beneath the arm \[N\].
    pub peak_force_n: f64,
    /// Distance by which the tip descended \[m\].
    pub sank_m: f64,
    /// Time from restarting the process until the task runs again, without restarting the others \[s\]; none if not
    /// required.
    pub rejoined_after_s: Option<f64>,
}

/// Observations from telemetry during a test case in wall-clock time.
#[derive(Clone, Debug, Default)]
pub struct ProcessTestResult {
    /// Description of the latched fault.
    pub fault: Option<String>,
    /// Whether the task was still running at the end.
    pub kept_running: bool,
    /// Whether the task must run again after the restart.
    pub recovery_expected: bool,
    /// Time from restarting the process until tracking \[s\].
    pub rejoined_after_s: Option<f64>,
    /// Time from the idle request to its reply \[ms\], if idle was requested; the reason if it was refused.
    pub idle_after_ms: Option<Result<f64, String>>,
}

impl Row {
    fn new(spec: &Spec, outcome: String, deviations: Vec<String>) -> Row {
        let (process, loss) = match spec.event {
            Event::Process { name, loss } => (Some(name), Some(loss)),
            _ => (None, None),
        };
        Row {
            name: spec.name(),
            plant: format!("{:?}", spec.plant).to_lowercase(),
            mode: spec.task,
            process,
            loss,
            expected: spec.expected.to_string(),
            outcome,
            as_expected: deviations.is_empty(),
            deviations,
            metrics: RowMetrics::default(),
            wall_clock: None,
        }
    }

    /// Creates the result of a test case in virtual time.
    pub fn lockstep(
        spec: &Spec,
        metrics: RowMetrics,
        outcome: String,
        deviations: Vec<String>,
    ) -> Row {
        Row {
            metrics,
            ..Row::new(spec, outcome, deviations)
        }
    }

    /// Creates the result of a test case that could not be run.
    pub fn failed(spec: &Spec, message: &str) -> Row {
        let deviations = vec![format!("could not be run: {message}")];
        Row::new(spec, "-".to_owned(), deviations)
    }

    /// Creates the result of a test case in wall-clock time.
    pub fn wall_clock(spec: &Spec, after: &TraceAfterLoss, result: &ProcessTestResult) -> Row {
        const IDLE_RESPONSE_MS: f64 = 20.0;
        let braked_after_ms = after.braked_after_ms();
        let torque_rise_nm = after.torque_rise_nm();
        let outcome = match (&result.idle_after_ms, braked_after_ms, &result.fault) {
            (Some(Ok(ms)), ..) => format!("idle after {ms:.1} ms"),
            (Some(Err(message)), ..) => format!("no idle: {message}"),
            (_, Some(ms), _) if spec.expected != Expected::ControllerFault => {
                format!("braked after {ms:.1} ms")
            }
            (.., Some(fault)) => format!("fault: {fault}"),
            _ if result.kept_running => "kept running".to_owned(),
            _ => "neither braked nor kept running".to_owned(),
        };
        let mut deviations = Vec::new();
        let mut expect = |met: bool, message: &str| {
            if !met {
                deviations.push(message.to_owned());
            }
        };
        match spec.expected {
            Expected::Brakes(from_ms, to_ms) => {
                let in_time = |ms| (from_ms..=to_ms).contains(&ms);
                expect(
                    braked_after_ms.is_some_and(in_time),
                    "the motors did not brake in this interval",
                );
                let max_nm = match spec.task {
                    TestTask::Move
                    | TestTask::Excite
                    | TestTask::JointImpedance
                    | TestTask::TrackPose => MAX_DESCENT_TORQUE_RISE_NM,
                    _ => MAX_TORQUE_RISE_NM,
                };
                expect(torque_rise_nm < max_nm, "a motor torque rose");
            }
            Expected::ControllerFault => expect(result.fault.is_some(), "no fault"),
            Expected::IdleAccepted => expect(
                matches!(result.idle_after_ms, Some(Ok(ms)) if ms <= IDLE_RESPONSE_MS),
                "idle was not accepted in time",
            ),
            _ => expect(
                braked_after_ms.is_none() && result.fault.is_none() && result.kept_running,
                "it did not keep running",
            ),
        }
        expect(
            !result.recovery_expected || result.rejoined_after_s.is_some(),
            "it did not return to tracking",
        );
        Row {
            metrics: RowMetrics {
                braked_after_ms,
                ..RowMetrics::default()
            },
            wall_clock: Some(WallClockMetrics {
                torque_rise_nm,
                peak_force_n: after.peak_force_n(),
                sank_m: after.sank_m(),
                rejoined_after_s: result.rejoined_after_s,
            }),
            ..Row::new(spec, outcome, deviations)
        }
    }

    fn cells(&self) -> [String; 9] {
        let metrics = &self.metrics;
        let or_dash = |value: Option<f64>, places: usize| {
            value.map_or_else(|| "-".to_owned(), |value| format!("{value:.places$}"))
        };
        let stops = metrics.fault_after_ms.is_some() || metrics.braked_after_ms.is_some();
        let lockstep = self.wall_clock.is_none();
        let force_n = match &self.wall_clock {
            Some(wall) => Some(wall.peak_force_n),
            None => (metrics.impact_n > 0.0).then_some(metrics.force_n),
        };
        [
            self.name.clone(),
            self.expected.clone(),
            self.outcome.clone(),
            or_dash((stops && lockstep).then_some(metrics.moving_until_ms), 0),
            match (
                metrics.energy_at_fault_j,
                metrics.energy_peak,
                metrics.energy_later_j,
            ) {
                (Some(at), Some((peak, _)), Some(later)) => {
                    format!("{at:.2} / {peak:.2} / {later:.2}")
                }
                _ => "-".to_owned(),
            },
            or_dash(metrics.tip_later_m_per_s, 2),
            or_dash(force_n, 0),
            or_dash(metrics.pressed_n, 1),
            match self.as_expected {
                true => "ok".to_owned(),
                false => format!("FAILED: {}", self.deviations.join("; ")),
            },
        ]
    }
}

const COLUMN_TITLES: [&str; 9] = [
    "test case",
    "expected",
    "outcome",
    "moving until [ms]",
    "energy at fault / peak / 0.2 s later [J]",
    "tip 0.5 s later [m/s]",
    "force [N]",
    "pressing force [N]",
    "",
];

/// Formats the results for a terminal.
pub fn table(rows: &[Row]) -> String {
    let mut table = Table::new();
    table
        .load_style(presets::NOTHING)
        .set_content_arrangement(ContentArrangement::Disabled)
        .set_header(COLUMN_TITLES);
    for row in rows {
        table.add_row(row.cells());
    }
    table.trim_fmt()
}

/// Text above the table of the page; `{command}` is replaced by the command line.
const PAGE: &str = "\
# What stops the arm, and how

Written by `{command}`. Each row is one test case: a system of processes with a simulated (`sim`)
or emulated (`emu`) arm that performs a task, and one event. The expected results were written before the first run
(`crates/supple/src/drill/matrix.rs`); the metrics are measured on the plant, not by the controller.

- **moving until**: last time after the event at which the tip was faster than 0.25 m/s while the motors did not brake.
- **energy at fault / peak / 0.2 s later**: kinetic energy at the fault, or when braking began; its maximum from then until
  10 ms after braking began, at most half as much again as at the fault or in the 0.2 s before the event, or 0.12 J (0.25 m/s); and its
  maximum from 0.2 s later, at most that at the fault. An arm that descends on shorted motors has up to 0.05 J, the 7-joint
  arm 0.08 J.
- **tip 0.5 s later**: maximum tip speed from 0.5 s after the fault, while the motors do not brake.
- **after it was observable**: from the moment at which an angle is wrong by more than the checks resolve (`stuck_rad`), or a
  joint has turned by that much otherwise than in the same run without the fault; for lost or jumping angles, from the event.
  At most 100 ms are allowed of every fault that must stop the arm, and of every fault of an encoder. Not stated where the fault
  was named before it was observable in this sense.
- After a dead motor, whose joint nothing brakes, kinetic and potential energy together may not grow, and the tip may be
  as fast as that of a rod that falls by the same descent.
- **force**: maximum force on the block after the first 20 ms of contact; in wall-clock time, the overall maximum.
- **pressing force**: mean force from 0.5 s to 0.7 s after the contact began: at most 5 N, and where the task follows a
  path into the block, what its law gives: stiffness times the length of the path (1 N at 5 N/m and 0.2 m; the springs of
  the joints as they act at the tip). A breakaway ramp that an obstacle ends looks like one with an encoder that sticks: the
  arm brakes, and its weight may rest on the block.
";

/// Formats the results as a Markdown page that contains its command line.
pub fn page(rows: &[Row], command: &str) -> String {
    let passed = rows.iter().filter(|row| row.as_expected).count();
    let introduction = PAGE.replace("{command}", command);
    let mut page = format!(
        "{introduction}\n{passed} of {} test cases gave the expected result.\n\n",
        rows.len()
    );
    let _ = writeln!(page, "| {} |", COLUMN_TITLES.join(" | "));
    let _ = writeln!(page, "|{}", "---|".repeat(COLUMN_TITLES.len()));
    for row in rows {
        let cells = row.cells().map(|cell| cell.replace('|', "\\|"));
        let _ = writeln!(page, "| {} |", cells.join(" | "));
    }
    page
}
