//! `supple identify`: identifies a model from logs; the controller can load it.

use super::report::{Found, Summary, html, summary};
use std::path::Path;
use supple_cli::arguments::IdentifyArgs;
use supple_cli::arms;
use supple_cli::console::{json, print_line};
use supple_cli::exit::Failure;
use supple_cli::out::Staging;
use supple_experiment::predict_tracking_error;
use supple_ident::{
    Fit, FrictionChoice, Log, Motion, Preparation, Procedure, Validation, fit_with_stribeck,
    identify_motions, read_logs,
};
use supple_model::{Description, with_dof};

/// Fraction of the first log that is held out for validation if no validation log is given.
const HELD_OUT_FRACTION: f64 = 0.2;
/// Speed below which samples of supple's own logs count as slow; their sampling rate is high enough for this
/// \[rad/s\].
const SLOW_RAD_PER_S: f64 = 0.15;
/// Number of models drawn to predict the tracking error.
const DRAWS: u64 = 5;

/// Output files.
pub const FILES: [&str; 4] = ["arm.urdf", "arm.toml", "report.html", "summary.json"];

/// Runs `supple identify`.
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
            // supple's own logs contain commanded torques; a command acts one cycle later and for one cycle, hence
            // the delay of 1.5 periods.
            torque_delay_s: if ours { 1.5 * period_s } else { 0.0 },
        },
        method: args.method.into(),
        friction: FrictionChoice::Auto,
        slow_rad_per_s: slow(args).unwrap_or(0.0),
        joint_noise_nm: (!args.noise.is_empty()).then(|| args.noise.clone()),
        ..Procedure::default()
    }
}

/// Whether all logs are supple's own.
fn ours(args: &IdentifyArgs) -> bool {
    let is_mcap = |path: &std::path::PathBuf| path.extension().is_some_and(|end| end == "mcap");
    args.logs.iter().all(is_mcap)
}

/// Speed below which samples are excluded; `None` if none are.
fn slow(args: &IdentifyArgs) -> Option<f64> {
    args.slow
        .or(ours(args).then_some(SLOW_RAD_PER_S))
        .filter(|speed| *speed > 0.0)
}

/// Motions with the names of their files.
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
            let (motion, result_warnings) = Motion::prepare(log, N, moving, preparation)?;
            warnings.extend(result_warnings);
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
        let cut = ((1.0 - HELD_OUT_FRACTION) * samples as f64) as usize;
        held_out.push((
            format!("{name}, its last {:.0} %", 100.0 * HELD_OUT_FRACTION),
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
        fit_with_stribeck(&nominal, &data, &moving, &given)?
    } else {
        identify_motions(&nominal, &data, &moving, &procedure)?
    };
    fit.warnings.extend(warnings);
    let mut checked: Vec<(String, Motion, Validation)> = Vec::new();
    for (name, motion) in held_out {
        let validation = fit.validate_motion(&motion)?;
        checked.push((name, motion, validation));
    }
    let validations: Vec<Validation> = checked.iter().map(|(.., found)| found.clone()).collect();
    let thresholds = fit.move_collision_nm(&validations, &arm.config::<N>()?);
    let described = fit
        .description(arm, None)?
        .with_move_collision(&thresholds)?;
    let found = Found {
        arm: &described,
        fit: &fit,
        logs: args
            .logs
            .iter()
            .map(|path| path.display().to_string())
            .collect(),
        held_out: checked,
        foretold: predict_tracking_error(&described, &fit, DRAWS)?,
    };
    let numbers = summary(&found);
    write(&staging, &found, &numbers)?;
    staging.publish()?;
    if args.json {
        return print_line(&json(&numbers)?);
    }
    print(&numbers, &args.out)
}

/// Writes model, report and summary.
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

/// Prints the summary.
///
/// # Errors
/// [`Failure::File`].
pub fn print(numbers: &Summary, out: &Path) -> Result<(), Failure> {
    for (of, table) in &numbers.choices {
        print_line(&format!("{of}\n{}", table.trim_end()))?;
    }
    print_line(&format!(
        "rank {} of {} columns, condition number {:.1}, residual {:.2} % of the torque",
        numbers.rank,
        numbers.columns,
        numbers.condition,
        100.0 * numbers.training_relative
    ))?;
    for line in &numbers.held_out {
        print_line(&format!(
            "held out: {}: residual {:.2} %",
            line.log,
            100.0 * line.total_relative
        ))?;
    }
    for warning in &numbers.warnings {
        print_line(&format!("warning: {warning}"))?;
    }
    print_line(&numbers.verdict)?;
    print_line(&numbers.verdict_at_5_n_per_m)?;
    print_line(&format!("model and report: {}", out.display()))
}
