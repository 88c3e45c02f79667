//! `supple breakaway`: measures the breakaway torque of each joint of the simulated arm.

use super::requested_joints::requested_joints;
use serde::Serialize;
use supple_cli::arguments::BreakawayArgs;
use supple_cli::arms::{self, DEFAULT_ARM};
use supple_cli::console::{print_json, print_line};
use supple_cli::exit::Failure;
use supple_core::Vector;
use supple_experiment::calibrate::plant_of;
use supple_experiment::{Calibration, ExperimentError, breakaway, identify_ripple};
use supple_model::with_dof;

/// Result for one joint.
#[derive(Serialize)]
pub struct Line {
    /// Name of the joint.
    pub joint: String,
    /// Breakaway torque: half the sum of both directions \[N m\].
    pub breakaway_nm: f64,
    /// Offset: half the difference of both directions, caused by gravity or a torque offset \[N m\].
    pub offset_nm: f64,
    /// Breakaway torque of the plant \[N m\].
    pub truth_nm: f64,
}

/// Runs `supple breakaway`.
///
/// # Errors
/// [`Failure`].
pub fn run(args: &BreakawayArgs) -> Result<(), Failure> {
    if args.moved.on.is_some() {
        return Err(Failure::NeedsSupple { option: "--plant" });
    }
    let arm = arms::find(
        &args.urdf.name(args.arm.as_deref().unwrap_or(DEFAULT_ARM)),
        args.strict,
    )?;
    let joints = requested_joints(&args.joints, arm.dof())?;
    let effects = args.plant.options(&arm)?;
    let lines = with_dof!(arm.dof(), N => {
        let calibration = Calibration {
            plant: effects.clone(),
            ripple_nm: args.ripple,
            ..Calibration::new(args.seed)
        };
        let measure = || -> Result<Vec<Line>, ExperimentError> {
            let mut config = calibration.start.apply(&arm.config::<N>()?)?;
            let plant = plant_of::<N>(&arm, &calibration)?;
            if args.ripple > 0.0 {
                config.ripple = identify_ripple(&config, &plant, &arm.home::<N>()?)?;
            }
            let pose = Vector::<N>::from_fn(|i, _| {
                let zone = 2.0 * config.limits.soft_zone_rad;
                let lower = config.limits.position_lower_rad[i] + zone;
                let upper = config.limits.position_upper_rad[i] - zone;
                0.0_f64.clamp(lower.min(upper), upper.max(lower))
            });
            let found = breakaway(&config, &plant, &pose, &joints, &mut |_| {})?;
            Ok(joints.iter().zip(found).map(|(joint, found)| Line {
                joint: arm.joint_names()[*joint].clone(),
                breakaway_nm: found.breakaway_nm(),
                offset_nm: found.offset_nm(),
                truth_nm: plant.friction[*joint].breakaway_nm,
            }).collect())
        };
        measure()
    })??;
    if args.json {
        return print_json(&lines);
    }
    print_line(
        "simulated arm: torque ramp of 0.1 N m/s until the joint has moved 2 degrees, in both directions",
    )?;
    for line in &lines {
        print_line(&format!(
            "{:10} measured {:.3} N m, plant {:.3} N m; offset {:+.3} N m",
            line.joint, line.breakaway_nm, line.truth_nm, line.offset_nm
        ))?;
    }
    Ok(())
}
