//! `supple learn --plant ..`: an arm tracks the sinusoid at 5 N/m; the model is refitted to the log.

use super::terminal::Terminal;
use super::{MovedArm, Work, find};
use std::os::unix::process::CommandExt;
use std::process::Command;
use supple_cli::arguments::{CalibrationPlant, LearnArgs};
use supple_cli::exit::Failure;
use supple_cli::sibling::{REPORT, program_beside};
use supple_experiment::procedure::{self, MotionArm, ProcedureOptions, track_arm};
use supple_model::{Description, with_dof};

/// Folder of the model that the controller used, in the folder of the results.
const START: &str = "start";

struct Track {
    duration_s: f64,
    options: ProcedureOptions,
}

impl<const N: usize> Work<N> for Track {
    type Output = (procedure::SingleMotion, Description);

    fn perform<A: MotionArm<N>>(
        self,
        arm: &mut A,
        start: &Description,
        operator: &mut Terminal,
    ) -> Result<Self::Output, A::Error> {
        let motion = track_arm(arm, start, self.duration_s, &self.options, operator)?;
        Ok((motion, start.clone()))
    }
}

/// Runs `supple learn` with `--plant`: the process replaces itself with `supple-report`, which refits the model to the log. Returns only
/// if the arm or this fails.
///
/// # Errors
/// [`Failure`].
pub fn run(args: &LearnArgs, on: CalibrationPlant) -> Result<(), Failure> {
    let arm = Some(args.arm.as_str());
    let (domain, name, description) = find(on, &args.moved, arm, &args.urdf, args.strict)?;
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
    let work = Track {
        duration_s: args.for_s,
        options: moved.options(),
    };
    let (found, start) = with_dof!(moved.description.dof(), N => moved.perform::<N, _>(work))??;
    let model = args.out.join(START);
    start.save(&model)?;
    let program = program_beside(REPORT)?;
    let mut command = Command::new(&program);
    command.arg("learn").arg(&found.log);
    command.arg("--arm").arg(model.join("arm.toml"));
    command.arg("--out").arg(&args.out);
    if let Some(last_s) = args.last {
        command.arg("--last").arg(last_s.to_string());
    }
    if let Some(kg) = args.payload {
        command.arg("--payload").arg(kg.to_string());
    }
    if args.json {
        command.arg("--json");
    }
    Err(Failure::file("start", &program, command.exec()))
}
