//! `supple drill`: each process of a tracking system is killed and stopped in turn, by the wall clock, above a
//! block; what the simulated motors do and what the block feels is measured by the arm's own process, which
//! goes on when a controller does not. Then the process comes back, the others having gone on.
//!
//! | lost | expected |
//! |---|---|
//! | controller | fallback torque (gravity) at once, then idle: on a bus within 25 ms, in `sim` after 100 ms |
//! | the bus's process | the motors keep the last torque until the safety module's own time-out of 100 ms |
//! | the arm's process | there is no arm; the controller latches a fault and takes the next one on a reset |
//! | `supple up` | killed, the others leave in order; stopped, nothing |
//!
//! An arm that brakes sinks, at the speed at which shorted motors and friction take what gravity gives: the
//! 4-joint arm at 0.09 m/s, so that it meets the block with about 200 N for a millisecond or two and then rests on it.
//! That is the price of braking, alike in both plants (`supple-plant/tests/braking.rs`).

mod case;
mod perform;
mod row;
mod trace;

use crate::arms;
use crate::cli::{DrillArgs, PlantKind};
use crate::console::{remark, say, say_json};
use crate::exit::Failure;
use crate::interrupt;
use case::Case;
use row::Row;
use supple_model::with_dof;

/// Runs it.
///
/// # Errors
/// [`Failure::Drill`] where an outcome is not the expected one.
pub fn run(args: &DrillArgs) -> Result<(), Failure> {
    let description = arms::find(&args.arm, args.strict)?;
    let stop = interrupt::catch();
    let plants = match args.plant {
        Some(plant) => vec![plant],
        None => vec![PlantKind::Sim, PlantKind::Emu],
    };
    let mut rows: Vec<Row> = Vec::new();
    for plant in plants {
        if plant == PlantKind::Can {
            return Err(Failure::RealArm);
        }
        let wanted = |case: &Case| args.process.as_deref().is_none_or(|p| p == case.process);
        let mut without_n = None;
        for case in Case::all(plant).into_iter().filter(wanted) {
            if stop.asked() {
                break;
            }
            remark(&format!("{:?}: {} {}", case.plant, case.loss, case.process));
            let row = with_dof!(description.dof(), N => {
                perform::perform::<N>(&case, args, &description)
            })??;
            if case.loss == case::Loss::Nothing {
                without_n = Some(row.peak_force_n);
            }
            rows.push(Row {
                peak_force_without_n: without_n,
                ..row
            });
        }
    }
    match args.json {
        true => say_json(&rows)?,
        false => say(&row::table(&rows))?,
    }
    let failed = rows.iter().filter(|row| !row.as_expected);
    let failed: Vec<String> = failed.map(Row::name).collect();
    match failed.is_empty() {
        true => Ok(()),
        false => Err(Failure::Drill {
            rows: failed.join(", "),
        }),
    }
}
