//! `supple calibrate`: runs all steps from breakaway to the demo on the simulated arm.

use super::identify::{FILES, print, write};
use super::report::{ReportInput, summary};
use crate::demo;
use serde::Serialize;
use supple_cli::arguments::{CalibrateArgs, DemoArgs, PlantArgs};
use supple_cli::arms::{self, DEFAULT_ARM};
use supple_cli::console::{json, print_line, print_status};
use supple_cli::exit::Failure;
use supple_cli::out::Staging;
use supple_experiment::calibrate::{described_plant, plant_of};
use supple_experiment::{
    Calibration, ExperimentError, IdentifiedModelTracking, ModelAccuracy, calibrate,
    predict_tracking_error, track_with_identified_model,
};
use supple_model::{Description, with_dof};
use supple_plant::PlantOptions;

/// Number of models drawn from the uncertainty of the fit to predict the tracking error.
const DRAWS: u64 = 5;

/// Name of the folder for the plant's description, if it differs from the description of `--arm`.
const PLANT: &str = "plant";

#[derive(Serialize)]
struct Summary {
    arm: String,
    seed: u64,
    /// Effects of a real arm in the plant; empty without effects.
    plant: PlantOptions,
    /// Joint, measured and true breakaway torque \[N m\].
    breakaway: Vec<(String, f64, f64)>,
    identification: super::report::Summary,
    /// Motor, harmonic, amplitude at the motor \[N m\].
    ripple: Vec<(usize, u32, f64)>,
    truth: ModelAccuracy,
    /// Tracking of the sinusoid with this model; `None` if the arm cannot do it.
    tracking: Option<IdentifiedModelTracking>,
    /// Tracking of the sinusoid, with calibration and plant without direction- and load-dependent friction.
    tracking_without_load: Option<IdentifiedModelTracking>,
    /// Why the sinusoid could not be tracked.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    not_tracked: Vec<String>,
}

/// Runs `supple calibrate`.
///
/// # Errors
/// [`Failure`].
pub fn run(args: &CalibrateArgs) -> Result<(), Failure> {
    if args.moved.on.is_some() {
        return Err(Failure::NeedsSupple { option: "--plant" });
    }
    let name = args.arm.as_deref().unwrap_or(DEFAULT_ARM);
    let arm = arms::find(&args.urdf.name(name), args.strict)?;
    with_dof!(arm.dof(), N => run_with_dof::<N>(&arm, args))??;
    if args.no_demo {
        return Ok(());
    }
    // The demo uses the arm that was calibrated, with its encoder noise; its friction depends on direction and load even if the
    // calibration left this out.
    let effects = args.plant.options(&arm)?;
    let realistic_seeds = u64::from(!effects.is_none());
    let noise_rad = PlantOptions::default_encoder_noise_rad(&arm);
    let encoder_noise_rad = effects.encoder_noise_rad.or(Some(noise_rad));
    let plant = args.out.join(PLANT);
    let demo = DemoArgs {
        urdf: args.urdf.clone(),
        arm: match args.ripple > 0.0 {
            true => plant.display().to_string(),
            false => name.to_owned(),
        },
        strict: args.strict,
        model: Some(args.out.clone()),
        out: args.out.join("demo"),
        seed: args.seed,
        json: false,
        quiet: args.quiet || args.json,
        no_logs: true,
        realistic_seeds,
        plant: PlantArgs::default(),
    };
    let summary = demo::perform(
        &demo,
        Some(PlantOptions {
            encoder_noise_rad,
            ..effects
        }),
    )?;
    if !args.json {
        demo::print(&summary)?;
    }
    demo::finish(&demo, &summary)
}

fn run_with_dof<const N: usize>(arm: &Description, args: &CalibrateArgs) -> Result<(), Failure> {
    let staging = Staging::new(&args.out, &[&FILES[..], &["calibration.json"]].concat())?;
    let calibration = Calibration {
        ripple_nm: args.ripple,
        load: !args.no_load_friction,
        plant: args.plant.options(arm)?,
        breakaway: true,
        log_dir: Some(staging.folder("logs")?),
        ..Calibration::new(args.seed)
    };
    let found = calibrate::<N>(arm, &calibration, &mut |step| {
        if !args.quiet {
            print_status(step);
        }
    })?;
    let follow = |calibration: &Calibration, found: &Description| -> Result<_, Failure> {
        Ok(track_with_identified_model(
            found,
            &plant_of::<N>(arm, calibration)?,
        )?)
    };
    let mut not_tracked = Vec::new();
    let mut failed = |reason: String| not_tracked.push(reason);
    let followed = follow(&calibration, &found.description)?;
    let followed = followed.map_err(&mut failed).ok();
    let mut without_load = None;
    if !args.no_load_friction {
        if !args.quiet {
            print_status("the same without direction- and load-dependent friction");
        }
        let other = Calibration {
            load: false,
            breakaway: false,
            log_dir: None,
            ..calibration.clone()
        };
        let found = calibrate::<N>(arm, &other, &mut |_| {})?;
        let followed = follow(&other, &found.description)?;
        without_load = followed.map_err(&mut failed).ok();
    }
    let predicted_tracking = predict_tracking_error(&found.description, &found.fit, DRAWS)?;
    let given = calibration.start.apply(&arm.config::<N>()?);
    let given = given.map_err(ExperimentError::from)?;
    let report = ReportInput {
        arm: &found.description,
        given_friction: given.friction.to_vec(),
        fit: &found.fit,
        logs: vec!["excitation".to_owned()],
        held_out: vec![(
            "another excitation".to_owned(),
            found.held_out.clone(),
            found.validation.clone(),
        )],
        predicted_tracking,
        weighing: None,
    };
    if args.ripple > 0.0 {
        // The demo uses the plant including its ripple, and adds the other effects itself.
        let rippling = Calibration {
            plant: PlantOptions::default(),
            ..calibration.clone()
        };
        let plant = plant_of::<N>(arm, &rippling)?;
        described_plant(arm, &plant)?.save(&staging.folder(PLANT)?)?;
    }
    let identification = summary(&report);
    write(&staging, &report, &identification)?;
    let names = arm.joint_names();
    let numbers = Summary {
        arm: arm.name().to_owned(),
        seed: args.seed,
        plant: calibration.plant.clone(),
        breakaway: names
            .iter()
            .zip(&found.breakaway)
            .map(|(name, (measured, truth))| (name.clone(), measured.breakaway_nm(), *truth))
            .collect(),
        ripple: found
            .ripple
            .iter()
            .enumerate()
            .flat_map(|(motor, table)| {
                table
                    .harmonics()
                    .iter()
                    .map(move |h| (motor, h.harmonic, h.sine_nm.hypot(h.cosine_nm)))
            })
            .collect(),
        identification,
        truth: found.truth.clone(),
        tracking: followed,
        tracking_without_load: without_load,
        not_tracked,
    };
    let text = json(&numbers)?;
    staging.write("calibration.json", format!("{text}\n").as_bytes())?;
    staging.publish()?;
    if args.json {
        return print_line(&text);
    }
    for (name, measured, truth) in &numbers.breakaway {
        print_line(&format!(
            "breakaway of {name}: measured {measured:.3} N m, plant {truth:.3} N m"
        ))?;
    }
    for (motor, harmonic, amplitude) in &numbers.ripple {
        print_line(&format!(
            "ripple of motor {motor}: harmonic {harmonic}, {amplitude:.5} N m"
        ))?;
    }
    print(&numbers.identification, &args.out)?;
    let friction: Vec<String> = numbers
        .truth
        .friction_relative
        .iter()
        .map(|x| format!("{:.2} %", 100.0 * x))
        .collect();
    print_line(&format!(
        "error relative to the simulated plant: gravity {:.3} %, friction curves {}",
        100.0 * numbers.truth.gravity_relative,
        friction.join(", ")
    ))?;
    if let Some(tracking) = &numbers.tracking {
        print_line(&format!(
            "sinusoid at 5 N/m with this model: {}",
            both(tracking)
        ))?;
    }
    if let Some(tracking) = &numbers.tracking_without_load {
        print_line(&format!(
            "without direction- and load-dependent friction: {}; the difference is due to that friction",
            both(tracking)
        ))?;
    }
    for reason in &numbers.not_tracked {
        print_line(&format!("sinusoid at 5 N/m not tracked: {reason}"))?;
    }
    print_line(
        "this is a simulation: fits of real arms of this kind leave a residual of 6.7 to 8.4 % of the torque",
    )
}

fn both(tracking: &IdentifiedModelTracking) -> String {
    format!(
        "{:.2} mm RMS with Coulomb friction, {:.2} mm with Stribeck friction",
        1e3 * tracking.coulomb_m,
        1e3 * tracking.stribeck_m
    )
}
