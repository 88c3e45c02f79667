//! Results of random cases: by kind of fault, and the worst ones.

use super::course::CaseOutcome;
use super::draw::Case;
use super::verdict::{Violation, excesses};
use crate::cli::DrillArgs;
use comfy_table::{ContentArrangement, Table, presets};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write;
use supple_model::Description;

/// Number of cases in the list of the worst.
const WORST: usize = 25;

/// Result of a case.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Row {
    /// Seed, with which `supple drill --random 1 --seed SEED` repeats the case.
    pub(super) seed: u64,
    task: String,
    realistic: bool,
    handover: Option<&'static str>,
    /// Injected faults, as for `supple up --inject`.
    faults: Vec<String>,
    #[serde(skip)]
    kind: &'static str,
    /// Violated rules.
    pub(super) excesses: Vec<Violation>,
    /// Fault that the controller reported, as text.
    reported: Option<String>,
    /// Time from the injected fault to the reported fault \[ms\].
    reported_after_ms: Option<f64>,
    stopped_after_ms: Option<f64>,
    braked_after_ms: Option<f64>,
    /// Peak of the kinetic energy before the fault \[J\].
    task_j: f64,
    /// Peak of the kinetic energy from the fault until 10 ms after the motors brake \[J\].
    peak_j: f64,
    /// Peak of the speed of the tip from the fault on \[m/s\].
    tip_m_per_s: f64,
}

impl Row {
    pub(super) fn new<const N: usize>(seed: u64, case: &Case<N>, course: &CaseOutcome) -> Row {
        let after_ms = |at_s: Option<f64>| Some(((at_s? - course.fault_s?) * 1e3).round());
        let mut kinds = case.injections.iter().map(|of| of.kind.name());
        let kind = match (kinds.next(), kinds.next()) {
            (Some(kind), None) => kind,
            _ => "two faults",
        };
        let (reported_s, reported) = course.reported.clone().unzip();
        Row {
            seed,
            task: case.task.to_string(),
            realistic: case.realistic,
            handover: case.handover,
            faults: case.injections.iter().map(ToString::to_string).collect(),
            kind,
            excesses: excesses(case, course),
            reported: course.false_fault.clone().or(reported),
            reported_after_ms: after_ms(reported_s),
            stopped_after_ms: after_ms(course.stopped_s),
            braked_after_ms: after_ms(course.braked_s),
            task_j: course.task_j,
            peak_j: course.unstopped_j.max(course.stop_j).max(course.after_j),
            tip_m_per_s: course.tip_m_per_s,
        }
    }

    fn cells(&self) -> [String; 8] {
        let ms = |time_ms: Option<f64>| time_ms.map_or("-".to_owned(), |ms| format!("{ms:.0}"));
        let mut task = self.task.clone();
        if let Some(handover) = self.handover {
            write!(task, ", then {handover}").expect("a string takes any text");
        }
        if self.realistic {
            task.push_str(", realistic");
        }
        let excesses: Vec<String> = self.excesses.iter().map(ToString::to_string).collect();
        [
            self.seed.to_string(),
            task,
            self.faults.join(" "),
            excesses.join(", "),
            self.reported.clone().unwrap_or_else(|| "-".to_owned()),
            ms(self.stopped_after_ms),
            format!("{:.2}, {:.2}", self.task_j, self.peak_j),
            format!("{:.2}", self.tip_m_per_s),
        ]
    }
}

const WORST_TITLES: [&str; 8] = [
    "seed",
    "task",
    "fault",
    "not allowed",
    "reported",
    "stopped [ms]",
    "energy [J]",
    "tip [m/s]",
];

/// Counts of the cases of one kind of fault.
#[derive(Default)]
struct Kind {
    cases: usize,
    excesses: BTreeMap<Violation, usize>,
    peak_j: f64,
    tip_m_per_s: f64,
}

fn kinds(rows: &[Row]) -> BTreeMap<&'static str, Kind> {
    let mut kinds: BTreeMap<&'static str, Kind> = BTreeMap::new();
    for row in rows {
        let kind = kinds.entry(row.kind).or_default();
        kind.cases += 1;
        kind.peak_j = kind.peak_j.max(row.peak_j);
        kind.tip_m_per_s = kind.tip_m_per_s.max(row.tip_m_per_s);
        for excess in &row.excesses {
            *kind.excesses.entry(*excess).or_default() += 1;
        }
    }
    kinds
}

fn kind_titles() -> Vec<String> {
    let mut titles = vec!["fault".to_owned(), "cases".to_owned()];
    titles.extend(Violation::ALL.iter().map(ToString::to_string));
    titles.extend(["worst energy [J]".to_owned(), "worst tip [m/s]".to_owned()]);
    titles
}

fn kind_cells(name: &str, kind: &Kind) -> Vec<String> {
    let mut cells = vec![name.to_owned(), kind.cases.to_string()];
    let count = |excess| kind.excesses.get(excess).copied().unwrap_or(0).to_string();
    cells.extend(Violation::ALL.iter().map(count));
    cells.push(format!("{:.2}", kind.peak_j));
    cells.push(format!("{:.2}", kind.tip_m_per_s));
    cells
}

/// The cases that exceed something, with the greatest energy first.
fn worst(rows: &[Row]) -> Vec<&Row> {
    let mut worst: Vec<&Row> = rows.iter().filter(|row| !row.excesses.is_empty()).collect();
    worst.sort_by(|a, b| b.peak_j.total_cmp(&a.peak_j));
    worst.truncate(WORST);
    worst
}

fn summary(rows: &[Row]) -> String {
    let exceeding = rows.iter().filter(|row| !row.excesses.is_empty()).count();
    format!(
        "{} cases, {exceeding} with something that is not allowed",
        rows.len()
    )
}

/// Formats the results for a terminal.
pub(super) fn terminal(rows: &[Row]) -> String {
    let table = |titles: &[String], cells: Vec<Vec<String>>| {
        let mut table = Table::new();
        table
            .load_style(presets::NOTHING)
            .set_content_arrangement(ContentArrangement::Disabled)
            .set_header(titles);
        table.add_rows(cells);
        table.trim_fmt()
    };
    let by_kind = kinds(rows);
    let by_kind = by_kind.iter().map(|(name, kind)| kind_cells(name, kind));
    let worst = worst(rows);
    let worst = worst.iter().map(|row| row.cells().to_vec());
    format!(
        "{}\n\n{}\n\n{}",
        table(&kind_titles(), by_kind.collect()),
        table(&WORST_TITLES.map(ToOwned::to_owned), worst.collect()),
        summary(rows)
    )
}

/// Text above the tables of the page; `{arm}` and `{command}` are replaced.
const PAGE: &str = "\
# Random faults: {arm}

Written by `{command}`.

Each case is drawn from its seed: a pose within the joints' range, a task (gravity hold, float, move, joint
impedance, track at 5 to 1000 N/m, excite, set-points, breakaway) with random parameters that the controller accepts, in
a quarter of the cases another request in between, and one fault (in a tenth of the cases two) 0.6 to 3.3 s after the drives
became active. In 30 % of the cases the simulated arm has the effects of a real one (`realistic`). Controller, drive guard and
simulated arm run in one process. `supple drill --random 1 --seed SEED` repeats a case.

Nobody chose the cases. The rules are the same for all, but for a dead motor:

- **false fault**: a fault is reported before one is injected.
- **not stopped**, **stopped late**: until the stop (the reported fault, or the drive guard's) the kinetic energy exceeds three times that
  of the task, and 0.5 J; \"not stopped\" within two seconds.
- **gains energy**: after the stop it exceeds 1.5 times what it was at the stop or in the 0.2 s before the fault, and 0.12 J. With a dead
  motor, whose joint falls: the sum of kinetic, potential and elastic energy rises by more than 0.1 J.
- **keeps moving**: with active drives the tip is faster than 0.25 m/s later than 0.5 s after the stop.
- **idle refused**: torque remains in the cycle in which idle is requested.

What is left out: obstacles, hands, processes and buses that fail (the [fault tests](drill.md) have them), and what the
operator does after the stop.

";

/// Formats the page.
pub(super) fn page(rows: &[Row], args: &DrillArgs, description: &Description) -> String {
    let joints = match args.all_joints_active {
        true => ", all joints active",
        false => "",
    };
    let mut text = PAGE
        .replace("{arm}", &format!("{}{joints}", description.name()))
        .replace("{command}", &args.command_line());
    let kinds = kinds(rows);
    let cells = kinds.iter().map(|(name, kind)| kind_cells(name, kind));
    add_table(&mut text, &kind_titles(), cells);
    let worst = worst(rows);
    write!(
        text,
        "\n{}. The {} with the greatest kinetic energy (energy: peak before the fault; peak from then until 10 ms after the motors brake):\n\n",
        summary(rows),
        worst.len()
    )
    .expect("a string takes any text");
    let titles = WORST_TITLES.map(ToOwned::to_owned);
    add_table(&mut text, &titles, worst.iter().map(|row| row.cells()));
    text
}

/// Adds a table in Markdown.
fn add_table<R: AsRef<[String]>>(
    text: &mut String,
    titles: &[String],
    rows: impl Iterator<Item = R>,
) {
    let mut line = |cells: &[String]| {
        writeln!(text, "| {} |", cells.join(" | ")).expect("a string takes any text");
    };
    line(titles);
    line(&vec!["---".to_owned(); titles.len()]);
    for row in rows {
        line(row.as_ref());
    }
}
