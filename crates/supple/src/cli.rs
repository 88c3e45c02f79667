//! The command line: what can be asked for.

use crate::exit::CODES;
use crate::identification;
use crate::range::between;
use clap::{Args, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;
use std::num::NonZeroU64;
use std::path::PathBuf;
use supple_bus::Address;
use supple_plant::Injection;

/// Minimum-impedance control of a backdrivable arm.
#[derive(Debug, Parser)]
#[command(version, after_help = CODES, arg_required_else_help = true)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What to do.
#[derive(Clone, Debug, Subcommand)]
pub enum Command {
    /// Run the paper's experiments: figures, report, summary and one log a run.
    #[command(after_help = CODES)]
    Demo(DemoArgs),
    /// Run a system: controller and plant as processes, tracking the sinusoid at 5 N/m, with a log.
    #[command(after_help = CODES)]
    Up(UpArgs),
    /// Say what a running system does.
    Status(Place),
    /// Put a running system into a mode.
    Mode {
        /// Which.
        mode: ModeName,
        /// Which system.
        #[command(flatten)]
        place: Place,
    },
    /// Change stiffness and damping of a running system, along a ramp.
    Gains(GainsArgs),
    /// Have a running system follow a trajectory; the arm moves to its start first.
    Track(TrackArgs),
    /// Have a running system probe for contact; the arm moves to the start first.
    Probe {
        /// The arm that runs.
        #[arg(long, value_name = "NAME|PATH", default_value = "wam4")]
        arm: String,
        /// Refuse an arm whose URDF holds what is not read, instead of warning.
        #[arg(long)]
        strict: bool,
        /// Which system.
        #[command(flatten)]
        place: Place,
    },
    /// Press a button at the pendant of a running system's emulated arm, or ask what it shows.
    Pendant {
        /// What to do at it.
        #[arg(value_enum)]
        action: PendantAction,
        /// Which system.
        #[arg(long, value_name = "NAME")]
        prefix: Option<String>,
    },
    /// Put simulated arms through losses, faults, collisions and wrong requests, each with what is expected of it.
    #[command(after_help = CODES)]
    Drill(DrillArgs),
    /// Take a running system out of its fault.
    Reset(Place),
    /// End a running system in order.
    Stop(Place),
    /// Look into logs.
    #[command(subcommand)]
    Log(LogCommand),
    #[command(flatten)]
    Identification(identification::Command),
    /// List the built-in arms.
    Arms {
        /// As JSON.
        #[arg(long)]
        json: bool,
    },
    /// Look whether this machine can run an arm in real time.
    #[command(after_help = CODES)]
    Doctor {
        /// As JSON.
        #[arg(long)]
        json: bool,
    },
    /// Print the completions of a shell.
    Completions {
        /// Which.
        shell: Shell,
    },
}

/// Arguments of `demo`.
#[derive(Clone, Debug, clap::Args)]
pub struct DemoArgs {
    /// A built-in arm (see `supple arms`), or the path of an arm's TOML or of its folder.
    #[arg(long, value_name = "NAME|PATH", default_value = "wam4")]
    pub arm: String,
    /// Refuse an arm whose URDF holds what is not read, instead of warning.
    #[arg(long)]
    pub strict: bool,
    /// What the controller knows of it, such as `supple identify` wrote: the path of a TOML or of its folder.
    /// Default: the arm's own parameters, perturbed where the experiments say so.
    #[arg(long, value_name = "PATH")]
    pub model: Option<PathBuf>,
    /// Folder for all results. Files in it of the same names are replaced, others are left alone.
    #[arg(long, value_name = "DIR", default_value = "out/demo")]
    pub out: PathBuf,
    /// Seed of the perturbed models and of every noise.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Print the summary as JSON instead of a table; an error is then an object on standard output too.
    #[arg(long)]
    pub json: bool,
    /// No progress, only the results.
    #[arg(long)]
    pub quiet: bool,
    /// Write no logs; all of them take about half a gigabyte.
    #[arg(long)]
    pub no_logs: bool,
}

/// Which system is meant, and how it is answered.
#[derive(Clone, Debug, Args)]
pub struct Place {
    /// Which system; SUPPLE_PREFIX or `supple` if not given.
    #[arg(long, value_name = "NAME")]
    pub prefix: Option<String>,
    /// As JSON.
    #[arg(long)]
    pub json: bool,
}

/// What plays the arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PlantKind {
    /// A simulated arm on shared memory.
    Sim,
    /// A simulated arm behind an emulated bus, with its pucks, safety module and pendant.
    Emu,
    /// An arm on a CAN bus; its operator activates it at its pendant.
    Can,
}

/// Arguments of `drill`.
#[derive(Clone, Debug, Args)]
pub struct DrillArgs {
    /// Only with this plant, `sim` or `emu`; with both if not given.
    #[arg(long, value_enum)]
    pub plant: Option<PlantKind>,
    /// Only rows whose name contains this, such as `track/`, `kill-supple-rt` or a whole name of --list. May be
    /// repeated: rows with any of them.
    #[arg(long, value_name = "PATTERN")]
    pub only: Vec<String>,
    /// Say which rows there are and what is expected of each, and run none.
    #[arg(long)]
    pub list: bool,
    /// Only rows in virtual time, which do not depend on how busy the machine is.
    #[arg(long)]
    pub virtual_time: bool,
    /// Write the table as a page of Markdown too.
    #[arg(long, value_name = "FILE")]
    pub markdown: Option<PathBuf>,
    /// A built-in arm (see `supple arms`), or the path of an arm's TOML or of its folder.
    #[arg(long, value_name = "NAME|PATH", default_value = "wam4")]
    pub arm: String,
    /// Refuse an arm whose URDF holds what is not read, instead of warning.
    #[arg(long)]
    pub strict: bool,
    /// Ask for neither priority nor locked memory.
    #[arg(long)]
    pub no_realtime: bool,
    /// Print the table as JSON.
    #[arg(long)]
    pub json: bool,
}

/// What can be done at a pendant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PendantAction {
    /// Shift and Idle: faults are cleared, the motors have power and brake.
    Idle,
    /// Shift and Activate: the motors take torques, unless a fault is shown.
    Activate,
    /// Press the emergency stop; it stays in.
    EStop,
    /// Pull the emergency stop out; power comes back with `idle`.
    Release,
    /// What the arm does.
    Status,
    /// What has happened to it since its start.
    Record,
}

/// A mode that can be asked for by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ModeName {
    /// No torque; the motors brake.
    Idle,
    /// The model holds the arm's weight.
    GravityHold,
}

/// What a system follows from its start on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Course {
    /// Back and forth along a line.
    Sinusoid,
    /// Back and forth on a circle about the base.
    Arc,
    /// Quarter ellipse and its edges, in the vertical plane.
    Quadrant,
    /// The probing cycle; with --block-m 0 it meets what it probes for.
    Probe,
}

/// A trajectory of the paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Shape {
    /// Back and forth along a line.
    Sinusoid,
    /// Back and forth on a circle about the base.
    Arc,
    /// Quarter ellipse and its edges, in the vertical plane.
    Quadrant,
}

/// Arguments of `up`.
#[derive(Clone, Debug, Args)]
pub struct UpArgs {
    /// What plays the arm.
    #[arg(long, value_enum)]
    pub plant: PlantKind,
    /// A built-in arm (see `supple arms`), or the path of an arm's TOML or of its folder.
    #[arg(long, value_name = "NAME|PATH", default_value = "wam4")]
    pub arm: String,
    /// Refuse an arm whose URDF holds what is not read, instead of warning.
    #[arg(long)]
    pub strict: bool,
    /// What the arm is brought to and follows.
    #[arg(long, value_enum, default_value = "sinusoid")]
    pub track: Course,
    /// The arm's bus, can:NAME or unix:FOLDER; can:can0 for `can`, sockets of its own for `emu`.
    #[arg(long, value_name = "BUS")]
    pub bus: Option<Address>,
    /// The arm on the bus is in its home pose now: where its positions are lost, this is where it is. An
    /// emulated arm always is.
    #[arg(long)]
    pub zero_at_home: bool,
    /// Take what the arm's force/torque sensor feels at the start for zero.
    #[arg(long)]
    pub tare: bool,
    /// A block of wood beneath a simulated or emulated arm, its face at this height above the base frame (m).
    #[arg(long, value_name = "M", allow_negative_numbers = true, value_parser = between(-10.0, 10.0))]
    pub block_m: Option<f64>,
    /// Put a fault into the simulated or emulated arm: KIND or KIND:key=value,... as in
    /// encoder-stuck:joint=1,at-s=2; see --help. May be repeated.
    #[arg(long, value_name = "SPEC", long_help = supple_plant::injection::HELP)]
    pub inject: Vec<Injection>,
    /// Write what acts at the motors and on the tip of a simulated or emulated arm, as CSV.
    #[arg(long, value_name = "FILE")]
    pub trace: Option<PathBuf>,
    /// Cycles per second; the arm's own if not given.
    #[arg(long, value_name = "HZ", value_parser = clap::value_parser!(u32).range(10..=10_000))]
    pub rate_hz: Option<u32>,
    /// Shut down after so many seconds of control; until an interrupt or `supple stop` if not given.
    #[arg(long = "for", value_name = "SECONDS", value_parser = between(1e-6, 1e8))]
    pub for_s: Option<f64>,
    /// As fast as the processes can, in lockstep. Needs --for.
    #[arg(long, requires = "for_s")]
    pub virtual_time: bool,
    /// The log; one of that name is replaced.
    #[arg(long, value_name = "FILE", default_value = "out/up.mcap")]
    pub log: PathBuf,
    /// Write no log.
    #[arg(long, conflicts_with = "log")]
    pub no_log: bool,
    /// Which system this is to be; SUPPLE_PREFIX or `supple` if not given.
    #[arg(long, value_name = "NAME")]
    pub prefix: Option<String>,
    /// Ask for neither priority nor locked memory.
    #[arg(long)]
    pub no_realtime: bool,
    /// Print the summary as JSON; an error is then an object on standard output too.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `gains`.
#[derive(Clone, Debug, Args)]
pub struct GainsArgs {
    /// Stiffness, for all axes or as X,Y,Z; as it is if not given.
    #[arg(long, value_name = "N/M", value_delimiter = ',', value_parser = between(0.0, 1e6))]
    pub stiffness: Vec<f64>,
    /// Damping, for all axes or as X,Y,Z; as it is if not given.
    #[arg(long, value_name = "N S/M", value_delimiter = ',', value_parser = between(0.0, 1e6))]
    pub damping: Vec<f64>,
    /// Time to reach them.
    #[arg(long = "ramp", value_name = "SECONDS", default_value_t = 1.0, value_parser = between(0.0, 3600.0))]
    pub ramp_s: f64,
    /// Which system.
    #[command(flatten)]
    pub place: Place,
}

/// Arguments of `track`.
#[derive(Clone, Debug, Args)]
pub struct TrackArgs {
    /// Which trajectory.
    pub shape: Shape,
    /// Its pace, as a multiple of the paper's.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = between(1e-6, 1e6))]
    pub speed: f64,
    /// The arm that runs.
    #[arg(long, value_name = "NAME|PATH", default_value = "wam4")]
    pub arm: String,
    /// Refuse an arm whose URDF holds what is not read, instead of warning.
    #[arg(long)]
    pub strict: bool,
    /// Which system.
    #[command(flatten)]
    pub place: Place,
}

/// What to do with a log.
#[derive(Clone, Debug, Subcommand)]
pub enum LogCommand {
    /// What is in a log: arm, span, channels, modes, faults.
    Info {
        /// The log.
        file: PathBuf,
        /// As JSON.
        #[arg(long)]
        json: bool,
    },
    /// A channel as comma-separated values.
    Export {
        /// The log; one that was cut has to be recovered first.
        file: PathBuf,
        /// The channel.
        #[arg(long, value_name = "NAME", default_value = "/controller_state")]
        channel: String,
        /// Every N-th message.
        #[arg(long, value_name = "N", default_value = "1")]
        every: NonZeroU64,
        /// The table's file; standard output if not given.
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
    },
    /// Run the controller over a log again and compare every answer to the last bit.
    #[command(after_help = CODES)]
    Replay {
        /// The log; one with missing steps is refused.
        file: PathBuf,
        /// As JSON.
        #[arg(long)]
        json: bool,
    },
    /// Save every whole chunk of a log that was cut or damaged.
    Recover {
        /// The log.
        from: PathBuf,
        /// Where to; `<name>.recovered.mcap` beside it if not given.
        to: Option<PathBuf>,
        /// Replace what is there.
        #[arg(long)]
        force: bool,
        /// Print what was saved as JSON.
        #[arg(long)]
        json: bool,
    },
}

impl Command {
    /// JSON is expected on standard output.
    pub fn json(&self) -> bool {
        match self {
            Command::Demo(args) => args.json,
            Command::Identification(command) => command.json(),
            Command::Up(args) => args.json,
            Command::Drill(args) => args.json,
            Command::Gains(GainsArgs { place, .. })
            | Command::Track(TrackArgs { place, .. })
            | Command::Mode { place, .. }
            | Command::Probe { place, .. }
            | Command::Status(place)
            | Command::Reset(place)
            | Command::Stop(place) => place.json,
            // Its answers are JSON already, its failures are words.
            Command::Pendant { .. } => false,
            Command::Arms { json } | Command::Doctor { json } => *json,
            Command::Log(
                LogCommand::Info { json, .. }
                | LogCommand::Recover { json, .. }
                | LogCommand::Replay { json, .. },
            ) => *json,
            Command::Log(LogCommand::Export { .. }) | Command::Completions { .. } => false,
        }
    }
}
