//! Calibrates simulated arms with random effects of real ones and tracks the sinusoid with each model: the data on which
//! the verdict's interval is judged (`verdict_coverage`).
//!
//! ```text
//! cargo run --release -p supple-experiment --example verdict_runs -- FOLDER FIRST LAST
//! ```
//! For each seed it writes `FOLDER/SEED.csv`: a line with the measured and the formerly predicted tracking errors, one with the
//! name of the arm and the effects, one with the friction found, then what the controller's feed-forward
//! leaves of the torques in the excitation, the slow motion and the held-out one. Finished seeds are skipped, so that it resumes.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use supple_experiment::calibrate::{plant_of, with_ripple_torque};
use supple_experiment::procedure::read_excitations;
use supple_experiment::{
    Calibration, calibrate, feedforward_residual_nm, predict_tracking_error,
    track_with_identified_model,
};
use supple_ident::{Motion, Preparation};
use supple_model::{Description, with_dof};
use supple_plant::PlantOptions;

/// Samples per second of the written residuals.
const RATE_HZ: f64 = 25.0;

/// Seeds from here on are those of ideal plants.
const IDEAL: u64 = 10_000;

/// Arms of the seeds, in turn.
const ARMS: [&str; 6] = ["wam4", "wam4", "paper3", "wam4", "wam4", "wam7"];

/// Effects of the set `realistic`, each left out in half of the combinations and otherwise from a third to three times its
/// size.
fn options(seed: u64) -> PlantOptions {
    let realistic = PlantOptions::realistic();
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x0076_6572_6469);
    let mut chosen = PlantOptions {
        seed: Some(seed as u32),
        ..PlantOptions::default()
    };
    if seed >= IDEAL {
        return chosen;
    }
    for (option, value) in realistic.values() {
        let (used, size) = (
            random.random::<f64>() < 0.5,
            3.0_f64.powf(2.0 * random.random::<f64>() - 1.0),
        );
        if let (Some(value), true) = (value, used) {
            let value = (value * size).clamp(option.min, option.max);
            let value = if option.whole { value.round() } else { value };
            if let Some(place) = chosen.value_mut(option.name) {
                *place = Some(value);
            }
        }
    }
    chosen
}

fn one<const N: usize>(
    description: &Description,
    seed: u64,
    folder: &Path,
) -> Result<String, Box<dyn std::error::Error>> {
    let logs = folder.join(format!("logs-{seed}"));
    std::fs::create_dir_all(&logs)?;
    let calibration = Calibration {
        plant: options(seed),
        candidates: 60,
        log_dir: Some(logs.clone()),
        ..Calibration::new(seed)
    };
    let found = calibrate::<N>(description, &calibration, &mut |_| {})?;
    let plant = plant_of::<N>(description, &calibration)?;
    let tracking = track_with_identified_model(&found.description, &plant)??;
    let predicted = predict_tracking_error(&found.description, &found.fit, 2)?;
    let predicted = predicted.ok_or("out of reach")?;
    let mut text = format!(
        "# {} {} {} {} {}\n",
        tracking.coulomb_m,
        tracking.stribeck_m,
        predicted.median_m.unwrap_or(f64::INFINITY),
        predicted.worst_m.unwrap_or(f64::INFINITY),
        found.validation.total_relative
    );
    write!(text, "{} ", description.name())?;
    for (option, value) in calibration.plant.values() {
        if let Some(value) = value {
            write!(text, "{}={value:.4} ", option.name)?;
        }
    }
    text.push('\n');
    let friction = found.fit.friction();
    for f in &friction {
        write!(text, "{} ", f.coulomb_nm)?;
    }
    text.push('\n');
    let config = description.config::<N>()?;
    let motor_from_joint = *supple_core::Controller::new(config)?.motor_from_joint();
    let file = std::fs::read_dir(&logs)?
        .filter_map(Result::ok)
        .map(|entry| entry.path())
        .find(|path| path.extension().is_some_and(|end| end == "mcap"))
        .ok_or("no log")?;
    let excitations = read_excitations::<N>(&file)?;
    let identified = found.description.config::<N>()?;
    let joints: Vec<usize> = (0..N).collect();
    for (name, log) in ["excitation", "slow", "held"].iter().zip(&excitations) {
        let log = with_ripple_torque(log, &found.ripple, &motor_from_joint);
        let preparation: Preparation = found.fit.preparation;
        let (motion, _) = Motion::prepare(&log, N, &joints, &preparation)?;
        let residual_nm = feedforward_residual_nm(&identified, &joints, &motion);
        let every = (motion.rate_hz / RATE_HZ).round().max(1.0) as usize;
        for i in (0..motion.samples()).step_by(every) {
            write!(text, "{name},{:.3}", motion.time_s(i))?;
            for j in 0..N {
                write!(
                    text,
                    ",{:.4},{:.4},{:.4}",
                    motion.q[(i, j)],
                    motion.qd[(i, j)],
                    residual_nm[(i, j)]
                )?;
            }
            text.push('\n');
        }
    }
    std::fs::remove_dir_all(&logs)?;
    Ok(text)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, folder, first, last] = &arguments[..] else {
        return Err("usage: verdict_runs FOLDER FIRST LAST".into());
    };
    let folder = PathBuf::from(folder);
    std::fs::create_dir_all(&folder)?;
    for seed in first.parse::<u64>()?..last.parse::<u64>()? {
        let path = folder.join(format!("{seed}.csv"));
        if path.exists() {
            continue;
        }
        let description = Description::asset(ARMS[(seed % ARMS.len() as u64) as usize])?;
        let text = with_dof!(description.dof(), N => one::<N>(&description, seed, &folder))?;
        let text =
            text.unwrap_or_else(|error| format!("# failed: {} {error}\n", description.name()));
        std::fs::write(&path, text)?;
        println!("{seed} {}", description.name());
    }
    Ok(())
}
