//! `supple excite design`: designs an excitation trajectory; writes table, figure and summary.

use super::requested_joints::requested_joints;
use crate::figures::identification::{Curves, curves};
use serde::Serialize;
use std::fmt::Write;
use supple_cli::arguments::{Criterion, DesignArgs};
use supple_cli::arms;
use supple_cli::console::{json, print_line, print_status};
use supple_cli::exit::Failure;
use supple_cli::out::Staging;
use supple_core::trajectory::Fourier;
use supple_ident::FourierCoefficients;
use supple_ident::excitation_design::{self, DesignOptions, ExcitationDesign, Workspace, design};
use supple_model::{Description, with_dof};

/// Number of rows of the table per second \[Hz\].
const TABLE_HZ: f64 = 100.0;

#[derive(Serialize)]
struct Summary<'a> {
    arm: &'a str,
    moving: Vec<usize>,
    criterion: &'static str,
    rank: usize,
    condition: f64,
    /// Value of the criterion for the first candidate that meets the limits.
    first_value: f64,
    /// Value of the criterion for the result.
    last_value: f64,
    #[serde(flatten)]
    series: FourierCoefficients,
}

/// Runs `supple excite design`.
///
/// # Errors
/// [`Failure`].
pub fn run(args: &DesignArgs) -> Result<(), Failure> {
    let arm = arms::find(&args.urdf.name(&args.arm), args.strict)?;
    let moving = requested_joints(&args.moving, arm.dof())?;
    let workspace = match args.workspace[..] {
        [a, b, c, d, e, f] => Some(Workspace {
            lower_m: [a, b, c],
            upper_m: [d, e, f],
        }),
        [] => None,
        _ => {
            return Err(Failure::ValueCount {
                option: "--workspace",
                found: args.workspace.len(),
                expected: "6: minimum x, y, z, maximum x, y, z".to_owned(),
            });
        }
    };
    let options = DesignOptions {
        period_s: args.period,
        periods: args.periods,
        criterion: match args.criterion {
            Criterion::Condition => excitation_design::Criterion::Condition,
            Criterion::DOptimality => excitation_design::Criterion::DOptimality,
        },
        workspace,
        candidates: args.candidates,
        seed: args.seed,
        ..DesignOptions::new(&moving)
    };
    with_dof!(arm.dof(), N => run_with_dof::<N>(&arm, &options, args))?
}

fn run_with_dof<const N: usize>(
    arm: &Description,
    options: &DesignOptions,
    args: &DesignArgs,
) -> Result<(), Failure> {
    let staging = Staging::new(
        &args.out,
        &["excitation.csv", "excitation.svg", "summary.json"],
    )?;
    let (config, home) = (arm.config::<N>()?, arm.home::<N>()?);
    let progress_interval = (options.candidates / 10).max(1);
    let found = design(&config, &home, options, &mut |tried, best| {
        if !args.quiet && tried % progress_interval == 0 {
            print_status(&format!(
                "{tried} of {} candidates: {best:.4}",
                options.candidates
            ));
        }
    })?;
    staging.write("excitation.csv", table(&found.series).as_bytes())?;
    staging.write("excitation.svg", figure(arm, &found)?.as_bytes())?;
    let series = &found.series;
    let summary = Summary {
        arm: arm.name(),
        moving: options.excited_joints.clone(),
        criterion: match options.criterion {
            excitation_design::Criterion::Condition => "condition",
            excitation_design::Criterion::DOptimality => "d-optimality",
        },
        rank: found.rank,
        condition: found.condition,
        first_value: found
            .history
            .iter()
            .copied()
            .find(|value| value.is_finite())
            .unwrap_or(f64::MAX),
        last_value: found.history.last().copied().unwrap_or(f64::MAX),
        series: FourierCoefficients::from(series),
    };
    let text = json(&summary)?;
    staging.write("summary.json", format!("{text}\n").as_bytes())?;
    staging.publish()?;
    if args.json {
        return print_line(&text);
    }
    print_line(&format!(
        "{}: {:.1} s, rank {}, condition number {:.1}; {}",
        arm.name(),
        series.duration_s,
        found.rank,
        found.condition,
        args.out.display()
    ))
}

fn table<const N: usize>(series: &Fourier<N>) -> String {
    let mut text = String::from("t");
    for name in ["q", "qd", "qdd"] {
        for j in 0..N {
            let _ = write!(text, ",{name}[{j}]");
        }
    }
    text.push('\n');
    let count = (series.duration_s * TABLE_HZ).floor() as usize;
    for i in 0..=count {
        let t = i as f64 / TABLE_HZ;
        let at = series.at(t);
        let _ = write!(text, "{t}");
        let all = [
            at.position_rad,
            at.velocity_rad_per_s,
            at.acceleration_rad_per_s2,
        ];
        for value in all.iter().flat_map(|v| v.iter()) {
            let _ = write!(text, ",{value:.9}");
        }
        text.push('\n');
    }
    text
}

fn figure<const N: usize>(
    arm: &Description,
    found: &ExcitationDesign<N>,
) -> Result<String, Failure> {
    let times: Vec<f64> = (0..600)
        .map(|i| found.series.duration_s * f64::from(i) / 599.0)
        .collect();
    let panels: Vec<Curves> = (0..N)
        .map(|j| Curves {
            title: arm.joint_names()[j].clone(),
            unit: "rad, rad/s",
            first: (
                "angle",
                times
                    .iter()
                    .map(|t| (*t, found.series.at(*t).position_rad[j]))
                    .collect(),
            ),
            second: (
                "speed",
                times
                    .iter()
                    .map(|t| (*t, found.series.at(*t).velocity_rad_per_s[j]))
                    .collect(),
            ),
        })
        .collect();
    Ok(curves(
        "Angle and speed of each joint of the excitation",
        "time [s]",
        &panels,
    )?)
}
