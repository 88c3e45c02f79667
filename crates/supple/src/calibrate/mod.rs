//! `supple calibrate --plant ..`: calibrates the model of a simulated, an emulated or a real arm.
//!
//! The steps are those of [`supple_experiment::procedure`]; this module starts the processes and sends requests to them.

mod report;
mod running_arm;
mod terminal;

use crate::cli::{PlantKind, UpArgs, UpTrajectory};
use crate::operate::arm_of;
use crate::up::Pidfile;
use running_arm::RunningArm;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use supple_bus::Address;
use supple_cli::arguments::{CalibrateArgs, CalibrationPlant, PlantArgs, UrdfArgs};
use supple_cli::arms::{self, DEFAULT_ARM};
use supple_cli::console::{print_status, write_stderr_in_background};
use supple_cli::exit::Failure;
use supple_cli::interrupt;
use supple_core::{Arm, Vector};
use supple_experiment::calibrate::plant_of;
use supple_experiment::procedure::{
    CalibratedArm, InProcessArm, LOGS, ProcedureOptions, calibrate_arm,
};
use supple_experiment::{Calibration, ExperimentError, Mismatch};
use supple_ipc::Domain;
use supple_model::{Description, IdentifiedModel, with_dof};
use supple_plant::PlantOptions;
use supple_plant::options::SETS;
use terminal::Terminal;

/// Name of the file with the options of the simulated arm and their seed.
const PLANT_OPTIONS: &str = "plant.toml";

/// Runs `supple calibrate` with `--plant`.
///
/// # Errors
/// [`Failure`]; the results of finished steps are kept, see `--resume`.
pub fn run(args: &CalibrateArgs, on: CalibrationPlant) -> Result<(), Failure> {
    let domain = Domain::new(args.prefix.as_deref()).map_err(Failure::system)?;
    let name = match on {
        CalibrationPlant::Running => arm_of(&domain, args.arm.as_deref(), &args.urdf),
        _ => args.urdf.name(args.arm.as_deref().unwrap_or(DEFAULT_ARM)),
    };
    let arm = arms::find(&name, args.strict)?;
    let found = with_dof!(arm.dof(), N => sized::<N>(&arm, &name, &domain, args, on))??;
    report::print(&found, &args.out, args.json)
}

fn sized<const N: usize>(
    arm: &Description,
    name: &str,
    domain: &Domain,
    args: &CalibrateArgs,
    on: CalibrationPlant,
) -> Result<CalibratedArm, Failure> {
    let logs = args.out.join(LOGS);
    std::fs::create_dir_all(&logs).map_err(|error| Failure::file("create", &logs, error))?;
    let start = start_model::<N>(arm, args, on)?;
    let options = ProcedureOptions {
        seed: args.seed,
        warm_up_s: args.warm_up,
        candidates: args.candidates,
        resume: args.resume,
        until: args.until,
        ..ProcedureOptions::new(args.out.clone())
    };
    let mut terminal = Terminal {
        yes: args.yes,
        quiet: args.quiet,
    };
    if on == CalibrationPlant::InProcess {
        let calibration = Calibration {
            ripple_nm: args.ripple,
            load: !args.no_load_friction,
            plant: args.plant.options(arm)?,
            ..Calibration::new(args.seed)
        };
        let plant = plant_of::<N>(arm, &calibration)?;
        let notes = calibration.plant.notes();
        let mut arm = InProcessArm::new(plant, arm.home::<N>()?, logs, notes);
        return Ok(calibrate_arm(&mut arm, &start, &options, &mut terminal)?);
    }
    write_stderr_in_background();
    let stop = interrupt::shutdown_on_interrupt();
    if args.virtual_time && on != CalibrationPlant::Emu {
        return Err(Failure::VirtualTimeNeedsEmu);
    }
    let up = up_args(arm, name, args, on)?;
    let starts = on != CalibrationPlant::Running;
    let _pidfile = starts
        .then(|| Pidfile::create(domain, &up.arm))
        .transpose()?;
    let mut running = RunningArm::<N>::new(&up, starts, arm, domain, &args.out, stop)?;
    let result = calibrate_arm(&mut running, &start, &options, &mut terminal);
    let ended = running.end();
    if result.is_err() {
        print_status(&format!(
            "the results of the finished steps are in {}; --resume continues after them",
            args.out.display()
        ));
    }
    let found = result?;
    ended.map(|()| found)
}

/// Returns the arm with every rotor inertia too large or too small by this fraction; the seed determines the signs.
fn with_inertia_error<const N: usize>(
    arm: &Arm<N>,
    fraction: f64,
    seed: u64,
) -> Result<Arm<N>, ExperimentError> {
    let signs = seed.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 32;
    let armature_kg_m2 = Vector::from_fn(|joint, _| {
        let factor = match signs >> joint & 1 {
            1 => 1.0 + fraction,
            _ => 1.0 / (1.0 + fraction),
        };
        arm.armature()[joint] * factor
    });
    let changed = Arm::from_links(
        *arm.links(),
        armature_kg_m2,
        arm.joint_from_tip(),
        arm.gravity(),
    );
    Ok(changed?)
}

/// Returns the model from which the calibration starts: `--model`, or the arm itself, with the errors of `--start-error`.
fn start_model<const N: usize>(
    arm: &Description,
    args: &CalibrateArgs,
    on: CalibrationPlant,
) -> Result<Description, Failure> {
    let model = match &args.model {
        Some(path) => arms::find(&path.display().to_string(), args.strict)?,
        None => arm.clone(),
    };
    let (gravity, friction, inertia) = match args.start_error[..] {
        [] => return Ok(model),
        [gravity, friction] => (gravity, friction, 0.0),
        [gravity, friction, inertia] => (gravity, friction, inertia),
        _ => {
            return Err(Failure::ValueCount {
                option: "--start-error",
                found: args.start_error.len(),
                expected: "2 or 3, GRAVITY,FRICTION[,ROTOR INERTIA]".to_owned(),
            });
        }
    };
    if matches!(on, CalibrationPlant::Can | CalibrationPlant::Running) {
        return Err(Failure::OptionsOfRealArm);
    }
    let seed = args.seed;
    let errors = Mismatch {
        gravity,
        friction,
        seed,
    };
    let changed = errors.apply(&model.config::<N>()?);
    let changed = changed.map_err(ExperimentError::from)?;
    let changed_arm = with_inertia_error(&changed.arm, inertia, seed)?;
    Ok(model.with_model(&IdentifiedModel {
        arm: &changed_arm,
        friction: &changed.friction,
        ripple: None,
        source: "the arm's own model with errors, as a start for a calibration",
    })?)
}

/// Returns the arguments of the system to start. The emulated arm draws the signs and phases of its effects from the seed.
fn up_args(
    arm: &Description,
    name: &str,
    args: &CalibrateArgs,
    on: CalibrationPlant,
) -> Result<UpArgs, Failure> {
    let bus = args.bus.as_deref().map(Address::from_str).transpose();
    Ok(UpArgs {
        plant: match on {
            CalibrationPlant::Emu => PlantKind::Emu,
            CalibrationPlant::Can => PlantKind::Can,
            _ => PlantKind::Sim,
        },
        arm: arms::absolute(name),
        urdf: UrdfArgs::default(),
        strict: args.strict,
        track: UpTrajectory::Sinusoid,
        bus: bus.map_err(Failure::system)?,
        zero_at_home: args.zero_at_home,
        learn: false,
        tare: false,
        block_m: None,
        inject: args.inject.clone(),
        misbehave: Vec::new(),
        plant_options: seeded(arm, args)?,
        trace: None,
        rate_hz: None,
        for_s: None,
        virtual_time: args.virtual_time,
        log: PathBuf::new(),
        no_log: true,
        prefix: args.prefix.clone(),
        view: false,
        budget: false,
        no_realtime: args.no_realtime,
        json: args.json,
    })
}

/// Writes the options of the plant with the seed to a file in the folder of the results.
fn seeded(arm: &Description, args: &CalibrateArgs) -> Result<PlantArgs, Failure> {
    let options = args.plant.options(arm)?;
    let file = args.plant.plant_options.as_deref();
    let named = file.and_then(Path::to_str);
    let set = match args.plant.realistic {
        true => Some(PlantOptions::realistic_name_of(arm)),
        false => named.filter(|name| SETS.contains(name)),
    };
    let Some(set) = set.filter(|_| options.seed.is_none()) else {
        return Ok(PlantArgs {
            plant_options: file.map(absolute),
            ..args.plant.clone()
        });
    };
    let text = format!("{}\nseed = {}\n", PlantOptions::set(set)?, args.seed);
    let file = args.out.join(PLANT_OPTIONS);
    supple_files::write_atomic(&file, text.as_bytes())
        .map_err(|error| Failure::file("write", &file, error))?;
    Ok(PlantArgs {
        plant_options: Some(absolute(&file)),
        realistic: false,
    })
}

/// Returns the absolute path of a file; returns the name of a built-in set unchanged.
fn absolute(file: &Path) -> PathBuf {
    file.canonicalize().unwrap_or_else(|_| file.to_owned())
}
