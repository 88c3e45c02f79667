//! The commands that move an arm as a real one: `calibrate`, `breakaway`, `excite run` and `learn` with `--plant`, and
//! `hold-check`.
//!
//! The steps are those of [`supple_experiment::procedure`]; this module starts the processes and sends requests to them.

pub mod breakaway;
pub mod calibrate;
pub mod excite;
pub mod hold_check;
pub mod learn;
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
use supple_cli::arguments::{CalibrationPlant, MovedArmArgs, PlantArgs, UrdfArgs};
use supple_cli::arms::{self, DEFAULT_ARM};
use supple_cli::console::write_stderr_in_background;
use supple_cli::exit::Failure;
use supple_cli::interrupt;
use supple_core::{Arm, Vector};
use supple_experiment::calibrate::plant_of;
use supple_experiment::procedure::{InProcessArm, LOGS, MotionArm, ProcedureOptions};
use supple_experiment::{Calibration, ExperimentError, Mismatch};
use supple_ipc::Domain;
use supple_model::{Description, IdentifiedModel};
use supple_plant::PlantOptions;
use supple_plant::options::SETS;
use terminal::Terminal;

/// Name of the file with the options of the simulated arm and their seed.
const PLANT_OPTIONS: &str = "plant.toml";

/// The arm that a command moves, and its system.
struct MovedArm<'a> {
    on: CalibrationPlant,
    args: &'a MovedArmArgs,
    plant: &'a PlantArgs,
    strict: bool,
    /// Existing or new folder of the results.
    out: &'a Path,
    seed: u64,
    ripple_nm: f64,
    /// Whether friction of the simulated arm depends on direction and load.
    load_friction: bool,
    json: bool,
    quiet: bool,
    name: String,
    description: Description,
    domain: Domain,
}

/// What a command does with an arm, given its starting model.
trait Work<const N: usize> {
    /// Result.
    type Output;

    /// Moves the arm.
    fn perform<A: MotionArm<N>>(
        self,
        arm: &mut A,
        start: &Description,
        operator: &mut Terminal,
    ) -> Result<Self::Output, A::Error>;
}

/// Returns the domain of the system, the name of the arm and its description.
fn find(
    on: CalibrationPlant,
    args: &MovedArmArgs,
    arm: Option<&str>,
    urdf: &UrdfArgs,
    strict: bool,
) -> Result<(Domain, String, Description), Failure> {
    let domain = Domain::new(args.prefix.as_deref()).map_err(Failure::system)?;
    let name = match on {
        CalibrationPlant::Running => arm_of(&domain, arm, urdf),
        _ => urdf.name(arm.unwrap_or(DEFAULT_ARM)),
    };
    let description = arms::find(&name, strict)?;
    Ok((domain, name, description))
}

impl MovedArm<'_> {
    /// Returns the options of a procedure with this seed and folder.
    fn options(&self) -> ProcedureOptions {
        ProcedureOptions {
            seed: self.seed,
            ..ProcedureOptions::new(self.out.to_owned())
        }
    }

    /// Performs the work in this process, or with a system of processes.
    fn perform<const N: usize, W: Work<N>>(&self, work: W) -> Result<W::Output, Failure> {
        let of_process = self.on != CalibrationPlant::InProcess;
        if of_process && (self.ripple_nm > 0.0 || !self.load_friction) {
            return Err(Failure::EffectsOfInProcess);
        }
        let logs = self.out.join(LOGS);
        std::fs::create_dir_all(&logs).map_err(|error| Failure::file("create", &logs, error))?;
        let (arm, on) = (&self.description, self.on);
        let start = self.start_model::<N>()?;
        let mut terminal = Terminal {
            yes: self.args.yes,
            quiet: self.quiet,
        };
        if on == CalibrationPlant::InProcess {
            let calibration = Calibration {
                ripple_nm: self.ripple_nm,
                load: self.load_friction,
                plant: self.plant.options(arm)?,
                ..Calibration::new(self.seed)
            };
            let plant = plant_of::<N>(arm, &calibration)?;
            let notes = calibration.plant.notes();
            let mut arm = InProcessArm::new(plant, arm.home::<N>()?, logs, notes);
            return Ok(work.perform(&mut arm, &start, &mut terminal)?);
        }
        write_stderr_in_background();
        let stop = interrupt::shutdown_on_interrupt();
        if self.args.virtual_time && on != CalibrationPlant::Emu {
            return Err(Failure::VirtualTimeNeedsEmu);
        }
        let up = self.up_args()?;
        let starts = on != CalibrationPlant::Running;
        let _pidfile = starts
            .then(|| Pidfile::create(&self.domain, &up.arm, false))
            .transpose()?;
        let mut running = RunningArm::<N>::new(&up, starts, arm, &self.domain, self.out, stop)?;
        let result = work.perform(&mut running, &start, &mut terminal);
        let ended = running.end();
        let found = result?;
        ended.map(|()| found)
    }

    /// Returns the model from which the procedure starts: `--model`, or the arm itself, with the errors of `--start-error`.
    fn start_model<const N: usize>(&self) -> Result<Description, Failure> {
        let model = match &self.args.model {
            Some(model) if self.on == CalibrationPlant::Running => {
                let model = model.clone();
                return Err(Failure::ModelOfRunningSystem { model });
            }
            Some(path) => arms::find(&path.display().to_string(), self.strict)?,
            None => self.description.clone(),
        };
        let (gravity, friction, inertia) = match self.args.start_error[..] {
            [] => return Ok(model),
            [gravity, friction] => (gravity, friction, 0.0),
            [gravity, friction, inertia] => (gravity, friction, inertia),
            _ => {
                return Err(Failure::ValueCount {
                    option: "--start-error",
                    found: self.args.start_error.len(),
                    expected: "2 or 3, GRAVITY,FRICTION[,ROTOR INERTIA]".to_owned(),
                });
            }
        };
        if matches!(self.on, CalibrationPlant::Can | CalibrationPlant::Running) {
            return Err(Failure::OptionsOfRealArm);
        }
        let seed = self.seed;
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
    fn up_args(&self) -> Result<UpArgs, Failure> {
        let args = self.args;
        let bus = args.bus.as_deref().map(Address::from_str).transpose();
        Ok(UpArgs {
            plant: match self.on {
                CalibrationPlant::Emu => PlantKind::Emu,
                CalibrationPlant::Can => PlantKind::Can,
                _ => PlantKind::Sim,
            },
            arm: arms::absolute(&self.name),
            urdf: UrdfArgs::default(),
            strict: self.strict,
            track: UpTrajectory::Sinusoid,
            bus: bus.map_err(Failure::system)?,
            zero_at_home: args.zero_at_home,
            learn: false,
            tare: false,
            hold_until_supported: false,
            block_m: None,
            inject: args.inject.clone(),
            misbehave: Vec::new(),
            plant_options: self.seeded()?,
            trace: None,
            rate_hz: None,
            for_s: None,
            virtual_time: args.virtual_time,
            log: None,
            no_log: true,
            prefix: args.prefix.clone(),
            view: false,
            budget: false,
            no_realtime: args.no_realtime,
            json: self.json,
        })
    }

    /// Writes the options of the plant with the seed to a file in the folder of the results.
    fn seeded(&self) -> Result<PlantArgs, Failure> {
        let arm = &self.description;
        let options = self.plant.options(arm)?;
        let file = self.plant.plant_options.as_deref();
        let named = file.and_then(Path::to_str);
        let set = match self.plant.realistic {
            true => Some(PlantOptions::realistic_name_of(arm)),
            false => named.filter(|name| SETS.contains(name)),
        };
        let Some(set) = set.filter(|_| options.seed.is_none()) else {
            return Ok(PlantArgs {
                plant_options: file.map(absolute),
                ..self.plant.clone()
            });
        };
        let text = format!("{}\nseed = {}\n", PlantOptions::set(set)?, self.seed);
        let file = self.out.join(PLANT_OPTIONS);
        supple_files::write_atomic(&file, text.as_bytes())
            .map_err(|error| Failure::file("write", &file, error))?;
        Ok(PlantArgs {
            plant_options: Some(absolute(&file)),
            realistic: false,
        })
    }
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

/// Returns the absolute path of a file; returns the name of a built-in set unchanged.
fn absolute(file: &Path) -> PathBuf {
    file.canonicalize().unwrap_or_else(|_| file.to_owned())
}
