//! How often the verdict's upper bound covers the measured tracking error, from the files of `verdict_runs`.
//!
//! ```text
//! cargo run --release -p supple-experiment --example verdict_coverage -- FOLDER
//! ```

use supple_experiment::error_interval;
use supple_ident::{DMatrix, Motion};
use supple_model::Description;

/// Seeds from here on are those of ideal plants.
const IDEAL: u64 = 10_000;

fn matrix(rows: &[Vec<f64>], first: usize) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), 4, |i, j| rows[i][first + 3 * j])
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args()
        .nth(1)
        .ok_or("usage: verdict_coverage FOLDER")?;
    let config = Description::asset("wam4")?.config::<4>()?;
    let (mut failed, mut ratios) = (0, [Vec::new(), Vec::new()]);
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let Some(seed) = path
            .file_stem()
            .and_then(|s| s.to_str()?.parse::<u64>().ok())
        else {
            continue;
        };
        let text = std::fs::read_to_string(&path)?;
        let head = text.lines().next().unwrap_or_default();
        let numbers: Vec<f64> = head.split(' ').filter_map(|n| n.parse().ok()).collect();
        if numbers.len() < 5 {
            failed += 1;
            continue;
        }
        let held = text.lines().filter_map(|line| line.strip_prefix("held,"));
        let rows: Vec<Vec<f64>> = held
            .map(|line| line.split(',').filter_map(|n| n.parse().ok()).collect())
            .collect();
        let motion = Motion {
            rate_hz: (rows.len() - 1) as f64 / (rows[rows.len() - 1][0] - rows[0][0]),
            q: matrix(&rows, 1),
            qd: matrix(&rows, 2),
            qdd: DMatrix::zeros(rows.len(), 4),
            tau: DMatrix::zeros(rows.len(), 4),
            independent_fraction: 1.0,
            cutoff_hz: None,
            start_s: rows[0][0],
            torque_delay_s: 0.0,
            masks: Vec::new(),
        };
        let residuals = matrix(&rows, 3);
        let interval = error_interval(&config, &[0, 1, 2, 3], &[(&motion, &residuals)], 5.0);
        let interval = interval.ok_or("no joint moves the tip")?;
        ratios[usize::from(seed >= IDEAL)].push(interval.upper_m / numbers[1]);
    }
    for (name, mut ratios) in ["with effects", "ideal"].into_iter().zip(ratios) {
        ratios.sort_by(f64::total_cmp);
        let covered = ratios.iter().filter(|r| **r >= 1.0).count();
        if let (Some(min), Some(median)) = (ratios.first(), ratios.get(ratios.len() / 2)) {
            println!(
                "{name}: {} runs, covered {covered}, upper bound over error: median {median:.2}, least {min:.2}, tenth \
                 {:.2}",
                ratios.len(),
                ratios[ratios.len() / 10]
            );
        }
    }
    println!("{failed} runs ended by a fault before the model could be used");
    Ok(())
}
