//! `supple identify`: identifies a model from logs; the controller can load it.

use super::report::{ReportInput, Summary, html, summary};
use crate::progress::Steps;
use std::path::Path;
use supple_cli::arguments::{EffectsArg, IdentifyArgs, TorqueDelay};
use supple_cli::arms;
use supple_cli::console::{json, print_line};
use supple_cli::exit::Failure;
use supple_cli::out::Staging;
use supple_core::Arm;
use supple_experiment::WeighingResult;
use supple_experiment::predict_tracking_error;
use supple_ident::weigh::weigh;
use supple_ident::{
    Effects, Fit, Log, Motion, Preparation, Procedure, Validation, fit_with_stribeck,
    identify_motions, read_logs,
};
use supple_model::{Description, with_dof};

/// Fraction of the first log that is held out for validation if no validation log is given.
const HELD_OUT_FRACTION: f64 = 0.2;
/// Default of `--slow` for MCAP logs, which supple writes at a rate that is sufficient to fit the Stribeck effect
/// \[rad/s\].
const SLOW_RAD_PER_S: f64 = 0.15;
/// Number of models drawn from the uncertainty of the fit to predict the tracking error.
const DRAWS: u64 = 5;

/// Number of steps of an identification that are reported as progress.
const STEPS: usize = 4;

/// Output files.
pub const FILES: [&str; 4] = ["arm.urdf", "arm.toml", "report.html", "summary.json"];

/// Runs `supple identify`.
///
/// # Errors
/// [`Failure`].
pub fn run(args: &IdentifyArgs) -> Result<(), Failure> {
    let arm = arms::find(&args.urdf.name(&args.arm), args.strict)?;
    with_dof!(arm.dof(), N => run_with_dof::<N>(&arm, args))?
}

fn procedure(args: &IdentifyArgs, period_s: f64, effects: Effects) -> Procedure {
    let all_mcap = all_mcap(args);
    let by_default = match all_mcap {
        true => EffectsArg::Auto,
        false => EffectsArg::None,
    };
    Procedure {
        effects: match args.effects.unwrap_or(by_default) {
            EffectsArg::Auto => effects,
            EffectsArg::None => Effects::default(),
        },
        identified_joints: (!args.moving.is_empty()).then(|| args.moving.clone()),
        couplings: args.coupling.clone(),
        preparation: Preparation {
            rate_hz: args.rate,
            cutoff_hz: Some(args.cutoff),
            decimation_factor: if all_mcap { 10 } else { 1 },
            // supple's own logs contain commanded torques; a command acts one cycle later and for one cycle, hence
            // the delay of 1.5 periods.
            torque_delay_s: match args.torque_delay {
                Some(TorqueDelay::Seconds(delay_s)) => delay_s,
                Some(TorqueDelay::Estimate) => 0.0,
                None if all_mcap => 1.5 * period_s,
                None => 0.0,
            },
        },
        estimate_delay: match args.torque_delay {
            Some(delay) => delay == TorqueDelay::Estimate,
            None => !all_mcap,
        },
        accept_wrong_logs: args.accept_wrong_logs,
        prior_weight: args.prior_weight,
        method: args.method.into(),
        friction: args.friction.into(),
        slow_rad_per_s: slow_limit_rad_per_s(args).unwrap_or(0.0),
        joint_noise_nm: (!args.noise.is_empty()).then(|| args.noise.clone()),
        ..Procedure::default()
    }
}

/// Whether all logs are MCAP files, the format that supple writes.
fn all_mcap(args: &IdentifyArgs) -> bool {
    let is_mcap = |path: &std::path::PathBuf| {
        path.extension()
            .is_some_and(|extension| extension == "mcap")
    };
    args.logs.iter().chain(&args.weighed).all(is_mcap)
}

/// Returns the speed below which samples of a joint are excluded from the fit and used to fit the Stribeck effect; `None` if no
/// samples are excluded.
fn slow_limit_rad_per_s(args: &IdentifyArgs) -> Option<f64> {
    args.slow
        .or(all_mcap(args).then_some(SLOW_RAD_PER_S))
        .filter(|speed| *speed > 0.0)
}

/// Motions, each with the name of its file.
type NamedMotions = Vec<(String, Motion)>;

fn motions<const N: usize>(
    nominal: &Arm<N>,
    paths: &[std::path::PathBuf],
    moving: &[usize],
    procedure: &Procedure,
    warnings: &mut Vec<supple_ident::Warning>,
) -> Result<NamedMotions, Failure> {
    let mut all = Vec::new();
    for path in paths {
        let logs: Vec<Log> = read_logs::<N>(path)?;
        for log in &logs {
            let (motion, motion_warnings) = procedure.prepare(nominal, log, moving)?;
            warnings.extend(motion_warnings);
            all.push((path.display().to_string(), motion));
        }
    }
    Ok(all)
}

fn run_with_dof<const N: usize>(arm: &Description, args: &IdentifyArgs) -> Result<(), Failure> {
    let staging = Staging::new(&args.out, &FILES)?;
    let nominal = arm.arm::<N>()?;
    let effects = Effects::all(arm.motors().motor_from_joint.clone());
    let procedure = procedure(args, arm.settings().period_s, effects);
    let moving = procedure.identified_joints(N)?;
    let mut warnings = Vec::new();
    let mut steps = Steps::new(STEPS, args.quiet);
    let logs = args.logs.len() + args.validate.len() + args.weighed.len();
    steps.begin(&format!(
        "logs: reading {logs}, checking them against the arm, estimating delays"
    ));
    let mut fitted = motions::<N>(&nominal, &args.logs, &moving, &procedure, &mut warnings)?;
    // The checks are those of an arm without a weight, with torques to scale.
    let unchecked = Procedure {
        accept_wrong_logs: true,
        ..procedure.clone()
    };
    let weighed = motions::<N>(
        &nominal,
        &args.weighed,
        &moving,
        &unchecked,
        &mut Vec::new(),
    )?;
    let mut held_out = motions::<N>(&nominal, &args.validate, &moving, &procedure, &mut warnings)?;
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
    let samples: usize = data.iter().map(Motion::samples).sum();
    steps.begin(&format!(
        "fit: {} joints, {samples} samples; friction columns and weights by cross-validation",
        moving.len()
    ));
    let mut fit: Fit<N> = if slow_limit_rad_per_s(args).is_some() {
        let with_fixed_prior = Procedure {
            prior_weight: procedure.prior_weight.or(Some(1.0)),
            ..procedure.clone()
        };
        fit_with_stribeck(&nominal, &data, &moving, &with_fixed_prior)?
    } else {
        identify_motions(&nominal, &data, &moving, &procedure)?
    };
    fit.warnings.extend(warnings);
    steps.begin(&format!("validation: {} held-out motions", held_out.len()));
    let mut validated: Vec<(String, Motion, Validation)> = Vec::new();
    for (name, motion) in held_out {
        let validation = fit.validate_motion(&motion)?;
        validated.push((name, motion, validation));
    }
    let validations: Vec<Validation> = validated
        .iter()
        .map(|(.., validation)| validation.clone())
        .collect();
    let thresholds = fit.move_collision_nm(&validations, &arm.config::<N>()?);
    let identified = fit
        .description(arm, None)?
        .with_move_collision(&thresholds)?;
    let weighing = match args.weight_kg {
        None => None,
        Some(weight_kg) => {
            let loaded: Vec<Motion> = weighed.into_iter().map(|(_, motion)| motion).collect();
            let found = weigh(&fit, &data, &loaded, weight_kg)?;
            let names = moving.iter().map(|joint| arm.joint_names()[*joint].clone());
            let names: Vec<String> = names.collect();
            Some(WeighingResult::new(weight_kg, &found, &names))
        }
    };
    steps.begin("trial runs: the sinusoid at 5 N/m with models drawn from the fit's uncertainty");
    let input = ReportInput {
        arm: &identified,
        given_friction: arm.friction().to_vec(),
        fit: &fit,
        logs: args
            .logs
            .iter()
            .map(|path| path.display().to_string())
            .collect(),
        held_out: validated,
        predicted_tracking: predict_tracking_error(&identified, &fit, DRAWS)?,
        weighing,
    };
    steps.finish();
    let summary = summary(&input);
    write(&staging, &input, &summary)?;
    staging.publish()?;
    if args.json {
        return print_line(&json(&summary)?);
    }
    print(&summary, &args.out)
}

/// Writes model, report and summary.
///
/// # Errors
/// [`Failure`].
pub fn write<const N: usize>(
    staging: &Staging,
    input: &ReportInput<'_, N>,
    summary: &Summary,
) -> Result<(), Failure> {
    staging.write("arm.urdf", input.arm.urdf().as_bytes())?;
    staging.write("arm.toml", input.arm.toml().as_bytes())?;
    staging.write("report.html", html(input, summary)?.as_bytes())?;
    staging.write("summary.json", format!("{}\n", json(summary)?).as_bytes())
}

/// Prints the summary.
///
/// # Errors
/// [`Failure::File`].
pub fn print(summary: &Summary, out: &Path) -> Result<(), Failure> {
    for line in [
        &summary.verdict,
        &summary.verdict_at_5_n_per_m,
        &summary.trial_runs,
    ] {
        print_line(line)?;
    }
    for friction in &summary.friction {
        print_line(&format!(
            "{}: Coulomb {:.3} N m, viscous {:.3} N m s/rad, breakaway {:.3} N m, offset {:.3} N m",
            friction.joint,
            friction.coulomb_nm,
            friction.viscous_nm_s_per_rad,
            friction.breakaway_nm,
            friction.offset_nm
        ))?;
        let by_direction = [
            (
                friction.viscous_asymmetry_nm_s_per_rad,
                "viscous",
                "N m s/rad",
            ),
            (
                friction.stribeck_offset_nm,
                "excess of the breakaway torque",
                "N m",
            ),
        ];
        for (half, of, unit) in by_direction.iter().filter(|(half, ..)| *half != 0.0) {
            print_line(&format!(
                "{}: half of the difference between the directions, {of}: {half:.3} {unit}",
                friction.joint
            ))?;
        }
    }
    let delays: Vec<String> = summary
        .torque_delay_s
        .iter()
        .map(|delay_s| format!("{:.1} ms", 1e3 * delay_s))
        .collect();
    print_line(&format!(
        "time from a logged torque to its action, by held-out log: {}",
        delays.join(", ")
    ))?;
    print_line(&format!(
        "rank {} of {} columns, condition number {:.1}, residual {:.2} % of the torque",
        summary.rank,
        summary.columns,
        summary.condition,
        100.0 * summary.training_relative
    ))?;
    for line in &summary.held_out {
        print_line(&format!(
            "held out: {}: residual {:.2} %",
            line.log,
            100.0 * line.total_relative
        ))?;
    }
    for line in summary.weighing.iter().flat_map(WeighingResult::lines) {
        print_line(&line)?;
    }
    for warning in &summary.warnings {
        print_line(&format!("warning: {warning}"))?;
    }
    print_line(&format!("model and report: {}", out.display()))
}
