//! Calibrates realistic WAMs in this process by the steps of `supple calibrate --plant in-process`, one seed after the
//! other, from models that are 15 % off in gravity and 50 % in friction: `calibrations OUT FIRST LAST [GRAVITY FRICTION]`.

use std::path::{Path, PathBuf};
use supple_experiment::Mismatch;
use supple_experiment::calibrate::plant_of;
use supple_experiment::procedure::{
    InProcessArm, LOGS, Operator, ProcedureOptions, Sweep, calibrate_arm,
};
use supple_experiment::{Calibration, ExperimentError};
use supple_model::{Description, IdentifiedModel};
use supple_plant::PlantOptions;

struct Quiet;

impl Operator for Quiet {
    fn progress(&mut self, text: &str) {
        eprintln!("    {text}");
    }

    fn confirms(&mut self, _: &Sweep, _: &Path) -> bool {
        true
    }

    fn attaches_weight(&mut self, _: f64) -> bool {
        false
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let out = PathBuf::from(arguments.first().ok_or("give a folder")?);
    let number = |i: usize, default: f64| -> Result<f64, std::num::ParseFloatError> {
        arguments.get(i).map_or(Ok(default), |text| text.parse())
    };
    let (first, last) = (number(1, 0.0)? as u64, number(2, 0.0)? as u64);
    let (gravity, friction) = (number(3, 0.15)?, number(4, 0.5)?);
    let arm = Description::asset("wam4")?;
    println!(
        "| seed | motion [min] | gravity [%] | 5 N/m calibrated [mm] | learning [mm] | contacts | unexplained [%] |"
    );
    for seed in first..=last {
        let row = calibrated(
            &arm,
            seed,
            gravity,
            friction,
            &out.join(format!("seed-{seed}")),
        );
        match row {
            Ok(row) => println!("{row}"),
            Err(error) => println!("| {seed} | {error} |"),
        }
    }
    Ok(())
}

fn calibrated(
    arm: &Description,
    seed: u64,
    gravity: f64,
    friction: f64,
    out: &Path,
) -> Result<String, Box<dyn std::error::Error>> {
    std::fs::create_dir_all(out.join(LOGS))?;
    let calibration = Calibration {
        plant: PlantOptions::realistic(),
        ..Calibration::new(seed)
    };
    let plant = plant_of::<4>(arm, &calibration)?;
    let nominal = arm.config::<4>()?;
    let start = Mismatch {
        gravity,
        friction,
        seed,
    };
    let start = start.apply(&nominal).map_err(ExperimentError::from)?;
    let start = arm.with_model(&IdentifiedModel {
        arm: &start.arm,
        friction: &start.friction,
        ripple: None,
        source: "the nominal arm with errors",
    })?;
    let mut simulated = InProcessArm::new(
        plant.clone(),
        arm.home::<4>()?,
        out.join(LOGS),
        calibration.plant.notes(),
    );
    let options = ProcedureOptions {
        seed,
        ..ProcedureOptions::new(out.to_owned())
    };
    let found = calibrate_arm(&mut simulated, &start, &options, &mut Quiet)?;
    let model = found.description.config::<4>()?;
    let truth = supple_experiment::calibrate::model_accuracy(&model, &plant, seed);
    let progress = &found.progress;
    let mm = |error: Option<f64>| error.map_or("fault".to_owned(), |m| format!("{:.1}", 1e3 * m));
    let sinusoid = progress.sinusoid.clone().unwrap_or_default();
    let unexplained = progress
        .fit
        .as_ref()
        .map_or(1.0, |fit| fit.validation_relative);
    Ok(format!(
        "| {seed} | {:.2} (stated {:.2}) | {:.2} | {} | {} | {} | {:.2} |",
        progress.moved_s / 60.0,
        progress.stated_s / 60.0,
        100.0 * truth.gravity_relative,
        mm(sinusoid.calibrated_rms_m),
        mm(sinusoid.learning_rms_m),
        sinusoid.false_contacts,
        100.0 * unexplained
    ))
}
