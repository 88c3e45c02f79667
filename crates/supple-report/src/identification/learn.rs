//! `supple learn`: refits friction and payload from logs of a repeated motion.

use serde::Serialize;
use supple_cli::arguments::LearnArgs;
use supple_cli::arms;
use supple_cli::console::{print_json, print_line};
use supple_cli::exit::Failure;
use supple_experiment::calibrate::preparation;
use supple_ident::{Learned, Learning, Log, Motion, learn, read_logs};
use supple_model::{Description, with_dof};

/// Cutoff frequency of the filter \[Hz\].
const CUTOFF_HZ: f64 = 8.0;
/// Range of motion below which a joint counts as not moving \[rad\].
const MOVED_RAD: f64 = 0.02;

#[derive(Serialize)]
struct Joint<'a> {
    joint: &'a str,
    viscous_nm_s_per_rad: [f64; 2],
    coulomb_nm: [f64; 2],
    error_nm: [f64; 2],
}

#[derive(Serialize)]
struct Summary<'a> {
    joints: Vec<Joint<'a>>,
    payload_kg: Option<f64>,
}

/// Runs `supple learn`.
///
/// # Errors
/// [`Failure`].
pub fn run(args: &LearnArgs) -> Result<(), Failure> {
    if args.moved.on.is_some() {
        return Err(Failure::NeedsSupple { option: "--plant" });
    }
    if args.plant.realistic || args.plant.plant_options.is_some() {
        return Err(Failure::EffectsWithoutArm);
    }
    let arm = arms::find(&args.urdf.name(&args.arm), args.strict)?;
    with_dof!(arm.dof(), N => run_with_dof::<N>(&arm, args))?
}

fn run_with_dof<const N: usize>(arm: &Description, args: &LearnArgs) -> Result<(), Failure> {
    let config = arm.config::<N>()?;
    let mut logs = Vec::new();
    for path in &args.logs {
        logs.extend(read_logs::<N>(path)?);
    }
    let logs: Vec<Log> = logs.into_iter().map(|log| end_of(log, args.last)).collect();
    let moving: Vec<usize> = (0..N)
        .filter(|j| {
            logs.iter().any(|log| {
                let q = log.q_rad.column(*j);
                q.max() - q.min() > MOVED_RAD
            })
        })
        .collect();
    let prepare = preparation(config.period_s, CUTOFF_HZ);
    let motions = logs
        .iter()
        .map(|log| Motion::prepare(log, N, &moving, &prepare).map(|(motion, _)| motion))
        .collect::<Result<Vec<_>, _>>()?;
    let learning = Learning {
        payload_kg: args.payload,
        ..Learning::default()
    };
    let learnt = learn(&config, &motions, &moving, &learning)?;
    let described = learnt.description(arm)?;
    described.save(&args.out)?;
    let summary = summary(arm, &config.friction, &learnt);
    if args.json {
        return print_json(&summary);
    }
    for joint in &summary.joints {
        print_line(&format!(
            "{:10} viscous {:.3} -> {:.3} N m s/rad, Coulomb {:.3} -> {:.3} N m, torque error {:.4} -> {:.4} N m",
            joint.joint,
            joint.viscous_nm_s_per_rad[0],
            joint.viscous_nm_s_per_rad[1],
            joint.coulomb_nm[0],
            joint.coulomb_nm[1],
            joint.error_nm[0],
            joint.error_nm[1],
        ))?;
    }
    if let Some(payload_kg) = summary.payload_kg {
        print_line(&format!("payload    {payload_kg:.3} kg"))?;
    }
    print_line(&format!("model: {}", args.out.display()))
}

/// Returns the last `seconds` of a log, or the whole log.
fn end_of(log: Log, seconds: Option<f64>) -> Log {
    let (Some(seconds), Some(end)) = (seconds, log.t_s.last().copied()) else {
        return log;
    };
    let first = log.t_s.iter().position(|t| end - t <= seconds).unwrap_or(0);
    let rows = log.t_s.len() - first;
    Log {
        t_s: log.t_s[first..].to_vec(),
        q_rad: log.q_rad.rows(first, rows).into_owned(),
        qd_rad_per_s: log.qd_rad_per_s.map(|qd| qd.rows(first, rows).into_owned()),
        tau_nm: log.tau_nm.rows(first, rows).into_owned(),
    }
}

fn summary<'a, const N: usize>(
    arm: &'a Description,
    before: &[supple_core::Friction; N],
    learnt: &Learned<N>,
) -> Summary<'a> {
    let joints = (0..N).map(|j| {
        let (old, new) = (&before[j], &learnt.friction[j]);
        Joint {
            joint: &arm.joint_names()[j],
            viscous_nm_s_per_rad: [old.viscous_nm_s_per_rad, new.viscous_nm_s_per_rad],
            coulomb_nm: [old.coulomb_nm, new.coulomb_nm],
            error_nm: [learnt.before_nm[j], learnt.after_nm[j]],
        }
    });
    Summary {
        joints: joints.collect(),
        payload_kg: learnt.payload.map(|payload| payload[0]),
    }
}
