//! `supple drill`: injects process failures, faults, collisions and invalid requests into complete systems with
//! simulated arms, and compares the motion of the arm with the expected results in [`matrix`].
//!
//! | event | test method |
//! |---|---|
//! | a process is killed or stopped; request queue, disk or standard error is full | in wall-clock time ([`perform`]), above a block |
//! | everything else | in virtual time ([`lockstep`]): runs are bit-identical and faster than real time |
//! | random cases instead of chosen ones | in this process ([`random`]) |
//!
//! Measurements come from the plant process, which keeps running when the controller fails.
//!
//! A braking arm descends at the speed at which shorted motors and friction dissipate the power of gravity: the
//! 4-joint arm descends at 0.09 m/s, so that it hits the block with about 200 N for one or two milliseconds and then
//! rests on it. This impact is inherent in braking and is the same in both plants
//! (`supple-plant/tests/plant/braking.rs`).

mod evaluation;
mod lockstep;
mod matrix;
mod metrics;
mod motors;
mod observable;
mod perform;
mod random;
mod request_obstruction;
mod row;
mod spec;
mod task;
mod test_arms;
mod trace;
mod up_process;

use lockstep::BaselineRuns;
use test_arms::{TestArm, TestArms};

use crate::cli::{DrillArgs, PlantKind};
use row::Row;
use spec::Spec;
use supple_cli::arms::{self, DEFAULT_ARM};
use supple_cli::console::{print_json, print_line, print_status};
use supple_cli::exit::Failure;
use supple_cli::interrupt;
use supple_model::with_dof;

/// Runs `supple drill`.
///
/// # Errors
/// [`Failure::Drill`] if a result differs from the expected one; [`Failure::NoSuchTestCase`].
pub fn run(args: &DrillArgs) -> Result<(), Failure> {
    // Check the output before any test case is run.
    if let Some(file) = &args.markdown {
        supple_files::check_output(file).map_err(|error| Failure::file("write", file, error))?;
    }
    let description = arms::find(&args.urdf.name(&args.arm), args.strict)?;
    if let Some(count) = args.random {
        let description = match args.all_joints_active {
            true => description.with_all_joints_active()?,
            false => description,
        };
        return random::run(args, &description, count);
    }
    if description.bus().is_some() {
        return motors::run(args, &description);
    }
    let mut arms = TestArms::new(args)?;
    let specs = chosen(args)?;
    if args.list {
        let lines: Vec<String> = specs
            .iter()
            .map(|spec| format!("{}  ({})", spec.name(), spec.expected))
            .collect();
        return print_line(&lines.join("\n"));
    }
    let stop = interrupt::shutdown_on_interrupt();
    let (mut rows, mut undisturbed): (Vec<Row>, _) = (Vec::new(), BaselineRuns::default());
    for (index, spec) in specs.iter().enumerate() {
        if stop.shutdown_requested() {
            break;
        }
        print_status(&format!("{}/{}: {}", index + 1, specs.len(), spec.name()));
        rows.push(perform(spec, args, arms.of(spec), &mut undisturbed)?);
    }
    match args.json {
        true => print_json(&rows)?,
        false => print_line(&row::table(&rows))?,
    }
    if let Some(file) = &args.markdown {
        supple_files::write_atomic(file, row::page(&rows, &args.command_line()).as_bytes())
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

impl DrillArgs {
    /// Returns the command line that selects these test cases.
    fn command_line(&self) -> String {
        let mut parts = vec!["supple drill".to_owned()];
        if self.arm != DEFAULT_ARM {
            parts.push(format!("--arm {}", self.arm));
        }
        if let Some(plant) = self.plant {
            parts.push(format!("--plant {plant:?}").to_lowercase());
        }
        if let Some(count) = self.random {
            parts.push(format!("--random {count}"));
            parts.extend((self.seed != 1).then(|| format!("--seed {}", self.seed)));
            parts.extend(
                self.all_joints_active
                    .then(|| "--all-joints-active".to_owned()),
            );
        }
        parts.extend(self.only.iter().map(|part| format!("--only {part}")));
        parts.extend(self.virtual_time.then(|| "--virtual-time".to_owned()));
        if let Some(file) = &self.markdown {
            // The page contains the command that creates it at the default path.
            let name = file.file_name().unwrap_or_default().to_string_lossy();
            parts.push(format!("--markdown docs/{name}"));
        }
        parts.join(" ")
    }
}

fn chosen(args: &DrillArgs) -> Result<Vec<Spec>, Failure> {
    let plants = match args.plant {
        Some(PlantKind::Can) => return Err(Failure::FaultTestOnRealArm),
        Some(plant) => vec![plant],
        None => vec![PlantKind::Sim, PlantKind::Emu],
    };
    let selected = |spec: &Spec| {
        let name = spec.name();
        let named = args.only.is_empty() || args.only.iter().any(|part| name.contains(part));
        named && !(args.virtual_time && spec.runs_in_wall_clock_time())
    };
    let specs = plants.into_iter().flat_map(matrix::all).filter(selected);
    let specs: Vec<Spec> = specs.collect();
    match specs.is_empty() {
        true => Err(Failure::NoSuchTestCase {
            patterns: args.only.join(", "),
        }),
        false => Ok(specs),
    }
}

/// Runs a test case. A case that cannot be run counts as failed; the others continue.
fn perform(
    spec: &Spec,
    args: &DrillArgs,
    arm: &TestArm,
    undisturbed: &mut BaselineRuns,
) -> Result<Row, Failure> {
    let result = with_dof!(arm.description.dof(), N => match spec.runs_in_wall_clock_time() {
        true => perform::perform::<N>(spec, args, arm),
        false => lockstep::perform::<N>(spec, arm, undisturbed),
    })?;
    match result {
        Ok(row) => Ok(row),
        // A missing program would fail every test case, so stop here.
        Err(failure @ Failure::MissingProgram { .. }) => Err(failure),
        Err(failure) => Ok(Row::failed(spec, &failure.to_string())),
    }
}
