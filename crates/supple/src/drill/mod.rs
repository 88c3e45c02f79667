//! `supple drill`: whole systems with simulated arms are put through losses, faults, collisions and wrong requests,
//! and what the arm really did is held against what was expected before ([`matrix`]).
//!
//! | what happens | how |
//! |---|---|
//! | a process is killed or stopped; sixteen requests wait | by the wall clock ([`perform`]), above a block |
//! | everything else | in virtual time ([`lockstep`]): each run is the same to the bit, and faster than real time |
//!
//! What is measured comes from the arm's own process, which goes on when a controller does not.
//!
//! An arm that brakes sinks, at the speed at which shorted motors and friction take what gravity gives: the
//! 4-joint arm at 0.09 m/s, so that it meets the block with about 200 N for a millisecond or two and then rests on it.
//! That is the price of braking, alike in both plants (`supple-plant/tests/braking.rs`).

mod fault_name;
mod judge;
mod lockstep;
mod matrix;
mod measure;
mod perform;
mod row;
mod spec;
mod trace;
mod work;

use crate::arms;
use crate::cli::{DrillArgs, PlantKind};
use crate::console::{remark, say, say_json};
use crate::exit::Failure;
use crate::interrupt;
use row::Row;
use spec::Spec;
use supple_model::{Description, with_dof};

/// Runs it.
///
/// # Errors
/// [`Failure::Drill`] where an outcome is not the expected one; [`Failure::NoSuchRow`].
pub fn run(args: &DrillArgs) -> Result<(), Failure> {
    let description = arms::find(&args.arm, args.strict)?;
    let specs = chosen(args)?;
    if args.list {
        let lines: Vec<String> = specs
            .iter()
            .map(|spec| format!("{}  ({})", spec.name(), spec.expected))
            .collect();
        return say(&lines.join("\n"));
    }
    let stop = interrupt::catch();
    let mut rows: Vec<Row> = Vec::new();
    for (index, spec) in specs.iter().enumerate() {
        if stop.asked() {
            break;
        }
        remark(&format!("{}/{}: {}", index + 1, specs.len(), spec.name()));
        rows.push(perform(spec, args, &description)?);
    }
    match args.json {
        true => say_json(&rows)?,
        false => say(&row::table(&rows))?,
    }
    if let Some(file) = &args.markdown {
        supple_files::write_whole(file, row::page(&rows, &command(args)).as_bytes())
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

/// The words that chose the rows.
fn command(args: &DrillArgs) -> String {
    let mut words = vec!["supple drill".to_owned()];
    if let Some(plant) = args.plant {
        words.push(format!("--plant {plant:?}").to_lowercase());
    }
    words.extend(args.only.iter().map(|part| format!("--only {part}")));
    words.extend(args.virtual_time.then(|| "--virtual-time".to_owned()));
    words.push("--markdown docs/drill.md".to_owned());
    words.join(" ")
}

fn chosen(args: &DrillArgs) -> Result<Vec<Spec>, Failure> {
    let plants = match args.plant {
        Some(PlantKind::Can) => return Err(Failure::RealArm),
        Some(plant) => vec![plant],
        None => vec![PlantKind::Sim, PlantKind::Emu],
    };
    let wanted = |spec: &Spec| {
        let name = spec.name();
        let named = args.only.is_empty() || args.only.iter().any(|part| name.contains(part));
        named && !(args.virtual_time && spec.by_the_wall())
    };
    let specs = plants.into_iter().flat_map(matrix::all).filter(wanted);
    let specs: Vec<Spec> = specs.collect();
    match specs.is_empty() {
        true => Err(Failure::NoSuchRow {
            patterns: args.only.join(", "),
        }),
        false => Ok(specs),
    }
}

/// A row that cannot be performed is one that is not as expected: the others go on.
fn perform(spec: &Spec, args: &DrillArgs, description: &Description) -> Result<Row, Failure> {
    let performed = with_dof!(description.dof(), N => match spec.by_the_wall() {
        true => perform::perform::<N>(spec, args, description),
        false => lockstep::perform::<N>(spec, args, description),
    })?;
    match performed {
        Ok(row) => Ok(row),
        // A program that is missing is missing in every row.
        Err(failure @ Failure::NoSibling { .. }) => Err(failure),
        Err(failure) => Ok(Row::failed(spec, &failure.to_string())),
    }
}
