//! Definition of the command-line arguments.

use crate::sweep::SweepArgs;
use crate::view::ViewArgs;
use clap::{Args, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;
use std::path::PathBuf;
use supple_bus::Address;
use supple_cli::arguments::{MovedArmArgs, OfflineCommand, PlantArgs, RosArgs, UrdfArgs};
use supple_cli::exit::CODES;
use supple_cli::range::between;
use supple_plant::Injection;

/// Minimum-impedance control of a backdrivable arm.
#[derive(Debug, Parser)]
#[command(version, after_help = CODES, arg_required_else_help = true)]
pub struct Cli {
    /// Command to run.
    #[command(subcommand)]
    pub command: Command,
}

/// Command to run.
#[derive(Clone, Debug, Subcommand)]
pub enum Command {
    /// Commands that need no running system.
    #[command(flatten)]
    Offline(OfflineCommand),
    /// Run a system: controller and plant as processes, tracking the sinusoid at 5 N/m, with a log.
    #[command(after_help = CODES)]
    Up(UpArgs),
    /// Show the state of a running system; the exit code is 5 if a fault is latched.
    Status(SystemArgs),
    /// Show a running system, or a log, on a page in the browser; viewers of the Foxglove protocol can also connect.
    #[command(after_help = CODES)]
    View(ViewArgs),
    /// Make a running system a node of ROS 2, over Zenoh: joint states, transforms, wrenches and the controller's state.
    #[command(after_help = CODES)]
    Ros(RosArgs),
    /// Put a running system into a mode.
    Mode(ModeArgs),
    /// Change stiffness and damping of a running system, along a ramp.
    Gains(GainsArgs),
    /// Refine the model of a running system while its arm moves freely, or save the learned terms.
    #[command(after_help = LEARNING)]
    Learning(LearningArgs),
    /// Make a running system follow a trajectory, or the waypoints of a CSV file; the arm moves to its start first.
    Track(TrackArgs),
    /// Let a running arm float and record how it is guided by hand.
    #[command(after_help = CODES)]
    Teach(TeachArgs),
    /// Repeat a recorded motion on a running system, within its limits; the arm moves to the start first.
    #[command(after_help = CODES)]
    Play(PlayArgs),
    /// Make a running system probe for contact; the arm moves to the start first.
    Probe {
        /// The arm of the running system. Default: the arm of its `supple up`, otherwise wam4.
        #[arg(long, value_name = "NAME|PATH")]
        arm: Option<String>,
        /// Reject a URDF with elements or attributes that supple does not read, instead of only warning.
        #[arg(long)]
        strict: bool,
        /// What a URDF alone does not contain.
        #[command(flatten)]
        urdf: UrdfArgs,
        /// System to use.
        #[command(flatten)]
        system: SystemArgs,
    },
    /// Press a button on the pendant of a running system's emulated arm, or show its state. The answer is always JSON.
    Pendant {
        /// Button or query.
        #[arg(value_enum)]
        action: PendantAction,
        /// System to use.
        #[command(flatten)]
        system: SystemArgs,
    },
    /// Confirm that the arm is in its home pose: after an emergency stop, a WAM has lost its position reference and waits for this.
    AtHome(AtHomeArgs),
    /// List the motors of an arm on their bus, compare them with the arm's TOML and, on explicit request, set
    /// registers; for arms with Damiao motors.
    #[command(after_help = CODES)]
    Motors(MotorsArgs),
    /// Measure how well a model holds an arm: the drift of the tip in gravity hold, and the error of the joints under weak
    /// stiffness, in poses of the excitation.
    #[command(after_help = CODES)]
    HoldCheck(HoldCheckArgs),
    /// Run many experiments on this machine or on a cluster; needs the Python package. An interrupted sweep continues.
    #[command(after_help = CODES)]
    Sweep(SweepArgs),
    /// Test simulated arms against process failures, faults, collisions and invalid requests, and compare each result
    /// with the expected one.
    #[command(after_help = CODES)]
    Drill(DrillArgs),
    /// Clear the latched fault of a running system.
    Reset(SystemArgs),
    /// Shut a running system down, and wait until it has ended: the controller sets the drives to idle, an arm without brakes is laid down.
    /// One that `supple up --hold-until-supported` holds is not waited for: `supple stop --supported` releases it.
    Stop(StopArgs),
    /// Check whether this machine can run an arm in real time.
    #[command(after_help = CODES)]
    Doctor {
        /// Print the result as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Print the completion script of a shell.
    Completions {
        /// The shell.
        shell: Shell,
    },
    /// Write a manual page for every command, to read with `man`.
    Man {
        /// Folder of the pages; it is created if necessary. `man -M FOLDER/..` finds pages in a folder named man1.
        folder: PathBuf,
        /// Print the names of the pages as JSON.
        #[arg(long)]
        json: bool,
    },
}

/// Text after the help of `learning`.
const LEARNING: &str = "Friction, payload, base tilt, torque offsets, torque constants and a smooth map of the remaining torque over each \
joint's angle are estimated from the prediction error of the torques, never from the tracking error. They stay within \
bounds around the model, and nothing is learned in contact, in faults, in idle, gravity hold, float and joint impedance. \
`supple status` shows them.

`save DIR` writes arm.toml and arm.urdf, for --arm DIR and --model DIR.";

/// Arguments of `learning`.
#[derive(Clone, Debug, Args)]
pub struct LearningArgs {
    /// Action.
    #[command(subcommand)]
    pub action: LearningAction,
}

/// Action of `learning`.
#[derive(Clone, Debug, Subcommand)]
pub enum LearningAction {
    /// Begin or continue to learn.
    On(SystemArgs),
    /// Stop learning; the learned terms stay in effect.
    Off(SystemArgs),
    /// Discard the learned terms; learning stays on or off.
    Reset(SystemArgs),
    /// Write the arm with the learned terms; existing files are replaced.
    Save {
        /// Folder for arm.toml and arm.urdf.
        folder: PathBuf,
        /// System to use.
        #[command(flatten)]
        system: SystemArgs,
    },
}

/// Selects the system (prefix) and the output format.
#[derive(Clone, Debug, Args)]
pub struct SystemArgs {
    /// Prefix of the system. Default: SUPPLE_PREFIX or `supple`.
    #[arg(long, value_name = "NAME")]
    pub prefix: Option<String>,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `hold-check`.
#[derive(Clone, Debug, Args)]
pub struct HoldCheckArgs {
    /// The arm that moves; without --plant the simulated arm in this process.
    #[command(flatten)]
    pub moved: MovedArmArgs,
    /// A built-in arm, or the path of an arm's TOML, of its folder, or of a URDF. Default: the arm of the running system with
    /// `--plant running`, else `wam4`.
    #[arg(long, value_name = "NAME|PATH")]
    pub arm: Option<String>,
    /// Reject a URDF with elements or attributes that supple does not read, instead of only warning.
    #[arg(long)]
    pub strict: bool,
    /// What a URDF alone does not contain.
    #[command(flatten)]
    pub urdf: UrdfArgs,
    /// Number of poses.
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..=1000))]
    pub poses: usize,
    /// Time for which each pose is held, without and with stiffness (s).
    #[arg(long = "for", value_name = "SECONDS", default_value_t = 10.0, value_parser = between(1.0, 1000.0))]
    pub for_s: f64,
    /// Stiffness of each joint in the second part (N m/rad). Default: that of the arm's joint impedance mode.
    #[arg(long, value_name = "NM_PER_RAD,..", value_delimiter = ',', value_parser = between(0.0, 1e4))]
    pub stiffness: Vec<f64>,
    /// Folder for logs/hold-N-gravity.mcap, logs/hold-N-stiffness.mcap and summary.json.
    #[arg(long, value_name = "DIR", default_value = "out/hold-check")]
    pub out: PathBuf,
    /// Seed of the poses and of the simulated arm.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// The simulated arm.
    #[command(flatten)]
    pub plant: PlantArgs,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `stop`.
#[derive(Clone, Debug, Args)]
pub struct StopArgs {
    /// Declare that the arm is supported: an arm that `supple up --hold-until-supported` holds is released.
    #[arg(long)]
    pub supported: bool,
    /// Return at once, while the system still shuts down; not with --supported, which is declared until the system has ended.
    #[arg(long, conflicts_with = "supported")]
    pub no_wait: bool,
    /// The system.
    #[command(flatten)]
    pub system: SystemArgs,
}

/// Plant to run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PlantKind {
    /// A simulated arm on shared memory.
    Sim,
    /// A simulated arm on an emulated CAN bus: with motor pucks, safety module and pendant, or with Damiao motors.
    Emu,
    /// An arm on a CAN bus. The operator activates a WAM on its pendant; the program enables Damiao motors.
    Can,
}

/// Arguments of `motors`.
#[derive(Clone, Debug, Args)]
pub struct MotorsArgs {
    /// A built-in arm with `[bus]`, or the path of an arm's TOML or of its folder.
    #[arg(long, value_name = "NAME|PATH", default_value = "openarm")]
    pub arm: String,
    /// Reject a URDF with elements or attributes that supple does not read, instead of only warning.
    #[arg(long)]
    pub strict: bool,
    /// What a URDF alone does not contain.
    #[command(flatten)]
    pub urdf: UrdfArgs,
    /// The arm's bus, can:NAME or unix:FOLDER. Default: the bus of an emulated arm with the prefix.
    #[arg(long, value_name = "BUS")]
    pub bus: Option<Address>,
    /// Prefix of an emulated arm. Default: SUPPLE_PREFIX or `supple`.
    #[arg(long, value_name = "NAME")]
    pub prefix: Option<String>,
    /// Use only the motor with this id.
    #[arg(long, value_name = "ID")]
    pub motor: Option<u16>,
    /// Read all registers.
    #[arg(long)]
    pub registers: bool,
    /// Set a register by name or number, as in TIMEOUT=400; the value is lost when the motor's supply is switched off. May be
    /// repeated.
    #[arg(long, value_name = "NAME=VALUE", requires = "motor")]
    pub set: Vec<String>,
    /// Clear the latched error.
    #[arg(long, requires = "motor")]
    pub clear: bool,
    /// Store all registers of the motor in its flash, which endures some 10000 writes.
    #[arg(long, requires = "motor")]
    pub store: bool,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `drill`.
#[derive(Clone, Debug, Args)]
pub struct DrillArgs {
    /// Plant of the test cases, `sim` or `emu`. Default: both.
    #[arg(long, value_enum)]
    pub plant: Option<PlantKind>,
    /// Run only test cases whose name contains this text, for example `track/`, `kill-supple-rt` or a full name from
    /// --list. May be repeated: a case runs if any text matches.
    #[arg(long, value_name = "PATTERN")]
    pub only: Vec<String>,
    /// List the test cases with their expected results, without running them.
    #[arg(long)]
    pub list: bool,
    /// Run only the test cases in virtual time; their results do not depend on the load of the machine.
    #[arg(long)]
    pub virtual_time: bool,
    /// Instead of the test cases, run this many random ones on a simulated arm: faults of random kinds at random times in
    /// random tasks and poses, evaluated by energy and speed alone.
    #[arg(long, value_name = "COUNT", conflicts_with_all = ["plant", "only", "list", "virtual_time"])]
    pub random: Option<u64>,
    /// Seed of the first random case.
    #[arg(long, value_name = "SEED", default_value_t = 1, requires = "random")]
    pub seed: u64,
    /// Run the random cases without held joints, as in the pose mode.
    #[arg(long, requires = "random")]
    pub all_joints_active: bool,
    /// Also write the result table as Markdown.
    #[arg(long, value_name = "FILE")]
    pub markdown: Option<PathBuf>,
    /// A built-in arm (see `supple arms`), or the path of an arm's TOML, of its folder, or of a URDF.
    #[arg(long, value_name = "NAME|PATH", default_value = "wam4")]
    pub arm: String,
    /// Reject a URDF with elements or attributes that supple does not read, instead of only warning.
    #[arg(long)]
    pub strict: bool,
    /// What a URDF alone does not contain.
    #[command(flatten)]
    pub urdf: UrdfArgs,
    /// Run without realtime priority, locked memory or processor binding.
    #[arg(long)]
    pub no_realtime: bool,
    /// Print the table as JSON.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `at-home`.
#[derive(Clone, Debug, Args)]
pub struct AtHomeArgs {
    /// Confirm without a question.
    #[arg(long)]
    pub yes: bool,
    /// System to use.
    #[command(flatten)]
    pub system: SystemArgs,
}

/// Buttons and queries of the pendant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PendantAction {
    /// Shift-Idle: clear the faults; the motors are powered and brake (terminals shorted).
    Idle,
    /// Shift-Activate: the motors follow torque commands, unless the pendant shows a fault.
    Activate,
    /// Press the emergency stop; it latches.
    EStop,
    /// Release the emergency stop; `idle` restores the power.
    Release,
    /// Put the arm back into the cradle in its home pose, as a person does with an arm that fell; only without torque.
    Cradle,
    /// Show the state of the arm.
    Status,
    /// List the events of the arm since it started.
    Record,
}

/// Modes that can be requested by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ModeName {
    /// No torque; the motors brake.
    Idle,
    /// Gravity compensation with joint damping.
    GravityHold,
    /// Torques of the model alone, for guiding the arm by hand.
    Float,
    /// Compliant joints: hold the pose softly, or move to --target.
    JointImpedance,
}

/// Arguments of `mode`.
#[derive(Clone, Debug, Args)]
pub struct ModeArgs {
    /// The mode.
    pub mode: ModeName,
    /// Angles to move to in the joint-impedance mode, one per joint; the angles of held joints are ignored.
    /// Default: the present pose.
    #[arg(long, value_name = "RAD,...", value_delimiter = ',', allow_hyphen_values = true, value_parser = between(-100.0, 100.0))]
    pub target: Vec<f64>,
    /// Duration of the motion to --target.
    #[arg(long = "duration", value_name = "SECONDS", requires = "target", default_value_t = 3.0, value_parser = between(1e-3, 3600.0))]
    pub duration_s: f64,
    /// System to use.
    #[command(flatten)]
    pub system: SystemArgs,
}

/// Trajectory that `supple up` starts with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum UpTrajectory {
    /// Back and forth along a line.
    Sinusoid,
    /// Back and forth on a circle about the base.
    Arc,
    /// Quarter ellipse and its edges, in the vertical plane.
    Quadrant,
    /// The probing cycle; --block-m 0 places the block that it probes.
    Probe,
}

/// A trajectory of the paper, or a rotation of the tip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TrackTrajectory {
    /// Keep the position of the tip and turn it: --rotate, --angle-rad, --duration. Needs at least six joints that are
    /// not held.
    Pose,
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
    /// Plant to run.
    #[arg(long, value_enum)]
    pub plant: PlantKind,
    /// A built-in arm (see `supple arms`), or the path of an arm's TOML, of its folder, or of a URDF.
    #[arg(long, value_name = "NAME|PATH", default_value = "wam4")]
    pub arm: String,
    /// Reject a URDF with elements or attributes that supple does not read, instead of only warning.
    #[arg(long)]
    pub strict: bool,
    /// What a URDF alone does not contain.
    #[command(flatten)]
    pub urdf: UrdfArgs,
    /// Trajectory: the arm moves to its start and then follows it.
    #[arg(long, value_enum, default_value = "sinusoid")]
    pub track: UpTrajectory,
    /// The arm's bus, can:NAME or unix:FOLDER. Default: can:can0 for `can`, private sockets for `emu`.
    #[arg(long, value_name = "BUS")]
    pub bus: Option<Address>,
    /// Print the bus time of a cycle of this arm and exit; the exit code shows whether the requested rate is possible.
    #[arg(long)]
    pub budget: bool,
    /// Declare that the arm is in its home pose now; used if the motor pucks have lost their position reference. An
    /// emulated arm always starts in its home pose.
    #[arg(long)]
    pub zero_at_home: bool,
    /// Refine the model while the arm moves freely, as `supple learning on` does.
    #[arg(long)]
    pub learn: bool,
    /// Tare the arm's force/torque sensor at start-up.
    #[arg(long)]
    pub tare: bool,
    /// Place a block of wood beneath a simulated or emulated arm, its top face at this height above the base frame
    /// (m).
    #[arg(long, value_name = "M", allow_negative_numbers = true, value_parser = between(-10.0, 10.0))]
    pub block_m: Option<f64>,
    /// Inject a fault into the simulated or emulated arm: KIND or KIND:key=value,... as in
    /// encoder-stuck:joint=1,at-s=2; see --help. May be repeated.
    #[arg(long, value_name = "SPEC", long_help = supple_plant::injection::HELP)]
    pub inject: Vec<Injection>,
    /// Make an emulated Damiao motor or its bus misbehave, as in error:motor=2,code=B,at-s=3; `supple-emu --help` lists
    /// the kinds. May be repeated.
    #[arg(long, value_name = "SPEC")]
    pub misbehave: Vec<String>,
    /// The simulated or emulated arm.
    #[command(flatten)]
    pub plant_options: PlantArgs,
    /// Write motor torques and tip forces of the simulated or emulated arm as CSV.
    #[arg(long, value_name = "FILE")]
    pub trace: Option<PathBuf>,
    /// At the end, hold an arm without brakes until `supple stop --supported`, instead of laying it down.
    #[arg(long, conflicts_with = "virtual_time")]
    pub hold_until_supported: bool,
    /// Control rate in Hz. Default: the rate of the arm description.
    #[arg(long, value_name = "HZ", value_parser = clap::value_parser!(u32).range(10..=10_000))]
    pub rate_hz: Option<u32>,
    /// Shut down after this many seconds of control. Default: run until interrupted or `supple stop`.
    #[arg(long = "for", value_name = "SECONDS", value_parser = between(1e-6, 1e8))]
    pub for_s: Option<f64>,
    /// Run in virtual time: all processes in lockstep, as fast as possible. Requires --for.
    #[arg(long, requires = "for_s")]
    pub virtual_time: bool,
    /// The log; an existing file is replaced, a missing folder is created. Default: out/up.mcap, and the log of the run before is kept
    /// as out/up.previous.mcap.
    #[arg(long, value_name = "FILE")]
    pub log: Option<PathBuf>,
    /// Write no log.
    #[arg(long, conflicts_with = "log")]
    pub no_log: bool,
    /// Also start the live page and print its URL, as `supple view` does. In virtual time the page ends with the run.
    #[arg(long)]
    pub view: bool,
    /// Prefix of the new system. Default: SUPPLE_PREFIX or `supple`.
    #[arg(long, value_name = "NAME")]
    pub prefix: Option<String>,
    /// Run without realtime priority, locked memory or processor binding.
    #[arg(long)]
    pub no_realtime: bool,
    /// Print the summary as JSON; an error is then also an object on standard output.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `gains`.
#[derive(Clone, Debug, Args)]
pub struct GainsArgs {
    /// Stiffness for all axes, X,Y,Z, or of the pose mode as a matrix XX,YY,ZZ,YZ,ZX,XY. Default: unchanged.
    #[arg(long, value_name = "N/M", value_delimiter = ',', allow_hyphen_values = true, value_parser = between(-1e6, 1e6))]
    pub stiffness: Vec<f64>,
    /// Damping for all axes, X,Y,Z, or of the pose mode as a matrix XX,YY,ZZ,YZ,ZX,XY. Default: unchanged.
    #[arg(long, value_name = "N S/M", value_delimiter = ',', allow_hyphen_values = true, value_parser = between(-1e6, 1e6))]
    pub damping: Vec<f64>,
    /// Stiffness of the joint-impedance mode for all joints, or one value per joint. Default: unchanged.
    #[arg(long, conflicts_with_all = ["stiffness", "damping"], value_name = "N M/RAD", value_delimiter = ',', value_parser = between(0.0, 1e6))]
    pub joint_stiffness: Vec<f64>,
    /// Damping of the joint-impedance mode for all joints, or one value per joint. Default: unchanged.
    #[arg(long, conflicts_with_all = ["stiffness", "damping"], value_name = "N M S/RAD", value_delimiter = ',', value_parser = between(0.0, 1e5))]
    pub joint_damping: Vec<f64>,
    /// Stiffness of the tip's orientation in the pose mode about all axes, X,Y,Z, or as a matrix XX,YY,ZZ,YZ,ZX,XY. Default:
    /// unchanged.
    #[arg(long, conflicts_with_all = ["stiffness", "damping", "joint_stiffness", "joint_damping"], value_name = "N M/RAD", value_delimiter = ',', allow_hyphen_values = true, value_parser = between(-1e4, 1e4))]
    pub rotational: Vec<f64>,
    /// Damping of the tip's orientation in the pose mode about all axes, X,Y,Z, or as a matrix XX,YY,ZZ,YZ,ZX,XY. Default:
    /// unchanged.
    #[arg(long, conflicts_with_all = ["stiffness", "damping", "joint_stiffness", "joint_damping"], value_name = "N M S/RAD", value_delimiter = ',', allow_hyphen_values = true, value_parser = between(-1e3, 1e3))]
    pub rotational_damping: Vec<f64>,
    /// Axes of the pose mode's stiffness and damping: those of the base, or those of the tip's reference, with which the matrices
    /// then rotate. Give stiffness and damping together. Default with a matrix: base.
    #[arg(long, value_enum, conflicts_with_all = ["joint_stiffness", "joint_damping"])]
    pub axes: Option<GainAxesName>,
    /// Duration of the ramp to the new gains.
    #[arg(long = "ramp", value_name = "SECONDS", default_value_t = 1.0, value_parser = between(0.0, 3600.0))]
    pub ramp_s: f64,
    /// System to use.
    #[command(flatten)]
    pub system: SystemArgs,
}

/// Axes of gain matrices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum GainAxesName {
    /// Axes of the base.
    Base,
    /// Axes of the tip's reference.
    Tip,
}

/// Target of `track`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TrackTarget {
    /// A trajectory by its name.
    Named(TrackTrajectory),
    /// A file of waypoints, or of a motion with times.
    File(PathBuf),
}

impl core::str::FromStr for TrackTarget {
    type Err = String;

    fn from_str(text: &str) -> Result<TrackTarget, String> {
        if let Ok(named) = TrackTrajectory::from_str(text, false) {
            return Ok(TrackTarget::Named(named));
        }
        match text.contains(['.', '/']) {
            true => Ok(TrackTarget::File(text.into())),
            false => {
                Err("give pose, sinusoid, arc, quadrant, or a file such as points.csv".to_owned())
            }
        }
    }
}

/// Arguments of `teach`.
#[derive(Clone, Debug, Args)]
pub struct TeachArgs {
    /// The recording, CSV; an existing file is replaced.
    pub file: PathBuf,
    /// End the recording after this many seconds. Default: end with Ctrl-C, or when float ends.
    #[arg(long = "for", value_name = "SECONDS", value_parser = between(0.1, 3600.0))]
    pub for_s: Option<f64>,
    /// System to use.
    #[command(flatten)]
    pub system: SystemArgs,
}

/// Arguments of `play`.
#[derive(Clone, Debug, Args)]
pub struct PlayArgs {
    /// The recording of `supple teach`, or another CSV file with the columns time_s,x_m,y_m,z_m.
    pub file: PathBuf,
    /// Stiffness for all axes, or X,Y,Z. Default: unchanged.
    #[arg(long, value_name = "N/M", value_delimiter = ',', value_parser = between(0.0, 1e6))]
    pub stiffness: Vec<f64>,
    /// Damping for all axes, or X,Y,Z. Default: unchanged.
    #[arg(long, value_name = "N S/M", value_delimiter = ',', value_parser = between(0.0, 1e6))]
    pub damping: Vec<f64>,
    /// Speed relative to the recording. The motion is slower where a limit requires it.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = between(0.1, 10.0))]
    pub speed: f64,
    /// The arm of the running system. Default: the arm of its `supple up`, otherwise wam4.
    #[arg(long, value_name = "NAME|PATH")]
    pub arm: Option<String>,
    /// Reject a URDF with elements or attributes that supple does not read, instead of only warning.
    #[arg(long)]
    pub strict: bool,
    /// What a URDF alone does not contain.
    #[command(flatten)]
    pub urdf: UrdfArgs,
    /// System to use.
    #[command(flatten)]
    pub system: SystemArgs,
}

/// Arguments of `track`.
#[derive(Clone, Debug, Args)]
pub struct TrackArgs {
    /// Trajectory of the paper, `sinusoid`, `arc` or `quadrant`; `pose`, which keeps the tip's position and turns it:
    /// --rotate, --angle-rad, --duration, with at least six joints that are not held; or a CSV file with the columns
    /// x_m,y_m,z_m of waypoints in base axes, passed as fast as the limits allow, and time_s if the motion has times.
    #[arg(value_name = "NAME|FILE")]
    pub trajectory: TrackTarget,
    /// Rotation axis of `pose` in base coordinates, of any length except zero.
    #[arg(long, value_name = "X,Y,Z", value_delimiter = ',', allow_hyphen_values = true, required_if_eq("trajectory", "pose"), value_parser = between(-1e3, 1e3))]
    pub rotate: Vec<f64>,
    /// Rotation angle, at most half a turn.
    #[arg(long, value_name = "RAD", requires = "rotate", default_value_t = 0.0, allow_negative_numbers = true, value_parser = between(-core::f64::consts::PI, core::f64::consts::PI))]
    pub angle_rad: f64,
    /// Duration of the rotation.
    #[arg(long = "duration", value_name = "SECONDS", requires = "rotate", default_value_t = 3.0, value_parser = between(1e-3, 3600.0))]
    pub duration_s: f64,
    /// Speed factor relative to the paper or to the times in a file; for waypoints, 1 is the maximum and means 0.8 of
    /// the limits of speed and acceleration.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = between(1e-6, 1e6))]
    pub speed: f64,
    /// The arm of the running system. Default: the arm of its `supple up`, otherwise wam4.
    #[arg(long, value_name = "NAME|PATH")]
    pub arm: Option<String>,
    /// Reject a URDF with elements or attributes that supple does not read, instead of only warning.
    #[arg(long)]
    pub strict: bool,
    /// What a URDF alone does not contain.
    #[command(flatten)]
    pub urdf: UrdfArgs,
    /// System to use.
    #[command(flatten)]
    pub system: SystemArgs,
}

impl Command {
    /// Whether the command prints JSON on standard output.
    pub fn json(&self) -> bool {
        match self {
            Command::Offline(command) => command.json(),
            Command::Up(args) => args.json,
            Command::Drill(args) => args.json,
            Command::View(args) => args.json,
            Command::Ros(args) => args.json,
            Command::Mode(ModeArgs { system, .. })
            | Command::Gains(GainsArgs { system, .. })
            | Command::Learning(LearningArgs {
                action:
                    LearningAction::On(system)
                    | LearningAction::Off(system)
                    | LearningAction::Reset(system)
                    | LearningAction::Save { system, .. },
            })
            | Command::Track(TrackArgs { system, .. })
            | Command::Teach(TeachArgs { system, .. })
            | Command::Play(PlayArgs { system, .. })
            | Command::Probe { system, .. }
            | Command::Pendant { system, .. }
            | Command::AtHome(AtHomeArgs { system, .. })
            | Command::Status(system)
            | Command::Reset(system) => system.json,
            Command::Stop(args) => args.system.json,
            Command::Motors(args) => args.json,
            Command::HoldCheck(args) => args.json,
            Command::Sweep(args) => args.json,
            Command::Doctor { json } => *json,
            Command::Completions { .. } => false,
            Command::Man { json, .. } => *json,
        }
    }
}
