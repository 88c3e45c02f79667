//! A line of the table.

use super::case::{Case, Expected, Loss};
use super::trace::After;
use comfy_table::{ContentArrangement, Table, presets};
use serde::Serialize;

/// By how much a motor's torque may rise while nobody commands it \[N m\]: the fallback is gravity alone, and
/// the last command may have been less.
const RISE_NM: f64 = 1.0;

/// What came of a loss.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// What played the arm.
    pub plant: String,
    /// Which process was lost.
    pub process: &'static str,
    /// How.
    pub loss: Loss,
    /// What should have come of it.
    pub expected: String,
    /// What did.
    pub outcome: String,
    /// It is what should have.
    pub as_expected: bool,
    /// From the signal to motors that brake \[ms\]; none where they did not within two seconds.
    pub braked_after_ms: Option<f64>,
    /// By how much a motor's torque rose in magnitude before \[N m\].
    pub torque_rise_nm: f64,
    /// Greatest force on the block beneath the arm in the two seconds after \[N\].
    pub peak_force_n: f64,
    /// The same without the loss \[N\].
    pub peak_force_without_n: Option<f64>,
    /// How far the tip sank in them \[m\].
    pub sank_m: f64,
    /// From the process's return to tracking, the others having gone on \[s\]; none where it did not.
    pub rejoined_after_s: Option<f64>,
}

/// What was seen beside the trace.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    /// A fault latched, in words.
    pub fault: Option<String>,
    /// It still tracked at the end.
    pub tracked_on: bool,
    /// From the process's return to tracking \[s\].
    pub rejoined_after_s: Option<f64>,
}

impl Row {
    /// Judges a case.
    pub fn new(case: &Case, after: &After, seen: &Seen) -> Row {
        let braked_after_ms = after.braked_after_ms();
        let torque_rise_nm = after.torque_rise_nm();
        let outcome = match (braked_after_ms, &seen.fault) {
            (Some(ms), _) if case.expected != Expected::ControllerFault => {
                format!("braked after {ms:.1} ms")
            }
            (_, Some(fault)) => format!("fault: {fault}"),
            _ if seen.tracked_on => "tracked on".to_owned(),
            _ => "neither braked nor tracked".to_owned(),
        };
        let met = match case.expected {
            Expected::Unharmed => {
                braked_after_ms.is_none() && seen.fault.is_none() && seen.tracked_on
            }
            Expected::BrakedWithin(from_ms, to_ms) => {
                braked_after_ms.is_some_and(|ms| (from_ms..=to_ms).contains(&ms))
                    && torque_rise_nm < RISE_NM
            }
            Expected::ControllerFault => seen.fault.is_some(),
        };
        Row {
            plant: format!("{:?}", case.plant).to_lowercase(),
            process: case.process,
            loss: case.loss,
            expected: case.expected.to_string(),
            outcome,
            as_expected: met && seen.rejoined_after_s.is_some(),
            braked_after_ms,
            torque_rise_nm,
            peak_force_n: after.peak_force_n(),
            peak_force_without_n: None,
            sank_m: after.sank_m(),
            rejoined_after_s: seen.rejoined_after_s,
        }
    }

    /// Which loss it is.
    pub fn name(&self) -> String {
        format!("{} {} of {}", self.plant, self.loss, self.process)
    }
}

/// All rows, for a terminal.
pub fn table(rows: &[Row]) -> String {
    let mut table = Table::new();
    table
        .load_style(presets::NOTHING)
        .set_content_arrangement(ContentArrangement::Disabled)
        .set_header([
            "plant",
            "lost",
            "how",
            "expected",
            "outcome",
            "peak N",
            "without",
            "sank mm",
            "rejoined s",
            "",
        ]);
    let newtons = |force_n: f64| format!("{force_n:.1}");
    for row in rows {
        table.add_row([
            row.plant.clone(),
            row.process.to_owned(),
            row.loss.to_string(),
            row.expected.clone(),
            row.outcome.clone(),
            newtons(row.peak_force_n),
            row.peak_force_without_n
                .map_or_else(|| "-".to_owned(), newtons),
            format!("{:.0}", row.sank_m * 1e3),
            row.rejoined_after_s
                .map_or_else(|| "no".to_owned(), |s| format!("{s:.1}")),
            if row.as_expected {
                "ok"
            } else {
                "NOT AS EXPECTED"
            }
            .to_owned(),
        ]);
    }
    table.trim_fmt()
}
