//! `supple drill --random`: faults of random kinds at random times in random tasks and poses, evaluated by energy and speed alone.
//!
//! Each case of [`super::matrix`] has its own expected result. The random cases share one set of rules ([`verdict`]) instead.
//! Controller, drive guard and simulated arm run in one process, so that thousands of cases take minutes.

mod arm;
mod course;
mod draw;
mod page;
mod tasks;
mod verdict;

use crate::cli::DrillArgs;
use arm::Arm;
use page::Row;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use supple_cli::console::{print_json, print_line, print_status};
use supple_cli::exit::Failure;
use supple_cli::interrupt;
use supple_experiment::ExperimentError;
use supple_model::{Description, with_dof};

/// Number of cases between two lines of progress.
const PROGRESS: u64 = 250;
/// Maximum number of seeds that the error lists.
const NAMED_SEEDS: usize = 10;

/// Runs `count` cases from the seed of the command line on.
///
/// # Errors
/// [`Failure::Drill`] if a case violates a rule; [`Failure::NoSuchTestCase`] for an arm whose drives do not brake.
pub(super) fn run(args: &DrillArgs, description: &Description, count: u64) -> Result<(), Failure> {
    if description.falls_without_torque() {
        return Err(Failure::NoSuchTestCase {
            patterns: format!(
                "--random of {}: random cases are for arms whose idle drives brake",
                description.name()
            ),
        });
    }
    let rows = with_dof!(description.dof(), N => run_cases::<N>(args, description, count))??;
    match args.json {
        true => print_json(&rows)?,
        false => print_line(&page::terminal(&rows))?,
    }
    if let Some(file) = &args.markdown {
        let text = page::page(&rows, args, description);
        supple_files::write_atomic(file, text.as_bytes())
            .map_err(|error| Failure::file("write", file, error))?;
    }
    let violating_seeds: Vec<String> = rows
        .iter()
        .filter(|row| !row.excesses.is_empty())
        .map(|row| row.seed.to_string())
        .collect();
    if violating_seeds.is_empty() {
        return Ok(());
    }
    let more = violating_seeds.len().saturating_sub(NAMED_SEEDS);
    let mut named = violating_seeds
        .into_iter()
        .take(NAMED_SEEDS)
        .collect::<Vec<_>>();
    if more > 0 {
        named.push(format!("{more} more"));
    }
    Err(Failure::Drill {
        rows: format!("seeds {}", named.join(", ")),
    })
}

/// Runs the cases on all processors, until an interrupt; returns their rows in the order of the seeds.
fn run_cases<const N: usize>(
    args: &DrillArgs,
    description: &Description,
    count: u64,
) -> Result<Vec<Row>, ExperimentError> {
    let stop = interrupt::shutdown_on_interrupt();
    let arm = Arm::<N>::new(description)?;
    let (next, rows) = (AtomicU64::new(0), Mutex::new(Vec::new()));
    let work = || -> Result<(), ExperimentError> {
        while !stop.shutdown_requested() {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= count {
                break;
            }
            if index % PROGRESS == 0 && count > PROGRESS {
                print_status(&format!("{index}/{count} cases"));
            }
            let seed = args.seed.wrapping_add(index);
            // Without a case, the arm cannot perform the drawn task: no row.
            let Some(case) = draw::case(&arm, seed) else {
                continue;
            };
            let outcome = course::run(&arm, &case)?;
            let row = Row::new(seed, &case, &outcome);
            rows.lock()
                .unwrap_or_else(|poisoned| poisoned.into_inner())
                .push(row);
        }
        Ok(())
    };
    let workers = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        let threads: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        threads.into_iter().try_for_each(|thread| {
            thread
                .join()
                .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        })
    })?;
    let mut rows = rows
        .into_inner()
        .unwrap_or_else(|poisoned| poisoned.into_inner());
    rows.sort_by_key(|row| row.seed.wrapping_sub(args.seed));
    Ok(rows)
}
