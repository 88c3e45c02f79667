//! A row that was performed, and the table of all.

use super::measure::Measures;
use super::spec::{Event, Expected, Loss, Spec, Work};
use super::trace::After;
use comfy_table::{ContentArrangement, Table, presets};
use serde::Serialize;
use std::fmt::Write;

/// By how much a motor's torque may rise while nobody commands it \[N m\]: the fallback is gravity alone, and
/// the last command may have been less.
const RISE_NM: f64 = 1.0;
/// The same in a stiff move, whose last command may have been less than the weight by what it takes to go down.
const STIFF_RISE_NM: f64 = 10.0;

/// What came of a row.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Its name.
    pub name: String,
    /// What played the arm.
    pub plant: String,
    /// What the arm did.
    pub mode: Work,
    /// Which process was lost, if one was.
    pub process: Option<&'static str>,
    /// How.
    pub loss: Option<Loss>,
    /// What should have come of it.
    pub expected: String,
    /// What did.
    pub outcome: String,
    /// It is what should have.
    pub as_expected: bool,
    /// Everything that is not.
    pub wrong: Vec<String>,
    /// In numbers, of a row in virtual time.
    #[serde(flatten)]
    pub seen: Measures,
    /// In numbers, of a row by the wall clock.
    #[serde(flatten)]
    pub by_the_wall: Option<ByTheWall>,
}

/// A loss of a process in numbers.
#[derive(Clone, Debug, Serialize)]
pub struct ByTheWall {
    /// By how much a motor's torque rose in magnitude before the motors braked \[N m\].
    pub torque_rise_nm: f64,
    /// Greatest force on the block beneath the arm \[N\].
    pub peak_force_n: f64,
    /// How far the tip sank \[m\].
    pub sank_m: f64,
    /// From the process's return to work, the others having gone on \[s\]; none where it was not asked for.
    pub rejoined_after_s: Option<f64>,
}

/// What was seen beside the trace.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    /// A fault latched, in words.
    pub fault: Option<String>,
    /// It was still at work at the end.
    pub worked_on: bool,
    /// It was to come back to work.
    pub to_rejoin: bool,
    /// From the process's return to tracking \[s\].
    pub rejoined_after_s: Option<f64>,
    /// From the request to idle \[ms\], where idle was asked for; the words of a refusal.
    pub idle_after_ms: Option<Result<f64, String>>,
}

impl Row {
    fn new(spec: &Spec, outcome: String, wrong: Vec<String>) -> Row {
        let (process, loss) = match spec.event {
            Event::Process { name, loss } => (Some(name), Some(loss)),
            _ => (None, None),
        };
        Row {
            name: spec.name(),
            plant: format!("{:?}", spec.plant).to_lowercase(),
            mode: spec.work,
            process,
            loss,
            expected: spec.expected.to_string(),
            outcome,
            as_expected: wrong.is_empty(),
            wrong,
            seen: Measures::default(),
            by_the_wall: None,
        }
    }

    /// Of a row in virtual time.
    pub fn lockstep(spec: &Spec, seen: Measures, outcome: String, wrong: Vec<String>) -> Row {
        Row {
            seen,
            ..Row::new(spec, outcome, wrong)
        }
    }

    /// Of a row that could not be performed.
    pub fn failed(spec: &Spec, words: &str) -> Row {
        let wrong = vec![format!("could not be performed: {words}")];
        Row::new(spec, "-".to_owned(), wrong)
    }

    /// Of a loss by the wall clock.
    pub fn wall(spec: &Spec, after: &After, seen: &Seen) -> Row {
        const HEARD_MS: f64 = 20.0;
        let braked_after_ms = after.braked_after_ms();
        let torque_rise_nm = after.torque_rise_nm();
        let outcome = match (&seen.idle_after_ms, braked_after_ms, &seen.fault) {
            (Some(Ok(ms)), ..) => format!("idle after {ms:.1} ms"),
            (Some(Err(words)), ..) => format!("idle refused: {words}"),
            (_, Some(ms), _) if spec.expected != Expected::ControllerFault => {
                format!("braked after {ms:.1} ms")
            }
            (.., Some(fault)) => format!("fault: {fault}"),
            _ if seen.worked_on => "worked on".to_owned(),
            _ => "neither braked nor worked".to_owned(),
        };
        let mut wrong = Vec::new();
        let mut must = |held: bool, words: &str| {
            if !held {
                wrong.push(words.to_owned());
            }
        };
        match spec.expected {
            Expected::Brakes(from_ms, to_ms) => {
                let in_time = |ms| (from_ms..=to_ms).contains(&ms);
                must(
                    braked_after_ms.is_some_and(in_time),
                    "not braked in that time",
                );
                let most_nm = match spec.work {
                    Work::Move | Work::Excite => STIFF_RISE_NM,
                    _ => RISE_NM,
                };
                must(torque_rise_nm < most_nm, "a motor's torque rose");
            }
            Expected::ControllerFault => must(seen.fault.is_some(), "no fault"),
            Expected::Heard => must(
                matches!(seen.idle_after_ms, Some(Ok(ms)) if ms <= HEARD_MS),
                "idle was not heard in that time",
            ),
            _ => must(
                braked_after_ms.is_none() && seen.fault.is_none() && seen.worked_on,
                "it did not work on",
            ),
        }
        must(
            !seen.to_rejoin || seen.rejoined_after_s.is_some(),
            "it did not come back to tracking",
        );
        Row {
            seen: Measures {
                braked_after_ms,
                ..Measures::default()
            },
            by_the_wall: Some(ByTheWall {
                torque_rise_nm,
                peak_force_n: after.peak_force_n(),
                sank_m: after.sank_m(),
                rejoined_after_s: seen.rejoined_after_s,
            }),
            ..Row::new(spec, outcome, wrong)
        }
    }

    fn cells(&self) -> [String; 9] {
        let seen = &self.seen;
        let or_dash = |value: Option<f64>, places: usize| {
            value.map_or_else(|| "-".to_owned(), |value| format!("{value:.places$}"))
        };
        let stops = seen.fault_after_ms.is_some() || seen.braked_after_ms.is_some();
        let lockstep = self.by_the_wall.is_none();
        let force_n = match &self.by_the_wall {
            Some(wall) => Some(wall.peak_force_n),
            None => (seen.impact_n > 0.0).then_some(seen.force_n),
        };
        [
            self.name.clone(),
            self.expected.clone(),
            self.outcome.clone(),
            or_dash((stops && lockstep).then_some(seen.moving_until_ms), 0),
            match (seen.energy_at_fault_j, seen.energy_later_j) {
                (Some(at), Some(later)) => format!("{at:.2} / {later:.2}"),
                _ => "-".to_owned(),
            },
            or_dash(seen.tip_later_m_per_s, 2),
            or_dash(force_n, 0),
            or_dash(seen.pressed_n, 1),
            match self.as_expected {
                true => "ok".to_owned(),
                false => format!("NOT: {}", self.wrong.join("; ")),
            },
        ]
    }
}

const HEADS: [&str; 9] = [
    "row",
    "expected",
    "outcome",
    "moving until ms",
    "J at fault / 0.2 s later",
    "tip m/s 0.5 s later",
    "force N",
    "pressed N",
    "",
];

/// All rows, for a terminal.
pub fn table(rows: &[Row]) -> String {
    let mut table = Table::new();
    table
        .load_style(presets::NOTHING)
        .set_content_arrangement(ContentArrangement::Disabled)
        .set_header(HEADS);
    for row in rows {
        table.add_row(row.cells());
    }
    table.trim_fmt()
}

/// What stands above the table of a page, with a place for the command.
const PAGE: &str = "\
# What stops the arm, and how

Written by `{command}`: each row is a system of processes with a simulated (`sim`) or
emulated (`emu`) arm, at work in a mode, to which something happens. What is expected was written before
(`crates/supple/src/drill/matrix.rs`); the rest is measured on the plant itself, not by the controller.

- **moving until**: when the tip was last faster than 0.25 m/s with motors that do not brake, from what happened on.
- **J at fault / 0.2 s later**: kinetic energy at the fault, or when the motors came to brake, and its greatest value from
  0.2 s after on. An arm that sinks on shorted motors has up to 0.05 J.
- **tip 0.5 s later**: its greatest speed from 0.5 s after the fault on, while motors do not brake.
- **force**: the greatest on the block after the first 20 ms of contact; by the wall clock, the greatest of all.
- **pressed**: the mean force from 0.5 s to 0.7 s after the contact began.
";

/// All rows, as a page that names the command that wrote it.
pub fn page(rows: &[Row], command: &str) -> String {
    let met = rows.iter().filter(|row| row.as_expected).count();
    let above = PAGE.replace("{command}", command);
    let mut page = format!("{above}\n{met} of {} rows are as expected.\n\n", rows.len());
    let _ = writeln!(page, "| {} |", HEADS.join(" | "));
    let _ = writeln!(page, "|{}", "---|".repeat(HEADS.len()));
    for row in rows {
        let cells = row.cells().map(|cell| cell.replace('|', "\\|"));
        let _ = writeln!(page, "| {} |", cells.join(" | "));
    }
    page
}
