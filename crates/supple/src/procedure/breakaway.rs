//! `supple breakaway --plant ..`: measures the breakaway torque of each joint of an arm, after the checks of its wiring.

use super::calibrate::Calibrate;
use super::{MovedArm, find};
use serde::Serialize;
use std::path::Path;
use supple_cli::arguments::{BreakawayArgs, CalibrationPlant};
use supple_cli::console::{print_json, print_line};
use supple_cli::exit::Failure;
use supple_experiment::procedure::{FILE, ProcedureOptions, StepName};
use supple_model::with_dof;

#[derive(Serialize)]
struct Line<'a> {
    joint: &'a str,
    /// Half the sum of both directions \[N m\].
    breakaway_nm: f64,
    /// Half the difference of both directions: gravity that the model lacks, or a torque offset \[N m\].
    offset_nm: f64,
}

/// Returns whether the file is that of a calibration beyond its breakaway torques.
fn is_further(file: &Path) -> bool {
    let text = std::fs::read_to_string(file).unwrap_or_default();
    let progress: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
    let finished = progress["finished"]
        .as_array()
        .map_or(&[][..], Vec::as_slice);
    finished.iter().any(|step| step["step"] == "first_pass")
}

/// Runs `supple breakaway` with `--plant`: the steps of a calibration up to the breakaway torques.
///
/// # Errors
/// [`Failure`].
pub fn run(args: &BreakawayArgs, on: CalibrationPlant) -> Result<(), Failure> {
    let arm = args.arm.as_deref();
    let (domain, name, description) = find(on, &args.moved, arm, &args.urdf, args.strict)?;
    let moved = MovedArm {
        on,
        args: &args.moved,
        plant: &args.plant,
        strict: args.strict,
        out: &args.out,
        seed: args.seed,
        ripple_nm: args.ripple,
        load_friction: true,
        json: args.json,
        quiet: args.json,
        name,
        description,
        domain,
    };
    let options = ProcedureOptions {
        until: Some(StepName::Breakaway),
        ..moved.options()
    };
    let file = args.out.join(FILE);
    if is_further(&file) {
        return Err(Failure::CalibrationWouldBeLost { file });
    }
    let work = Calibrate { options };
    let found = with_dof!(moved.description.dof(), N => moved.perform::<N, _>(work))??;
    let names = found.description.joint_names();
    let of_joints = names.iter().zip(&found.progress.breakaway);
    let lines: Vec<Line<'_>> = of_joints
        .map(|(joint, breakaway)| Line {
            joint,
            breakaway_nm: breakaway.breakaway_nm(),
            offset_nm: breakaway.offset_nm(),
        })
        .collect();
    if args.json {
        return print_json(&lines);
    }
    for line in &lines {
        print_line(&format!(
            "{:10} breakaway {:.3} N m, offset {:+.3} N m",
            line.joint, line.breakaway_nm, line.offset_nm
        ))?;
    }
    print_line(&format!(
        "{:.1} minutes of motion; logs: {}",
        found.progress.moved_s / 60.0,
        args.out.display()
    ))
}
