//! Prints the result of a calibration on the terminal.

use std::path::Path;
use supple_cli::console::{print_json, print_line};
use supple_cli::exit::Failure;
use supple_experiment::NO_INTERVAL;
use supple_experiment::procedure::CalibratedArm;
use supple_experiment::scenario::STIFFNESS_N_PER_M;

/// Prints the result.
///
/// # Errors
/// [`Failure::File`].
pub fn print(found: &CalibratedArm, out: &Path, json: bool) -> Result<(), Failure> {
    let progress = &found.progress;
    if json {
        return print_json(progress);
    }
    print_line(&format!(
        "{}: {:.1} minutes of motion, {:.1} were stated",
        progress.arm,
        progress.moved_s / 60.0,
        progress.stated_s / 60.0
    ))?;
    let names = found.description.joint_names();
    for (name, breakaway) in names.iter().zip(&progress.breakaway) {
        print_line(&format!(
            "breakaway of {name}: {:.3} N m, offset {:+.3} N m",
            breakaway.breakaway_nm(),
            breakaway.offset_nm()
        ))?;
    }
    if let Some(fit) = &progress.fit {
        print_line(&format!(
            "validation motion: {:.2} % of the torque unexplained; {}",
            100.0 * fit.validation_relative,
            fit.verdict
        ))?;
        let verdict = fit.interval_at_5_n_per_m.as_ref().map(|interval| {
            let joint = names.get(interval.worst.1).map_or("", String::as_str);
            interval.verdict(STIFFNESS_N_PER_M, joint)
        });
        print_line(verdict.as_deref().unwrap_or(NO_INTERVAL))?;
    }
    if let Some(drift_rad) = progress.float_drift_rad {
        print_line(&format!(
            "float: the joints drift by at most {drift_rad:.4} rad in 2 s"
        ))?;
    }
    if let Some(fault) = &progress.float_ended {
        print_line(&format!("a fault ended float: {fault}"))?;
    }
    if let Some(sinusoid) = &progress.sinusoid {
        let mm = |error: Option<f64>| {
            error.map_or("ended by a fault".to_owned(), |m| {
                format!("{:.1} mm RMS", 1e3 * m)
            })
        };
        print_line(&format!(
            "sinusoid at 5 N/m: {}; after 24 s of learning {}",
            mm(sinusoid.calibrated_rms_m),
            mm(sinusoid.learning_rms_m)
        ))?;
        if let Some(fault) = &sinusoid.ended {
            print_line(&format!("a fault ended the sinusoid: {fault}"))?;
        }
    }
    if let Some(weighing) = &progress.weighing {
        for line in weighing.lines() {
            print_line(&line)?;
        }
        print_line(
            "for true newtons multiply torque_scale of each motor in [bus] by its ratio, and calibrate again",
        )?;
    }
    print_line(&format!("model: {}", out.display()))?;
    let learned = progress
        .sinusoid
        .as_ref()
        .and_then(|of| of.learned_model.as_ref());
    match learned {
        Some(folder) => print_line(&format!(
            "model with what was learned in the sinusoid: {}",
            out.join(folder).display()
        )),
        None => Ok(()),
    }
}
