//! Processes of a system and their command-line arguments.

use super::outputs;
use crate::cli::{PlantKind, UpArgs, UpTrajectory};
use crate::operate::pendant::Pendant;
use core::time::Duration;
use std::path::PathBuf;
use supple_bus::Address;
use supple_cli::arguments::{PlantArgs, UrdfArgs};
use supple_cli::exit::Failure;
use supple_ipc::Domain;
use supple_model::{Description, ModelError};
use supple_plant::{Grip, Injection};

/// Program name of the controller.
pub const CONTROLLER: &str = "supple-rt";
/// Default bus of a real arm.
const INTERFACE: &str = "can0";
/// Numbers of joints of a WAM, whose drives need no `[bus]`.
const WAM_JOINTS: [usize; 2] = [4, 7];

/// A program with its arguments.
#[derive(Clone, Debug)]
pub struct Program {
    /// Name of the program.
    pub name: &'static str,
    /// Command-line arguments.
    pub arguments: Vec<String>,
}

/// The processes of a system.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The controller process.
    pub controller: Program,
    /// The process that owns the clock: the simulated arm, or the arm's bus.
    pub clock_owner: Program,
    /// The emulated arm on the bus.
    pub arm: Option<Program>,
    /// Pendant of the emulated arm.
    pub pendant: Option<Pendant>,
    /// Whether the arm has no brakes, so that the clock owner lays it down before it exits.
    pub lays_down: bool,
    /// Whether the clock owner holds the arm at the end until the operator declares that it is supported.
    pub holds_until_supported: bool,
}

/// Time after which the shutdown kills a process.
pub const SHUTDOWN_TIMEOUT: Duration = Duration::from_secs(5);
/// Time after which the shutdown kills a clock owner that first lays an arm down.
const LAY_DOWN_TIMEOUT: Duration = Duration::from_secs(70);

impl Plan {
    /// Time after which the shutdown kills the clock owner.
    pub fn clock_owner_timeout(&self) -> Duration {
        match self.lays_down {
            _ if self.holds_until_supported => Duration::MAX,
            true => LAY_DOWN_TIMEOUT,
            false => SHUTDOWN_TIMEOUT,
        }
    }

    /// Whether the drives are activated on a pendant, of an emulated or a real arm.
    pub fn has_pendant(&self, plant: PlantKind) -> bool {
        self.pendant.is_some() || plant == PlantKind::Can && !self.lays_down
    }

    /// Plans the processes; in virtual time the clock owner exits after `cycles`.
    ///
    /// # Errors
    /// Options that this plant does not support: [`Failure::Injection`], [`Failure::InjectionIntoRealArm`],
    /// [`Failure::MisbehaviourWithoutMotors`], [`Failure::OptionsOfRealArm`], [`Failure::NoBus`], [`Failure::HandNeedsMode`],
    /// [`Failure::NoDrivesForArm`], [`Failure::ArmHasBrakes`], [`Failure::VirtualTimeOnRealBus`]; [`Failure::System`] if the folder of an emulated bus does not belong to this user.
    pub fn new(
        args: &UpArgs,
        description: &Description,
        domain: &Domain,
        cycles: Option<u64>,
    ) -> Result<Plan, Failure> {
        args.check_injections()?;
        args.check_drives(description)?;
        let emulates_motors_on_bus = args.plant == PlantKind::Emu && description.bus().is_some();
        if !args.misbehave.is_empty() && !emulates_motors_on_bus {
            return Err(Failure::MisbehaviourWithoutMotors);
        }
        args.check_plant_options(description)?;
        args.check_bus_options()?;
        let falls = args.plant != PlantKind::Sim && description.falls_without_torque();
        if args.hold_until_supported && !falls {
            return Err(Failure::ArmHasBrakes {
                arm: description.name().to_owned(),
            });
        }
        let controller = Program {
            name: CONTROLLER,
            arguments: args.timed_arguments(domain),
        };
        let mut clock_owner = Program {
            name: args.plant.clock_owner(),
            arguments: args.timed_arguments(domain),
        };
        if let (Some(cycles), true) = (cycles, args.virtual_time) {
            clock_owner
                .arguments
                .extend(["--cycles".to_owned(), cycles.to_string()]);
        }
        let bus = match (args.plant, &args.bus) {
            (PlantKind::Sim, _) => None,
            (_, Some(bus)) => Some(bus.clone()),
            (PlantKind::Emu, None) => {
                Some(Address::of_system(domain.prefix()).map_err(Failure::system)?)
            }
            (PlantKind::Can, None) => Some(Address::Interface(INTERFACE.to_owned())),
        };
        if args.virtual_time && matches!(bus, Some(Address::Interface(_))) {
            return Err(Failure::VirtualTimeOnRealBus);
        }
        if args.plant == PlantKind::Sim {
            clock_owner.arguments.extend(args.simulation_arguments());
        }
        let mut plan = Plan {
            controller,
            clock_owner,
            arm: None,
            pendant: None,
            lays_down: falls,
            holds_until_supported: args.hold_until_supported,
        };
        if let Some(bus) = bus {
            let emulated = args.plant == PlantKind::Emu;
            let clock_owner_arguments = &mut plan.clock_owner.arguments;
            clock_owner_arguments.extend(["--bus".to_owned(), bus.to_string()]);
            for (flag, given) in [
                ("--zero-at-home", emulated || args.zero_at_home),
                ("--tare", args.tare),
                ("--hold-until-supported", args.hold_until_supported),
            ] {
                clock_owner_arguments.extend(given.then(|| flag.to_owned()));
            }
            if emulated {
                let mut arguments = args.common_arguments(domain);
                arguments.extend(["--bus".to_owned(), bus.to_string()]);
                arguments.extend(args.simulation_arguments());
                for misbehaviour in &args.misbehave {
                    arguments.extend(["--misbehave".to_owned(), misbehaviour.clone()]);
                }
                plan.arm = Some(Program {
                    name: "supple-emu",
                    arguments,
                });
                // Only arms with brakes have a pendant.
                plan.pendant = match bus {
                    _ if plan.lays_down => None,
                    Address::Folder(_) => Pendant::of(&bus),
                    Address::Interface(_) => {
                        Pendant::of(&Address::of_system(domain.prefix()).map_err(Failure::system)?)
                    }
                };
            }
        }
        Ok(plan)
    }
}

impl PlantKind {
    /// Program that owns the clock.
    pub(super) fn clock_owner(self) -> &'static str {
        match self {
            PlantKind::Sim => "supple-sim",
            PlantKind::Emu | PlantKind::Can => "supple-can",
        }
    }
}

impl UpArgs {
    /// Returns the defaults of the command line, except that there is no log and no page, and the output is JSON.
    pub fn with_defaults(plant: PlantKind, arm: String) -> UpArgs {
        UpArgs {
            urdf: UrdfArgs::default(),
            plant,
            arm,
            strict: false,
            track: UpTrajectory::Sinusoid,
            bus: None,
            budget: false,
            zero_at_home: false,
            learn: false,
            tare: false,
            block_m: None,
            inject: Vec::new(),
            misbehave: Vec::new(),
            plant_options: PlantArgs::default(),
            trace: None,
            hold_until_supported: false,
            rate_hz: None,
            for_s: None,
            virtual_time: false,
            log: None,
            no_log: true,
            view: false,
            prefix: None,
            no_realtime: false,
            json: true,
        }
    }

    /// Whether a stall of this machine looks like a fault of the arm: of an arm that this machine simulates by the wall clock.
    pub(super) fn stalls_matter(&self) -> bool {
        !self.virtual_time && self.plant != PlantKind::Can
    }

    /// Path of the log; `None` without a log.
    pub fn log_file(&self) -> Option<PathBuf> {
        let default = || PathBuf::from(outputs::DEFAULT_LOG);
        (!self.no_log).then(|| self.log.clone().unwrap_or_else(default))
    }

    /// Returns the arm at the requested rate.
    ///
    /// # Errors
    /// The same as those of [`Description::at_rate`].
    pub fn at_rate(&self, description: Description) -> Result<Description, ModelError> {
        match self.rate_hz {
            Some(rate_hz) => description.at_rate(f64::from(rate_hz)),
            None => Ok(description),
        }
    }

    /// Returns the command-line arguments that start the same system in real time. Options that test cases do not use are omitted:
    /// bus, home pose, tare, duration and page.
    pub fn to_arguments(&self) -> Vec<String> {
        let mut arguments = vec!["up", "--json", "--arm", &self.arm, "--plant"];
        arguments.push(match self.plant {
            PlantKind::Sim => "sim",
            PlantKind::Emu => "emu",
            PlantKind::Can => "can",
        });
        arguments.push("--track");
        arguments.push(match self.track {
            UpTrajectory::Sinusoid => "sinusoid",
            UpTrajectory::Arc => "arc",
            UpTrajectory::Quadrant => "quadrant",
            UpTrajectory::Probe => "probe",
        });
        arguments.extend(self.no_realtime.then_some("--no-realtime"));
        arguments.extend(self.strict.then_some("--strict"));
        arguments.extend(self.learn.then_some("--learn"));
        let mut arguments: Vec<String> = arguments.into_iter().map(str::to_owned).collect();
        match self.log_file() {
            Some(file) => arguments.extend(["--log".to_owned(), file.display().to_string()]),
            None => arguments.push("--no-log".to_owned()),
        }
        if let Some(prefix) = &self.prefix {
            arguments.extend(["--prefix".to_owned(), prefix.clone()]);
        }
        if let Some(rate_hz) = self.rate_hz {
            arguments.extend(["--rate-hz".to_owned(), rate_hz.to_string()]);
        }
        arguments.extend(self.simulation_arguments());
        for misbehaviour in &self.misbehave {
            arguments.extend(["--misbehave".to_owned(), misbehaviour.clone()]);
        }
        arguments
    }

    /// Arguments of a simulated plant: block, injected faults, plant options and trace file.
    fn simulation_arguments(&self) -> Vec<String> {
        let mut arguments = Vec::new();
        if let Some(face_m) = self.block_m {
            arguments.extend(["--block-m".to_owned(), face_m.to_string()]);
        }
        if let Some(file) = &self.trace {
            arguments.extend(["--trace".to_owned(), file.display().to_string()]);
        }
        arguments.extend(self.plant_options.to_arguments());
        for injection in &self.inject {
            arguments.extend(["--inject".to_owned(), injection.to_string()]);
        }
        arguments
    }

    /// Fails if the plant is on a bus and has no drives for the arm.
    fn check_drives(&self, description: &Description) -> Result<(), Failure> {
        let plant = match self.plant {
            PlantKind::Sim => return Ok(()),
            PlantKind::Emu => "emu",
            PlantKind::Can => "can",
        };
        let joints = description.dof();
        let is_wam = WAM_JOINTS.contains(&joints) && description.describes_motors();
        match description.bus() {
            None if !is_wam => Err(Failure::NoDrivesForArm {
                plant,
                arm: description.name().to_owned(),
                joints,
            }),
            _ => Ok(()),
        }
    }

    fn check_injections(&self) -> Result<(), Failure> {
        match self.plant {
            PlantKind::Sim => Ok(()),
            PlantKind::Emu => Ok(self
                .inject
                .iter()
                .try_for_each(Injection::check_bus_support)?),
            PlantKind::Can if self.inject.is_empty() => Ok(()),
            PlantKind::Can => Err(Failure::InjectionIntoRealArm),
        }
    }

    /// Checks the options of the simulated arm before any process starts.
    fn check_plant_options(&self, description: &Description) -> Result<(), Failure> {
        let given = !self.plant_options.to_arguments().is_empty()
            || self.block_m.is_some()
            || self.trace.is_some();
        match self.plant {
            PlantKind::Can if given => Err(Failure::OptionsOfRealArm),
            plant => {
                let hand = self.plant_options.options(description)?.hand;
                match hand {
                    // An emulated arm does not know the mode of the controller, so that a hand cannot grip it only in float.
                    Some(hand) if plant == PlantKind::Emu && hand.when == Grip::Float => {
                        Err(Failure::HandNeedsMode)
                    }
                    _ => Ok(()),
                }
            }
        }
    }

    /// Fails if a bus option, which would have no effect, is given for an arm without a bus.
    fn check_bus_options(&self) -> Result<(), Failure> {
        let options = [
            ("--bus", self.bus.is_some()),
            ("--zero-at-home", self.zero_at_home),
            ("--tare", self.tare),
        ];
        match options.into_iter().find(|(_, given)| *given) {
            Some((option, _)) if self.plant == PlantKind::Sim => Err(Failure::NoBus { option }),
            _ => Ok(()),
        }
    }

    /// Arguments common to all processes.
    fn common_arguments(&self, domain: &Domain) -> Vec<String> {
        let mut arguments = vec![
            "--arm".to_owned(),
            self.arm.clone(),
            "--prefix".to_owned(),
            domain.prefix().to_owned(),
            "--supervised".to_owned(),
        ];
        if self.virtual_time {
            arguments.push("--virtual-time".to_owned());
        }
        if self.strict {
            arguments.push("--strict".to_owned());
        }
        if self.no_realtime {
            arguments.push("--no-realtime".to_owned());
        }
        arguments
    }

    /// Arguments common to the periodic processes.
    fn timed_arguments(&self, domain: &Domain) -> Vec<String> {
        let mut arguments = self.common_arguments(domain);
        if let Some(rate_hz) = self.rate_hz {
            arguments.extend(["--rate-hz".to_owned(), rate_hz.to_string()]);
        }
        arguments
    }
}
