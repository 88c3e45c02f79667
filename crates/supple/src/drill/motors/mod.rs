//! The fault table of arms without brakes, whose motors are on a bus: `supple drill --arm openarm --plant emu`.
//!
//! | event | test method |
//! |---|---|
//! | a motor or the bus misbehaves; the controller is killed; the operator requests idle | in virtual time: the processes run in lockstep |
//! | the process of the bus or `supple up` is killed or stopped | in wall-clock time |
//!
//! The result is read from the reports of the processes (`supple-can` reports the loss and the stages, `supple-emu` the motor
//! states, both with times of the arm's clock) and from the arm's trace (speeds of the joints, sinking of the tip).

mod case;
mod course;
mod evaluation;
mod matrix;
mod metrics;
mod page;
mod perform;

use crate::cli::{DrillArgs, PlantKind};
use case::Case;
use page::Row;
use supple_cli::console::{print_json, print_line, print_status};
use supple_cli::exit::Failure;
use supple_cli::interrupt;
use supple_model::{Description, with_dof};

/// Runs the fault table of an arm with `[bus]`.
///
/// # Errors
/// [`Failure::Drill`] if a result differs from the expected one; [`Failure::NoSuchTestCase`].
pub fn run(args: &DrillArgs, description: &Description) -> Result<(), Failure> {
    let cases = chosen(args, description)?;
    if args.list {
        let lines = cases.iter();
        let lines: Vec<String> = lines
            .map(|case| format!("{case}  ({})", case.expected))
            .collect();
        return print_line(&lines.join("\n"));
    }
    let stop = interrupt::shutdown_on_interrupt();
    let mut rows: Vec<Row> = Vec::new();
    for (index, case) in cases.iter().enumerate() {
        if stop.shutdown_requested() {
            break;
        }
        print_status(&format!("{}/{}: {case}", index + 1, cases.len()));
        let row =
            with_dof!(description.dof(), N => perform::perform::<N>(case, args, description))?;
        rows.push(match row {
            Ok(row) => row,
            // A missing program would fail every test case, so stop here.
            Err(failure @ Failure::MissingProgram { .. }) => return Err(failure),
            Err(failure) => Row::failed(case, &failure.to_string()),
        });
    }
    match args.json {
        true => print_json(&rows)?,
        false => print_line(&page::table(&rows))?,
    }
    if let Some(file) = &args.markdown {
        let text = page::page(&rows, &args.command_line());
        supple_files::write_atomic(file, text.as_bytes())
            .map_err(|error| Failure::file("write", file, error))?;
    }
    let failed = rows.iter().filter(|row| !row.as_expected);
    let failed: Vec<&str> = failed.map(|row| row.name.as_str()).collect();
    match failed.is_empty() {
        true => Ok(()),
        false => Err(Failure::Drill {
            rows: failed.join(", "),
        }),
    }
}

fn chosen(args: &DrillArgs, description: &Description) -> Result<Vec<Case>, Failure> {
    match args.plant {
        Some(PlantKind::Can) => return Err(Failure::FaultTestOnRealArm),
        Some(PlantKind::Sim) => {
            return Err(Failure::NoSuchTestCase {
                patterns: format!(
                    "--plant sim of {}, whose fault table is that of its motors: --plant emu",
                    description.name()
                ),
            });
        }
        Some(PlantKind::Emu) | None => {}
    }
    let selected = |case: &Case| {
        let name = case.to_string();
        let named = args.only.is_empty() || args.only.iter().any(|part| name.contains(part));
        named && !(args.virtual_time && case.runs_in_wall_clock_time())
    };
    let cases = matrix::all(description.dof(), description.settings().period_s);
    let cases: Vec<Case> = cases.into_iter().filter(selected).collect();
    match cases.is_empty() {
        true => Err(Failure::NoSuchTestCase {
            patterns: args.only.join(", "),
        }),
        false => Ok(cases),
    }
}
