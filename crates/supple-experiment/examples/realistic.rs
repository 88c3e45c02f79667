//! Tracking at low stiffness on the realistic WAM by seed, calibrated alone and learning, in all or without some effects:
//! `realistic FIRST LAST [MODELS] [without=OPTION,..] [only=OPTION,..] [stiffness=N/m] [warm] [calibrated]`.
//!
//! `MODELS` is a folder that keeps the calibrated models, so that another run of the same options need not calibrate
//! again; `-` keeps none. `warm` adds the sinusoid after 20 minutes of work, `calibrated` the rows without learning.
//! Prints RMS errors of the tip in mm, and the false contacts.

use std::path::{Path, PathBuf};
use supple_experiment::effects::{calibrated, free_motion_at};
use supple_experiment::{ExperimentError, Setup};
use supple_model::Description;
use supple_plant::PlantOptions;

struct Options {
    models: Option<PathBuf>,
    plant: PlantOptions,
    stiffness_n_per_m: f64,
    warm: bool,
    calibrated: bool,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let mut number = || -> Result<u64, Box<dyn std::error::Error>> {
        Ok(arguments
            .next()
            .ok_or("give the first and the last seed")?
            .parse()?)
    };
    let (first, last) = (number()?, number()?);
    let mut options = Options {
        models: None,
        plant: PlantOptions::realistic(),
        stiffness_n_per_m: 5.0,
        warm: false,
        calibrated: false,
    };
    for argument in arguments {
        match argument.split_once('=') {
            Some(("without", names)) => {
                for name in names.split(',') {
                    let value = options.plant.value_mut(name);
                    *value.ok_or_else(|| format!("{name} is no option"))? = None;
                }
            }
            Some(("only", names)) => {
                let mut realistic = PlantOptions::realistic();
                options.plant = PlantOptions::default();
                for name in names.split(',').filter(|name| !name.is_empty()) {
                    let no_option = || format!("{name} is no option");
                    let value = *realistic.value_mut(name).ok_or_else(no_option)?;
                    *options.plant.value_mut(name).ok_or_else(no_option)? = value;
                }
            }
            Some(("stiffness", number)) => options.stiffness_n_per_m = number.parse()?,
            None if argument == "warm" => options.warm = true,
            None if argument == "calibrated" => options.calibrated = true,
            None if argument == "-" => options.models = None,
            _ => options.models = Some(PathBuf::from(argument)),
        }
    }
    let arm = Description::asset("wam4")?;
    let mut rows: Vec<Vec<f64>> = Vec::new();
    let mut contacts = 0;
    for seed in first..=last {
        match tracked(&arm, &options, seed) {
            Ok((row, latches)) => {
                println!("seed {seed}: {} mm, {latches} contacts", in_mm(&row));
                rows.push(row);
                contacts += latches;
            }
            Err(error) => println!("seed {seed}: {error}"),
        }
    }
    let columns = rows.first().map_or(0, Vec::len);
    let sorted = |column: usize| {
        let mut values: Vec<f64> = rows.iter().map(|row| row[column]).collect();
        values.sort_by(f64::total_cmp);
        values
    };
    let median: Vec<f64> = (0..columns)
        .filter_map(|c| supple_experiment::metrics::median(&sorted(c)))
        .collect();
    let worst: Vec<f64> = (0..columns).map(|c| sorted(c)[rows.len() - 1]).collect();
    println!("median: {}\nworst: {}", in_mm(&median), in_mm(&worst));
    println!("{contacts} contacts");
    Ok(())
}

/// Returns the sinusoid and arc learning; then the warm sinusoid, and sinusoid and arc calibrated alone, as asked.
fn tracked(
    arm: &Description,
    options: &Options,
    seed: u64,
) -> Result<(Vec<f64>, usize), ExperimentError> {
    let found = match &options.models {
        None => calibrated::<4>(arm, &options.plant, seed)?,
        Some(folder) => kept(arm, options, &folder.join(seed.to_string()), seed)?,
    };
    let setup = Setup::<4>::with_model(arm, &found, seed)?;
    let track = |plant: &PlantOptions, learning: bool| {
        let setup = setup.clone().with_plant_options(plant)?;
        free_motion_at(&setup, options.stiffness_n_per_m, learning)
    };
    let cold = track(&options.plant, true)?;
    let (mut row, mut latches) = (
        vec![cold.sinusoid_rms_m, cold.arc_rms_m],
        cold.false_latches,
    );
    if options.warm {
        let warm = PlantOptions {
            warmed_s: Some(1200.0),
            ..options.plant.clone()
        };
        let warm = track(&warm, true)?;
        row.extend([warm.sinusoid_rms_m, warm.arc_rms_m]);
        latches += warm.false_latches;
    }
    if options.calibrated {
        let alone = track(&options.plant, false)?;
        row.extend([alone.sinusoid_rms_m, alone.arc_rms_m]);
    }
    Ok((row, latches))
}

fn kept(
    arm: &Description,
    options: &Options,
    folder: &Path,
    seed: u64,
) -> Result<Description, ExperimentError> {
    if folder.join("arm.toml").exists() {
        return Ok(Description::load(folder)?);
    }
    let found = calibrated::<4>(arm, &options.plant, seed)?;
    found.save(folder)?;
    Ok(found)
}

fn in_mm(metres: &[f64]) -> String {
    let each: Vec<String> = metres.iter().map(|m| format!("{:.1}", 1e3 * m)).collect();
    each.join(" ")
}
