//! `supple calibrate-paper`: the identification procedure of the paper on the simulated arm of the paper.

use serde::Serialize;
use supple_cli::arguments::CalibratePaperArgs;
use supple_cli::console::{print_json, print_line, print_status};
use supple_cli::exit::Failure;
use supple_experiment::paper_procedure::{ARM, PaperProcedureResult, paper_procedure};
use supple_experiment::{Calibration, Mismatch};
use supple_model::Description;
use supple_model::paper::Parameters;

/// Units of the ten determined combinations, in the order of [`Parameters::BASE_NAMES`].
const UNITS: [&str; 10] = [
    "kg m^2",
    "kg m^2",
    "kg m^2",
    "kg m^2",
    "kg m^2",
    "kg m",
    "kg m",
    "N m s/rad",
    "N m s/rad",
    "N m s/rad",
];

/// A determined combination of parameters.
#[derive(Serialize)]
struct Row {
    name: &'static str,
    unit: &'static str,
    found: f64,
    standard_deviation: f64,
    plant: f64,
    printed_in_the_paper: f64,
}

/// Breakaway of a joint \[N m\].
#[derive(Serialize)]
struct Breakaway {
    measured_nm: f64,
    plant_coulomb_nm: f64,
    printed_in_the_paper_nm: f64,
}

#[derive(Serialize)]
struct Summary {
    arm: &'static str,
    seed: u64,
    motion_s: f64,
    samples: usize,
    rank: usize,
    columns: usize,
    condition: f64,
    residual_nm: f64,
    breakaway: Vec<Breakaway>,
    combinations: Vec<Row>,
    gravity_error_relative: f64,
    own_fit_gravity_error_relative: f64,
}

/// Runs `supple calibrate-paper`.
///
/// # Errors
/// [`Failure`].
pub fn run(args: &CalibratePaperArgs) -> Result<(), Failure> {
    let arm = Description::asset(ARM)?;
    let calibration = Calibration {
        start: Mismatch {
            seed: args.seed,
            ..Calibration::new(args.seed).start
        },
        load: !args.no_load_friction,
        plant: args.plant.options(&arm)?,
        ..Calibration::new(args.seed)
    };
    let found = paper_procedure(&calibration, args.samples, &mut |step| {
        if !args.quiet {
            print_status(step);
        }
    })?;
    let summary = summary(args.seed, &found);
    if args.json {
        return print_json(&summary);
    }
    print(&summary)
}

fn summary(seed: u64, found: &PaperProcedureResult) -> Summary {
    let printed = Parameters::PUBLISHED;
    Summary {
        arm: ARM,
        seed,
        motion_s: found.motion_s,
        samples: found.samples,
        rank: found.estimate.columns.rank(),
        columns: found.estimate.psi.len(),
        condition: found.estimate.columns.condition,
        residual_nm: found.estimate.residual_nm,
        breakaway: found
            .breakaway
            .iter()
            .zip(printed.coulomb_nm)
            .map(|((measured, plant), printed)| Breakaway {
                measured_nm: measured.breakaway_nm(),
                plant_coulomb_nm: *plant,
                printed_in_the_paper_nm: printed,
            })
            .collect(),
        combinations: (0..10)
            .map(|i| Row {
                name: Parameters::BASE_NAMES[i],
                unit: UNITS[i],
                found: found.estimate.base[i],
                standard_deviation: found.estimate.base_std[i],
                plant: found.truth[i],
                printed_in_the_paper: printed.base()[i],
            })
            .collect(),
        gravity_error_relative: found.gravity_relative,
        own_fit_gravity_error_relative: found.own_gravity_relative,
    }
}

fn print(summary: &Summary) -> Result<(), Failure> {
    print_line(&format!(
        "the paper's procedure, Eq. (3.7) and (3.8), on the simulated {}: {} samples of {:.1} s of motion",
        summary.arm, summary.samples, summary.motion_s
    ))?;
    for (joint, row) in summary.breakaway.iter().enumerate() {
        print_line(&format!(
            "S{}: breakaway {:.4} N m; the plant slides at {:.4} N m, the paper prints {:.4} N m",
            joint + 1,
            row.measured_nm,
            row.plant_coulomb_nm,
            row.printed_in_the_paper_nm
        ))?;
    }
    print_line(&format!(
        "rank {} of {} columns (sin^2 + cos^2 = 1 ties two), condition number {:.1}, residual {:.3} N m RMS",
        summary.rank, summary.columns, summary.condition, summary.residual_nm
    ))?;
    print_line(&format!(
        "{:12} {:>9} {:>9} {:>9} {:>9}",
        "", "found", "std", "plant", "paper"
    ))?;
    for row in &summary.combinations {
        print_line(&format!(
            "{:12} {:9.4} {:9.4} {:9.4} {:9.4} {}",
            row.name,
            row.found,
            row.standard_deviation,
            row.plant,
            row.printed_in_the_paper,
            row.unit
        ))?;
    }
    print_line(&format!(
        "error of the predicted gravity: {:.2} % of it; of `supple calibrate`'s fit of the same arm: {:.2} %",
        100.0 * summary.gravity_error_relative,
        100.0 * summary.own_fit_gravity_error_relative
    ))?;
    print_line(
        "the plant is the physical arm closest to the printed parameters: link 3 as printed has inertias of no rigid body",
    )
}
