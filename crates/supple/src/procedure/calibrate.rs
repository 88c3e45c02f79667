//! `supple calibrate --plant ..`: calibrates the model of a simulated, an emulated or a real arm.

use super::terminal::Terminal;
use super::{MovedArm, Work, find, report};
use supple_cli::arguments::{CalibrateArgs, CalibrationPlant};
use supple_cli::console::print_status;
use supple_cli::exit::Failure;
use supple_experiment::procedure::{
    self, CalibratedArm, MotionArm, ProcedureOptions, calibrate_arm,
};
use supple_model::{Description, with_dof};

/// All steps of a calibration, or those up to a given one.
pub(super) struct Calibrate {
    pub(super) options: ProcedureOptions,
}

impl<const N: usize> Work<N> for Calibrate {
    type Output = CalibratedArm;

    fn perform<A: MotionArm<N>>(
        self,
        arm: &mut A,
        start: &Description,
        operator: &mut Terminal,
    ) -> Result<CalibratedArm, A::Error> {
        calibrate_arm(arm, start, &self.options, operator)
    }
}

/// Runs `supple calibrate` with `--plant`.
///
/// # Errors
/// [`Failure`]; the results of finished steps are kept, see `--resume`.
pub fn run(args: &CalibrateArgs, on: CalibrationPlant) -> Result<(), Failure> {
    let arm = args.arm.as_deref();
    let (domain, name, description) = find(on, &args.moved, arm, &args.urdf, args.strict)?;
    let moved = MovedArm {
        on,
        args: &args.moved,
        plant: &args.plant,
        strict: args.strict,
        out: &args.out,
        seed: args.seed,
        ripple_nm: args.ripple,
        load_friction: !args.no_load_friction,
        json: args.json,
        quiet: args.quiet,
        name,
        description,
        domain,
    };
    let options = ProcedureOptions {
        warm_up_s: args.warm_up,
        ripple_runs: args.ripple_runs,
        weight_kg: args.weight_kg,
        candidates: args.candidates,
        resume: args.resume,
        until: args.until,
        ..moved.options()
    };
    let work = Calibrate { options };
    let found = with_dof!(moved.description.dof(), N => moved.perform::<N, _>(work))?;
    if found.is_err() && args.out.join(procedure::FILE).exists() {
        print_status(&format!(
            "the results of the finished steps are in {}; --resume continues after them",
            args.out.display()
        ));
    }
    report::print(&found?, &args.out, args.json)
}
