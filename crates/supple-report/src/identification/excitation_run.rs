//! `supple excite run`: runs a designed motion on the simulated arm and logs it.

use serde::{Deserialize, Serialize};
use std::path::Path;
use supple_cli::arguments::RunArgs;
use supple_cli::arms;
use supple_cli::console::{print_json, print_line, print_status};
use supple_cli::exit::Failure;
use supple_cli::out::Staging;
use supple_experiment::calibrate::plant_of;
use supple_experiment::{Calibration, excitation, slow_motion};
use supple_ident::{FourierCoefficients, ReadError};
use supple_model::{Description, with_dof};
use supple_plant::PlantOptions;

/// Maximum size of a design file \[bytes\].
const MAX_BYTES: u64 = 1 << 20;

/// The fields of a design's `summary.json` that this command uses.
#[derive(Deserialize)]
struct ExcitationDesign {
    arm: String,
    moving: Vec<usize>,
    #[serde(flatten)]
    series: FourierCoefficients,
}

#[derive(Serialize)]
struct Summary<'a> {
    arm: &'a str,
    design: &'a Path,
    log: std::path::PathBuf,
    seed: u64,
    /// Effects of a real arm in the plant; empty without effects.
    plant: &'a PlantOptions,
    /// Durations of the designed motion and of the slow motion after it, unless omitted \[s\].
    recorded_s: Vec<f64>,
}

/// Runs `supple excite run`.
///
/// # Errors
/// [`Failure`].
pub fn run(args: &RunArgs) -> Result<(), Failure> {
    let arm = arms::find(&args.urdf.name(&args.arm), args.strict)?;
    let design = read(&args.design)?;
    with_dof!(arm.dof(), N => run_with_dof::<N>(&arm, &design, args))?
}

fn read(path: &Path) -> Result<ExcitationDesign, Failure> {
    let path = match path.is_dir() {
        true => path.join("summary.json"),
        false => path.to_owned(),
    };
    let file = path.display().to_string();
    let text = supple_files::read_text(&path, MAX_BYTES).map_err(|error| ReadError::File {
        file: file.clone(),
        error,
    })?;
    Ok(
        serde_json::from_str(&text).map_err(|error| ReadError::Table {
            file,
            problem: format!("not a design: {error}"),
            remedy: "give the folder that `supple excite design` wrote",
        })?,
    )
}

fn run_with_dof<const N: usize>(
    arm: &Description,
    design: &ExcitationDesign,
    args: &RunArgs,
) -> Result<(), Failure> {
    let calibration = Calibration {
        load: !args.no_load_friction,
        plant: args.plant.options(arm)?,
        ripple_nm: args.ripple,
        ..Calibration::new(args.seed)
    };
    let staging = Staging::new(&args.out, &["summary.json", "logs/excitation.mcap"])?;
    let plant = plant_of::<N>(arm, &calibration)?;
    let effects = &calibration.plant;
    if design.arm != arm.name() {
        print_status(&format!(
            "warning: the motion was designed for {}, and runs on {}",
            design.arm,
            arm.name()
        ));
    }
    let (config, home) = (arm.config::<N>()?, arm.home::<N>()?);
    if let Some(joint) = design.moving.iter().find(|joint| **joint >= N) {
        return Err(Failure::from(ReadError::Table {
            file: args.design.display().to_string(),
            problem: format!("joint {joint} of `moving` is not one of the {N} joints of this arm"),
            remedy: "give the arm of the design with --arm",
        }));
    }
    let mut trajectories = vec![design.series.fourier::<N>()?];
    if !args.no_slow {
        trajectories.push(slow_motion(&config, &home, &design.moving)?);
    }
    let session = excitation("excitation", &config, &plant, &home, &trajectories);
    session.record_with_notes(
        Some(&staging.folder("logs")?),
        arm,
        args.seed,
        effects.notes(),
    )?;
    let summary = Summary {
        arm: arm.name(),
        design: &args.design,
        log: args.out.join("logs/excitation.mcap"),
        seed: args.seed,
        plant: effects,
        recorded_s: trajectories
            .iter()
            .map(|series| series.duration_s)
            .collect(),
    };
    let text = supple_cli::console::json(&summary)?;
    staging.write("summary.json", format!("{text}\n").as_bytes())?;
    staging.publish()?;
    if args.json {
        return print_json(&summary);
    }
    let total_s: f64 = summary.recorded_s.iter().sum();
    print_line(&format!(
        "simulated {}: {total_s:.1} s of motion; {}",
        arm.name(),
        summary.log.display()
    ))
}
