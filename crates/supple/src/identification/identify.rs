//! `supple identify`: from logs to a model that the controller loads.

use super::IdentifyArgs;
use super::report::{Found, Summary, html, summary};
use crate::arms;
use crate::console::{json, say};
use crate::exit::Failure;
use crate::out::Staging;
use std::path::Path;
use supple_experiment::foretell;
use supple_ident::{
    Fit, FrictionChoice, Log, Motion, Preparation, Procedure, Validation, fit_with_dip,
    identify_motions, read_logs,
};
use supple_model::{Description, with_dof};

/// Part of the first log that is kept back where none is given to validate.
const KEPT_BACK: f64 = 0.2;
/// Slow samples of the project's own logs, which have the rate to tell them.
const SLOW_RAD_PER_S: f64 = 0.15;
/// Models drawn to foretell the tracking error.
const DRAWS: u64 = 5;

/// What it leaves.
pub const FILES: [&str; 4] = ["arm.urdf", "arm.toml", "report.html", "summary.json"];

/// Does it.
///
/// # Errors
/// [`Failure`].
pub fn run(args: &IdentifyArgs) -> Result<(), Failure> {
    let arm = arms::find(&args.arm, args.strict)?;
    with_dof!(arm.dof(), N => sized::<N>(&arm, args))?
}

fn procedure(args: &IdentifyArgs, period_s: f64) -> Procedure {
    let given = |list: &Vec<usize>| (!list.is_empty()).then(|| list.clone());
    let ours = ours(args);
    Procedure {
        moving: given(&args.moving),
        couplings: args.coupling.clone(),
        preparation: Preparation {
            rate_hz: args.rate,
            cutoff_hz: Some(args.cutoff),
            keep_every: if ours { 10 } else { 1 },
            // The project's own logs hold commands, which act in the cycle after, for a cycle.
            torque_delay_s: if ours { 1.5 * period_s } else { 0.0 },
        },
        method: args.method.into(),
        friction: FrictionChoice::Auto,
        slow_rad_per_s: slow(args).unwrap_or(0.0),
        joint_noise_nm: (!args.noise.is_empty()).then(|| args.noise.clone()),
        ..Procedure::default()
    }
}

/// All logs are the project's own.
fn ours(args: &IdentifyArgs) -> bool {
    let is_mcap = |path: &std::path::PathBuf| path.extension().is_some_and(|end| end == "mcap");
    args.logs.iter().all(is_mcap)
}

/// Speed below which samples are left out, if any are.
fn slow(args: &IdentifyArgs) -> Option<f64> {
    args.slow
        .or(ours(args).then_some(SLOW_RAD_PER_S))
        .filter(|speed| *speed > 0.0)
}

/// Motions of files, each with the name of its file.
type Named = Vec<(String, Motion)>;

fn motions<const N: usize>(
    paths: &[std::path::PathBuf],
    moving: &[usize],
    preparation: &Preparation,
    warnings: &mut Vec<supple_ident::Warning>,
) -> Result<Named, Failure> {
    let mut all = Vec::new();
    for path in paths {
        let logs: Vec<Log> = read_logs::<N>(path)?;
        for log in &logs {
            let (motion, doubts) = Motion::prepare(log, N, moving, preparation)?;
            warnings.extend(doubts);
            all.push((path.display().to_string(), motion));
        }
    }
    Ok(all)
}

fn sized<const N: usize>(arm: &Description, args: &IdentifyArgs) -> Result<(), Failure> {
    let staging = Staging::new(&args.out, &FILES)?;
    let nominal = arm.arm::<N>()?;
    let procedure = procedure(args, arm.settings().period_s);
    let moving = procedure.moving_joints(N)?;
    let mut warnings = Vec::new();
    let preparation = &procedure.preparation;
    let mut fitted = motions::<N>(&args.logs, &moving, preparation, &mut warnings)?;
    let mut held_out = motions::<N>(&args.validate, &moving, preparation, &mut warnings)?;
    if held_out.is_empty()
        && let Some((name, motion)) = fitted.first_mut()
    {
        let samples = motion.samples();
        let cut = ((1.0 - KEPT_BACK) * samples as f64) as usize;
        held_out.push((
            format!("{name}, its last {:.0} %", 100.0 * KEPT_BACK),
            motion.part(cut..samples),
        ));
        *motion = motion.part(0..cut);
    }
    let data: Vec<Motion> = fitted.iter().map(|(_, motion)| motion.clone()).collect();
    let mut fit: Fit<N> = if slow(args).is_some() {
        let given = Procedure {
            prior_weight: Some(1.0),
            ..procedure.clone()
        };
        fit_with_dip(&nominal, &data, &moving, &given)?
    } else {
        identify_motions(&nominal, &data, &moving, &procedure)?
    };
    fit.warnings.extend(warnings);
    let mut checked: Vec<(String, Motion, Validation)> = Vec::new();
    for (name, motion) in held_out {
        let validation = fit.validate_motion(&motion)?;
        checked.push((name, motion, validation));
    }
    let described = fit.description(arm, None)?;
    let found = Found {
        arm: &described,
        fit: &fit,
        logs: args
            .logs
            .iter()
            .map(|path| path.display().to_string())
            .collect(),
        held_out: checked,
        foretold: foretell(&described, &fit, DRAWS)?,
    };
    let numbers = summary(&found);
    write(&staging, &found, &numbers)?;
    staging.publish()?;
    if args.json {
        return say(&json(&numbers)?);
    }
    print(&numbers, &args.out)
}

/// Writes model, report and numbers.
///
/// # Errors
/// [`Failure`].
pub fn write<const N: usize>(
    staging: &Staging,
    found: &Found<'_, N>,
    numbers: &Summary,
) -> Result<(), Failure> {
    staging.write("arm.urdf", found.arm.urdf().as_bytes())?;
    staging.write("arm.toml", found.arm.toml().as_bytes())?;
    staging.write("report.html", html(found, numbers)?.as_bytes())?;
    staging.write("summary.json", format!("{}\n", json(numbers)?).as_bytes())
}

/// Says what was found.
///
/// # Errors
/// [`Failure::File`].
pub fn print(numbers: &Summary, out: &Path) -> Result<(), Failure> {
    for (of, table) in &numbers.choices {
        say(&format!("{of}\n{}", table.trim_end()))?;
    }
    say(&format!(
        "rank {} of {} columns, condition number {:.1}, {:.2} % of the torque left unexplained",
        numbers.rank,
        numbers.columns,
        numbers.condition,
        100.0 * numbers.training_relative
    ))?;
    for line in &numbers.held_out {
        say(&format!(
            "held out: {}: {:.2} %",
            line.log,
            100.0 * line.total_relative
        ))?;
    }
    for warning in &numbers.warnings {
        say(&format!("warning: {warning}"))?;
    }
    say(&numbers.verdict)?;
    say(&numbers.verdict_at_5_n_per_m)?;
    say(&format!("model and report: {}", out.display()))
}
