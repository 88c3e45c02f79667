//! `supple excite run`: the simulated arm follows a motion that was designed, and logs it.

use super::RunArgs;
use crate::arms;
use crate::console::{say, say_json};
use crate::exit::Failure;
use crate::out::Staging;
use serde::{Deserialize, Serialize};
use std::path::Path;
use supple_experiment::calibrate::plant_of;
use supple_experiment::{Calibration, excitation, slow_motion};
use supple_ident::{ReadError, SeriesLists};
use supple_model::{Description, with_dof};

/// Longest design that is read \[bytes\].
const MOST_BYTES: u64 = 1 << 20;

/// What a design leaves in `summary.json`, as far as it is needed.
#[derive(Deserialize)]
struct Designed {
    moving: Vec<usize>,
    #[serde(flatten)]
    series: SeriesLists,
}

#[derive(Serialize)]
struct Summary<'a> {
    arm: &'a str,
    design: &'a Path,
    log: std::path::PathBuf,
    seed: u64,
    /// Recorded time of the design's motion, and of the slow one after it \[s\].
    recorded_s: Vec<f64>,
}

/// Does it.
///
/// # Errors
/// [`Failure`].
pub fn run(args: &RunArgs) -> Result<(), Failure> {
    let arm = arms::find(&args.arm, args.strict)?;
    let design = read(&args.design)?;
    with_dof!(arm.dof(), N => sized::<N>(&arm, &design, args))?
}

fn read(path: &Path) -> Result<Designed, Failure> {
    let path = match path.is_dir() {
        true => path.join("summary.json"),
        false => path.to_owned(),
    };
    let file = path.display().to_string();
    let text = supple_files::read_text(&path, MOST_BYTES).map_err(|error| ReadError::File {
        file: file.clone(),
        error,
    })?;
    Ok(
        serde_json::from_str(&text).map_err(|error| ReadError::Table {
            file,
            problem: format!("no design: {error}"),
            remedy: "give the folder that `supple excite design` wrote",
        })?,
    )
}

fn sized<const N: usize>(
    arm: &Description,
    design: &Designed,
    args: &RunArgs,
) -> Result<(), Failure> {
    let calibration = Calibration {
        load: args.load,
        ripple_nm: args.ripple,
        ..Calibration::new(args.seed)
    };
    let staging = Staging::new(&args.out, &["summary.json", "logs/excitation.mcap"])?;
    let plant = plant_of::<N>(arm, &calibration)?;
    let (config, home) = (arm.config::<N>()?, arm.home::<N>()?);
    let mut series = vec![design.series.fourier::<N>()?];
    if !args.no_slow {
        series.push(slow_motion(&config, &home, &design.moving)?);
    }
    let session = excitation("excitation", &config, &plant, &home, &series);
    session.record(Some(&staging.folder("logs")?), arm, args.seed)?;
    let summary = Summary {
        arm: arm.name(),
        design: &args.design,
        log: args.out.join("logs/excitation.mcap"),
        seed: args.seed,
        recorded_s: series.iter().map(|series| series.duration_s).collect(),
    };
    let text = crate::console::json(&summary)?;
    staging.write("summary.json", format!("{text}\n").as_bytes())?;
    staging.publish()?;
    if args.json {
        return say_json(&summary);
    }
    let total_s: f64 = summary.recorded_s.iter().sum();
    say(&format!(
        "simulated {}: {total_s:.1} s of motion; {}",
        arm.name(),
        summary.log.display()
    ))
}
