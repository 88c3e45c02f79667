//! `supple hold-check`: how well a model holds an arm.

use super::terminal::Terminal;
use super::{MovedArm, Work, find};
use crate::cli::HoldCheckArgs;
use supple_cli::arguments::CalibrationPlant;
use supple_cli::console::{json, print_line};
use supple_cli::exit::Failure;
use supple_core::Vector;
use supple_core::config::JointGains;
use supple_experiment::procedure::{
    HoldCheck, HoldCheckOptions, MotionArm, ProcedureOptions, check_hold,
};
use supple_model::{Description, with_dof};

/// File of the result.
const SUMMARY: &str = "summary.json";

struct Check<'a> {
    args: &'a HoldCheckArgs,
    options: ProcedureOptions,
}

impl<const N: usize> Work<N> for Check<'_> {
    type Output = HoldCheck;

    fn perform<A: MotionArm<N>>(
        self,
        arm: &mut A,
        start: &Description,
        operator: &mut Terminal,
    ) -> Result<HoldCheck, A::Error> {
        let model = start
            .config::<N>()
            .map_err(supple_experiment::procedure::ProcedureError::from)?;
        let mut gains = model.joint_gains;
        if !self.args.stiffness.is_empty() {
            let stiffness = Vector::from_column_slice(&self.args.stiffness);
            gains = with_stiffness(&gains, stiffness, &model.hold_damping_nm_s_per_rad);
        }
        let check = HoldCheckOptions {
            poses: self.args.poses,
            hold_s: self.args.for_s,
            gains,
        };
        check_hold(arm, start, &check, &self.options, operator)
    }
}

/// Returns gains of this stiffness with the damping ratios of `gains`, and at most the damping of gravity hold, which the loop allows.
fn with_stiffness<const N: usize>(
    gains: &JointGains<N>,
    stiffness_nm_per_rad: Vector<N>,
    hold_damping_nm_s_per_rad: &Vector<N>,
) -> JointGains<N> {
    let damping_nm_s_per_rad = Vector::from_fn(|joint, _| {
        let usual = gains.stiffness_nm_per_rad[joint];
        let factor = if usual > 0.0 {
            (stiffness_nm_per_rad[joint] / usual).sqrt()
        } else {
            1.0
        };
        (gains.damping_nm_s_per_rad[joint] * factor).min(hold_damping_nm_s_per_rad[joint])
    });
    JointGains {
        stiffness_nm_per_rad,
        damping_nm_s_per_rad,
    }
}

/// Runs `supple hold-check`.
///
/// # Errors
/// [`Failure`].
pub fn run(args: &HoldCheckArgs) -> Result<(), Failure> {
    let on = args.moved.on.unwrap_or(CalibrationPlant::InProcess);
    let arm = args.arm.as_deref();
    let (domain, name, description) = find(on, &args.moved, arm, &args.urdf, args.strict)?;
    let joints = description.dof();
    if !args.stiffness.is_empty() && args.stiffness.len() != joints {
        return Err(Failure::ValueCount {
            option: "--stiffness",
            found: args.stiffness.len(),
            expected: format!("{joints}, one for each joint of {name}"),
        });
    }
    let moved = MovedArm {
        on,
        args: &args.moved,
        plant: &args.plant,
        strict: args.strict,
        out: &args.out,
        seed: args.seed,
        ripple_nm: 0.0,
        load_friction: true,
        json: args.json,
        quiet: args.json,
        name,
        description,
        domain,
    };
    let work = Check {
        args,
        options: moved.options(),
    };
    let found = with_dof!(joints, N => moved.perform::<N, _>(work))??;
    let (file, text) = (args.out.join(SUMMARY), json(&found)?);
    supple_files::write_atomic(&file, format!("{text}\n").as_bytes())
        .map_err(|error| Failure::file("write", &file, error))?;
    if args.json {
        return print_line(&text);
    }
    print_line(&in_words(&found))
}

fn in_words(found: &HoldCheck) -> String {
    let mut lines = vec![
        "pose  drift of the tip in gravity hold [mm]  greatest joint error under stiffness [mrad]"
            .to_owned(),
    ];
    for (number, pose) in found.poses.iter().enumerate() {
        let drift = pose.tip_drift_m;
        let drift = drift.map_or("-".to_owned(), |drift_m| format!("{:.1}", 1e3 * drift_m));
        let errors = pose.joint_error_rad.iter().zip(&found.joints);
        let greatest = errors.max_by(|(a, _), (b, _)| a.total_cmp(b));
        let error = greatest.map_or("-".to_owned(), |(error_rad, joint)| {
            format!("{:.1} ({joint})", 1e3 * error_rad)
        });
        let ended = pose.ended.as_deref().unwrap_or_default();
        lines.push(
            format!("{:>4}  {drift:>6}  {error}  {ended}", number + 1)
                .trim_end()
                .to_owned(),
        );
    }
    let worst = found.worst_drift_m().map_or_else(
        || "no pose was held to the end".to_owned(),
        |drift_m| {
            format!(
                "at most {:.1} mm of drift in {:.0} s of gravity hold",
                1e3 * drift_m,
                found.hold_s
            )
        },
    );
    lines.push(format!(
        "{}: {worst}; {} poses not held to the end",
        found.arm,
        found.ended()
    ));
    if let Some(errors) = found.worst_error_rad() {
        let of_joint = |joint: usize| {
            format!(
                "{} {:.1} mrad at {:.3} N m/rad",
                found.joints[joint],
                1e3 * errors[joint],
                found.stiffness_nm_per_rad[joint]
            )
        };
        let errors: Vec<String> = (0..found.joints.len()).map(of_joint).collect();
        lines.push(format!("held under stiffness: {}", errors.join(", ")));
    }
    lines.join("\n")
}
