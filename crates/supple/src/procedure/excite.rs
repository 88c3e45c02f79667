//! `supple excite run --plant ..`: moves an arm along a designed excitation and logs it.

use super::terminal::Terminal;
use super::{MovedArm, Work, find};
use supple_cli::arguments::{CalibrationPlant, RunArgs};
use supple_cli::console::{json, print_line};
use supple_cli::excitation_design::ExcitationDesign;
use supple_cli::exit::Failure;
use supple_core::trajectory::Fourier;
use supple_experiment::procedure::{self, MotionArm, ProcedureOptions, excite_arm};
use supple_model::{Description, with_dof};

struct Excite<const N: usize> {
    series: Vec<Fourier<N>>,
    options: ProcedureOptions,
}

impl<const N: usize> Work<N> for Excite<N> {
    type Output = procedure::SingleMotion;

    fn perform<A: MotionArm<N>>(
        self,
        arm: &mut A,
        start: &Description,
        operator: &mut Terminal,
    ) -> Result<procedure::SingleMotion, A::Error> {
        excite_arm(arm, start, &self.series, &self.options, operator)
    }
}

/// Runs `supple excite run` with `--plant`.
///
/// # Errors
/// [`Failure`].
pub fn run(args: &RunArgs, on: CalibrationPlant) -> Result<(), Failure> {
    let arm = Some(args.arm.as_str());
    let (domain, name, description) = find(on, &args.moved, arm, &args.urdf, args.strict)?;
    let design = ExcitationDesign::read(&args.design)?;
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
        quiet: args.json,
        name,
        description,
        domain,
    };
    let found = with_dof!(moved.description.dof(), N => {
        let work = Excite::<N> {
            series: design.series_for::<N>(&moved.description, !args.no_slow)?,
            options: moved.options(),
        };
        moved.perform::<N, _>(work)
    })??;
    let (file, text) = (args.out.join("summary.json"), json(&found)?);
    supple_files::write_atomic(&file, format!("{text}\n").as_bytes())
        .map_err(|error| Failure::file("write", &file, error))?;
    if args.json {
        return print_line(&text);
    }
    print_line(&format!(
        "{}: {:.1} minutes of motion; {}",
        found.arm,
        found.moved_s / 60.0,
        found.log.display()
    ))
}
