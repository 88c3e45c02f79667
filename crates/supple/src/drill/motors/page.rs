//! Results of test cases and their table.

use super::case::{Case, Task};
use super::metrics::Metrics;
use comfy_table::{ContentArrangement, Table, presets};
use serde::Serialize;
use std::fmt::Write;

/// Result of a test case.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Name of the test case.
    pub name: String,
    /// Task.
    pub task: Task,
    /// Expected result.
    pub expected: String,
    /// Actual result.
    pub outcome: String,
    /// Whether the result matches the expectation.
    pub as_expected: bool,
    /// Deviations from the expectation.
    #[serde(rename = "wrong")]
    pub deviations: Vec<String>,
    /// Metrics.
    #[serde(flatten)]
    pub metrics: Metrics,
}

impl Row {
    /// Creates the result of a test case.
    pub fn new(case: &Case, metrics: Metrics, outcome: String, deviations: Vec<String>) -> Row {
        Row {
            name: case.to_string(),
            task: case.task,
            expected: case.expected.to_string(),
            outcome,
            as_expected: deviations.is_empty(),
            deviations,
            metrics,
        }
    }

    /// Creates the result of a test case that could not be run.
    pub fn failed(case: &Case, message: &str) -> Row {
        let deviations = vec![format!("could not be run: {message}")];
        Row::new(case, Metrics::default(), "-".to_owned(), deviations)
    }

    fn cells(&self) -> [String; 6] {
        let metrics = &self.metrics;
        [
            self.name.clone(),
            self.expected.clone(),
            self.outcome.clone(),
            format!(
                "{:.2} ({})",
                metrics.fastest_rad_per_s,
                metrics.fastest_joint + 1
            ),
            format!("{:.0}", metrics.sank_mm),
            match self.as_expected {
                true => "ok".to_owned(),
                false => format!("FAILED: {}", self.deviations.join("; ")),
            },
        ]
    }
}

const COLUMN_TITLES: [&str; 6] = [
    "test case",
    "expected",
    "outcome",
    "fastest joint [rad/s]",
    "tip sank [mm]",
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
# What happens to an arm without brakes

Written by `{command}`. Each row is one test case: a system of processes with an emulated
arm (`emu`) that performs a task, and one event. The expected results were written before the first run
(`crates/supple/src/drill/motors/matrix.rs`). What the motors and the joints did is from the emulated arm, what was named
from the process of the bus; times are those of the arm's clock.

- **expected**: in quotes what the process of the bus must name, with the time from the event. Held: gravity
  compensation and the damping of the motors; then laid down; then disabled, for good: nobody enables a motor again.
- **fastest joint**: largest speed of a joint from the event until all motors are disabled, and its number; a joint whose
  own motor has no torque is left out. No joint may exceed 0.5 rad/s, or 1.1 times what the task had, unless the arm's
  weight rests on the motor that is lost, the torque of all motors has ended, or the event is seen in the motion
  alone; then the figure shows how fast it falls.
- **tip sank**: from the event until laying down begins, at most 30 mm under the same conditions and if every motor has
  torque: what a lost motor of the wrist carries falls with its joint.
- A run in which nothing is lost ends as by Ctrl-C, which lays the arm down too.
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
