//! Which processes a system has, and what each is told.

use crate::cli::{Course, PlantKind, UpArgs};
use crate::exit::Failure;
use crate::operate::Pendant;
use std::path::PathBuf;
use supple_bus::Address;
use supple_ipc::Domain;
use supple_model::{Description, ModelError};
use supple_plant::Injection;

/// The controller.
pub const CONTROLLER: &str = "supple-rt";
/// The bus of a real arm where none is given.
const INTERFACE: &str = "can0";

/// A program with its arguments.
#[derive(Clone, Debug)]
pub struct Program {
    /// Its name.
    pub name: &'static str,
    /// What it is told.
    pub arguments: Vec<String>,
}

/// The processes of a system.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The controller.
    pub controller: Program,
    /// The one that owns the clock: the simulated arm, or the arm's bus.
    pub clock: Program,
    /// The emulated arm on the bus.
    pub arm: Option<Program>,
    /// Its pendant.
    pub pendant: Option<Pendant>,
}

impl Plan {
    /// For these arguments; in virtual time the clock ends after `cycles`.
    ///
    /// # Errors
    /// [`Failure::Injection`]: what this plant cannot do; [`Failure::Bus`] where the folder of an emulated bus is not this user's; [`Failure::RealClock`].
    pub fn new(args: &UpArgs, domain: &Domain, cycles: Option<u64>) -> Result<Plan, Failure> {
        args.check_injections()?;
        let controller = Program {
            name: CONTROLLER,
            arguments: args.timed_arguments(domain),
        };
        let mut clock = Program {
            name: args.plant.clock(),
            arguments: args.timed_arguments(domain),
        };
        if let (Some(cycles), true) = (cycles, args.virtual_time) {
            clock
                .arguments
                .extend(["--cycles".to_owned(), cycles.to_string()]);
        }
        let bus = match (args.plant, &args.bus) {
            (PlantKind::Sim, _) => None,
            (_, Some(bus)) => Some(bus.clone()),
            (PlantKind::Emu, None) => Some(Address::of_system(domain.prefix())?),
            (PlantKind::Can, None) => Some(Address::Interface(INTERFACE.to_owned())),
        };
        if args.virtual_time && matches!(bus, Some(Address::Interface(_))) {
            return Err(Failure::RealClock);
        }
        if args.plant == PlantKind::Sim {
            clock.arguments.extend(args.surroundings());
        }
        let mut plan = Plan {
            controller,
            clock,
            arm: None,
            pendant: None,
        };
        if let Some(bus) = bus {
            let emulated = args.plant == PlantKind::Emu;
            let of_bus = &mut plan.clock.arguments;
            of_bus.extend(["--bus".to_owned(), bus.to_string()]);
            for (flag, given) in [
                ("--zero-at-home", emulated || args.zero_at_home),
                ("--tare", args.tare),
            ] {
                of_bus.extend(given.then(|| flag.to_owned()));
            }
            if emulated {
                let mut arguments = args.common_arguments(domain);
                arguments.extend(["--bus".to_owned(), bus.to_string()]);
                arguments.extend(args.surroundings());
                plan.arm = Some(Program {
                    name: "supple-emu",
                    arguments,
                });
                plan.pendant = match bus {
                    Address::Folder(_) => Pendant::of(&bus),
                    Address::Interface(_) => Pendant::of(&Address::of_system(domain.prefix())?),
                };
            }
        }
        Ok(plan)
    }
}

impl PlantKind {
    /// The program that owns the clock.
    fn clock(self) -> &'static str {
        match self {
            PlantKind::Sim => "supple-sim",
            PlantKind::Emu | PlantKind::Can => "supple-can",
        }
    }
}

impl UpArgs {
    /// Where the log goes, if anywhere.
    pub fn log_file(&self) -> Option<PathBuf> {
        (!self.no_log).then(|| self.log.clone())
    }

    /// The arm, at the rate asked for.
    ///
    /// # Errors
    /// As [`Description::at_rate`].
    pub fn at_rate(&self, description: Description) -> Result<Description, ModelError> {
        match self.rate_hz {
            Some(rate_hz) => description.at_rate(f64::from(rate_hz)),
            None => Ok(description),
        }
    }

    /// The same system as words for the command line, without a log.
    pub fn words(&self) -> Vec<String> {
        let mut words = vec!["up", "--no-log", "--json", "--arm", &self.arm, "--plant"];
        words.push(match self.plant {
            PlantKind::Sim => "sim",
            PlantKind::Emu => "emu",
            PlantKind::Can => "can",
        });
        words.push("--track");
        words.push(match self.track {
            Course::Sinusoid => "sinusoid",
            Course::Arc => "arc",
            Course::Quadrant => "quadrant",
            Course::Probe => "probe",
        });
        words.extend(self.no_realtime.then_some("--no-realtime"));
        words.extend(self.strict.then_some("--strict"));
        let mut words: Vec<String> = words.into_iter().map(str::to_owned).collect();
        if let Some(prefix) = &self.prefix {
            words.extend(["--prefix".to_owned(), prefix.clone()]);
        }
        words.extend(self.surroundings());
        words
    }

    /// What a simulated arm stands in, what is put into it, and where it is written what acts on it.
    fn surroundings(&self) -> Vec<String> {
        let mut arguments = Vec::new();
        if let Some(face_m) = self.block_m {
            arguments.extend(["--block-m".to_owned(), face_m.to_string()]);
        }
        if let Some(file) = &self.trace {
            arguments.extend(["--trace".to_owned(), file.display().to_string()]);
        }
        for injection in &self.inject {
            arguments.extend(["--inject".to_owned(), injection.to_string()]);
        }
        arguments
    }

    fn check_injections(&self) -> Result<(), Failure> {
        match self.plant {
            PlantKind::Sim => Ok(()),
            PlantKind::Emu => Ok(self.inject.iter().try_for_each(Injection::on_bus)?),
            PlantKind::Can if self.inject.is_empty() => Ok(()),
            PlantKind::Can => Err(Failure::InjectionIntoRealArm),
        }
    }

    /// What every process is told.
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

    /// What every process with a period is told.
    fn timed_arguments(&self, domain: &Domain) -> Vec<String> {
        let mut arguments = self.common_arguments(domain);
        if let Some(rate_hz) = self.rate_hz {
            arguments.extend(["--rate-hz".to_owned(), rate_hz.to_string()]);
        }
        arguments
    }
}
