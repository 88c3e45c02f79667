//! How often the measured tracking error is at most the upper bound that the verdict on the identified model states
//! (`docs/verdict.md`), from the files of `verdict_runs`.
//!
//! ```text
//! cargo run --release -p supple-experiment --example verdict_coverage -- FOLDER
//! ```

use core::ops::Range;
use std::collections::BTreeMap;
use std::path::Path;
use supple_experiment::{ErrorInterval, SinusoidRegion, error_interval};
use supple_ident::{DMatrix, Motion};
use supple_model::{Description, with_dof};

/// Seeds from here on are those of ideal plants.
const IDEAL: u64 = 10_000;
/// Seeds of the runs from which the factor from the estimated error to its upper bound was chosen.
const USED_FOR_FACTOR: [Range<u64>; 2] = [0..55, 130..185];
/// Stiffness of the impedance law with which the runs tracked the sinusoid \[N/m\].
const STIFFNESS_N_PER_M: f64 = 5.0;

/// Returns the interval from the held-out motion in a file. A row has the time, and angle, velocity and residual torque of each
/// joint.
fn interval<const N: usize>(
    description: &Description,
    text: &str,
) -> Result<ErrorInterval, Box<dyn std::error::Error>> {
    let held_out = text.lines().filter_map(|line| line.strip_prefix("held,"));
    let rows: Vec<Vec<f64>> = held_out
        .map(|line| line.split(',').map(str::parse).collect())
        .collect::<Result<_, _>>()?;
    let matrix = |first: usize| DMatrix::from_fn(rows.len(), N, |i, j| rows[i][first + 3 * j]);
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else {
        return Err("no held-out motion".into());
    };
    let motion = Motion {
        rate_hz: (rows.len() - 1) as f64 / (last[0] - first[0]),
        q: matrix(1),
        qd: matrix(2),
        qdd: DMatrix::zeros(rows.len(), N),
        tau: DMatrix::zeros(rows.len(), N),
        independent_fraction: 1.0,
        cutoff_hz: None,
        start_s: first[0],
        torque_delay_s: 0.0,
        excluded_intervals: Vec::new(),
    };
    let region = SinusoidRegion::<N>::new(description)?.ok_or("the sinusoid is out of reach")?;
    let identified_joints: Vec<usize> = (0..N).collect();
    let residuals = matrix(3);
    let interval = error_interval(
        &region,
        &identified_joints,
        &[(&motion, &residuals)],
        STIFFNESS_N_PER_M,
    );
    Ok(interval.ok_or("no interval")?)
}

/// Measured error of a run, and the interval that the verdict states \[m\].
struct RunResult {
    error_m: f64,
    interval: ErrorInterval,
}

/// Prints the counts, then the median, the minimum and the 10 % quantile of the upper bound relative to the measured error.
fn print_row(name: &str, runs: &[RunResult]) {
    let mut ratios: Vec<f64> = runs
        .iter()
        .map(|run| run.interval.upper_m / run.error_m)
        .collect();
    ratios.sort_by(f64::total_cmp);
    let share = |of: &dyn Fn(&RunResult) -> bool| {
        let count = runs.iter().filter(|run| of(run)).count();
        format!(
            "{count} ({:.0} %)",
            100.0 * count as f64 / runs.len() as f64
        )
    };
    let quantile = |share: f64| ratios[(share * (ratios.len() - 1) as f64).round() as usize];
    println!(
        "| {name} | {} | {} | {} | {:.2} | {:.2} | {:.2} |",
        runs.len(),
        share(&|run| run.error_m <= run.interval.upper_m),
        share(&|run| run.error_m < run.interval.lower_m),
        quantile(0.5),
        quantile(0.0),
        quantile(0.1)
    );
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args()
        .nth(1)
        .ok_or("usage: verdict_coverage FOLDER")?;
    let mut failed = 0;
    let mut results = BTreeMap::<String, Vec<RunResult>>::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let stem = path.file_stem().and_then(|stem| stem.to_str());
        let Some(seed) = stem.and_then(|stem| stem.parse::<u64>().ok()) else {
            continue;
        };
        let text = std::fs::read_to_string(&path)?;
        let [head, effects] = [0, 1].map(|line| text.lines().nth(line).unwrap_or_default());
        let numbers: Vec<f64> = head.split(' ').filter_map(|n| n.parse().ok()).collect();
        let arm = effects.split(' ').next().unwrap_or_default();
        if head.starts_with("# failed") || numbers.len() < 5 {
            failed += 1;
            continue;
        }
        let description = Description::asset(arm)?;
        let interval = with_dof!(description.dof(), N => interval::<N>(&description, &text))?;
        let interval = interval.map_err(|error| with_path(&path, &error))?;
        let groups = match seed >= IDEAL {
            true => vec!["ideal".to_owned()],
            false => {
                let chosen = USED_FOR_FACTOR.iter().any(|seeds| seeds.contains(&seed));
                let used = if chosen { "used" } else { "not used" };
                let all = "with effects".to_owned();
                vec![all, format!("{used} to choose the factor"), arm.to_owned()]
            }
        };
        for group in groups {
            let interval = interval.clone();
            // The second number is the error with the Stribeck effect in the feed-forward.
            let error_m = numbers[1];
            results
                .entry(group)
                .or_default()
                .push(RunResult { error_m, interval });
        }
    }
    println!(
        "| | runs | error at most the upper bound | error below the lower bound | upper bound over error, median | least | tenth |"
    );
    println!("|---|---|---|---|---|---|---|");
    for (name, runs) in &results {
        print_row(name, runs);
    }
    println!("{failed} runs gave no model or no tracking, most by a fault during the excitation");
    Ok(())
}

fn with_path(path: &Path, error: &dyn std::fmt::Display) -> String {
    format!("{}: {error}", path.display())
}
