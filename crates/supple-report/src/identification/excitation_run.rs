//! `supple excite run`: runs a designed motion on the simulated arm and logs it.

use serde::Serialize;
use std::path::Path;
use supple_cli::arguments::RunArgs;
use supple_cli::arms;
use supple_cli::console::{print_json, print_line};
use supple_cli::excitation_design::ExcitationDesign;
use supple_cli::exit::Failure;
use supple_cli::out::Staging;
use supple_experiment::calibrate::plant_of;
use supple_experiment::{Calibration, excitation};
use supple_model::{Description, with_dof};
use supple_plant::PlantOptions;

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
    if args.moved.on.is_some() {
        return Err(Failure::NeedsSupple { option: "--plant" });
    }
    let arm = arms::find(&args.urdf.name(&args.arm), args.strict)?;
    let design = ExcitationDesign::read(&args.design)?;
    with_dof!(arm.dof(), N => run_with_dof::<N>(&arm, &design, args))?
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
    let (config, home) = (arm.config::<N>()?, arm.home::<N>()?);
    let trajectories = design.series_for::<N>(arm, !args.no_slow)?;
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
