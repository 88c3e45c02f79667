//! Arguments of the identification commands.

use super::{PlantArgs, UrdfArgs};
use crate::exit::CODES;
use crate::range::between;
use clap::builder::RangedU64ValueParser;
use clap::{Args, Subcommand, ValueEnum};
use std::path::PathBuf;
use supple_experiment::procedure::StepName;
use supple_ident::excitation_design::MAX_CANDIDATES;
use supple_ident::paper_estimator::MIN_SAMPLES;
use supple_ident::{FrictionChoice, FrictionColumns, LoadTorque, Method};
use supple_plant::Injection;

/// Identification command.
#[derive(Clone, Debug, Subcommand)]
pub enum IdentificationCommand {
    /// Identify an arm from logs: model, report, verdict.
    #[command(after_help = CODES)]
    Identify(IdentifyArgs),
    /// Design and run an excitation for identification.
    #[command(subcommand)]
    Excite(ExciteCommand),
    /// Measure the breakaway torque of each joint: of the simulated arm, or of an arm or system with --plant.
    #[command(after_help = CODES)]
    Breakaway(BreakawayArgs),
    /// Calibrate an arm: wiring, breakaway, excitation, identification, validation, sinusoid at 5 N/m.
    ///
    /// Without --plant the simulated arm is calibrated from a model that is 5 % off in gravity and 30 % in friction, and
    /// the demo runs with the result. With --plant the steps are those for a real arm, also on simulated ones.
    #[command(after_help = CODES)]
    Calibrate(CalibrateArgs),
    /// Identify the paper's arm by the paper's procedure, Eq. (3.7) and (3.8), in simulation.
    ///
    /// The procedure takes Coulomb friction from breakaway and m3 as known, and fits twelve columns by least squares over N
    /// samples of an excitation. For comparison, the command also runs this program's fit of the same arm.
    #[command(after_help = CODES)]
    CalibratePaper(CalibratePaperArgs),
    /// Refit friction and payload from logs of a repeated motion, or with --plant from a sinusoid that the arm then tracks.
    #[command(after_help = CODES)]
    Learn(LearnArgs),
}

/// Command of `supple excite`.
#[derive(Clone, Debug, Subcommand)]
pub enum ExciteCommand {
    /// Design an excitation trajectory that makes the parameters identifiable, within the limits of the arm.
    #[command(after_help = CODES)]
    Design(DesignArgs),
    /// Run a designed motion and then a slow one, on the simulated arm or with --plant on an arm or a system, and log both.
    #[command(after_help = CODES)]
    Run(RunArgs),
}

/// Criterion of a design.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Criterion {
    /// Condition number of the base regressor.
    Condition,
    /// Determinant of the information matrix.
    DOptimality,
}

/// Solver.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Solver {
    /// Ordinary least squares.
    Ols,
    /// Weighted least squares, weighted per joint.
    Wls,
    /// Iteratively reweighted least squares (robust), weighted per joint.
    Irls,
    /// Weighted least squares with physically consistent inertias.
    Consistent,
}

impl From<Solver> for Method {
    fn from(solver: Solver) -> Method {
        match solver {
            Solver::Ols => Method::Ols,
            Solver::Wls => Method::Wls,
            Solver::Irls => Method::Irls,
            Solver::Consistent => Method::Consistent,
        }
    }
}

/// Friction columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FrictionArg {
    /// Chosen by cross-validation.
    Auto,
    /// No friction.
    None,
    /// Viscous.
    Viscous,
    /// Viscous and Coulomb.
    Coulomb,
    /// Viscous, Coulomb and an offset.
    Offset,
    /// Viscous by direction, Coulomb and an offset.
    Asymmetric,
    /// Viscous, and Coulomb that grows with the load of the joint.
    Load,
    /// Viscous, and Coulomb that grows with the torque of the motor.
    MotorLoad,
}

/// Effects in addition to links and friction of the joints.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum EffectsArg {
    /// Chosen by cross-validation: none, all except the compliance, or all.
    Auto,
    /// None.
    None,
}

impl From<FrictionArg> for FrictionChoice {
    fn from(argument: FrictionArg) -> FrictionChoice {
        let columns = match argument {
            FrictionArg::Auto => return FrictionChoice::Auto,
            FrictionArg::None => FrictionColumns::NONE,
            FrictionArg::Viscous => FrictionColumns {
                viscous: true,
                ..FrictionColumns::NONE
            },
            FrictionArg::Coulomb => FrictionColumns::COULOMB,
            FrictionArg::Offset => FrictionColumns::COULOMB_AND_OFFSET,
            FrictionArg::Asymmetric => FrictionColumns {
                asymmetry: true,
                ..FrictionColumns::COULOMB_AND_OFFSET
            },
            FrictionArg::Load => FrictionColumns {
                load: Some(LoadTorque::Joint),
                ..FrictionColumns::COULOMB
            },
            FrictionArg::MotorLoad => FrictionColumns {
                load: Some(LoadTorque::Motor),
                ..FrictionColumns::COULOMB
            },
        };
        FrictionChoice::Columns(columns)
    }
}

/// Time from a logged torque to its action.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TorqueDelay {
    /// Estimated for each log.
    Estimate,
    /// Given value \[s\].
    Seconds(f64),
}

fn torque_delay(text: &str) -> Result<TorqueDelay, String> {
    if text == "estimate" {
        return Ok(TorqueDelay::Estimate);
    }
    match text.parse::<f64>() {
        Ok(value) if value.abs() <= 1.0 => Ok(TorqueDelay::Seconds(value)),
        _ => Err("give seconds from -1 to 1, as in -0.008, or `estimate`".to_owned()),
    }
}

/// Arguments of `identify`.
#[derive(Clone, Debug, Args)]
pub struct IdentifyArgs {
    /// Logs: supple's MCAP, or CSV with the columns `t`, `q[0]` .., `tau[0]` .. and, if measured, `qd[0]` ..
    #[arg(required = true, value_name = "LOG")]
    pub logs: Vec<PathBuf>,
    /// A built-in arm, or the path of an arm's TOML, of its folder, or of a URDF: kinematics and prior.
    #[arg(long, value_name = "NAME|PATH")]
    pub arm: String,
    /// Reject a URDF with elements or attributes that supple does not read, instead of only warning.
    #[arg(long)]
    pub strict: bool,
    /// What a URDF alone does not contain.
    #[command(flatten)]
    pub urdf: UrdfArgs,
    /// Folder for arm.toml, arm.urdf, report.html and summary.json.
    #[arg(long, value_name = "DIR", default_value = "out/identified")]
    pub out: PathBuf,
    /// Logs for validation only. Default: the last fifth of the first log is held out.
    #[arg(long, value_name = "LOG")]
    pub validate: Vec<PathBuf>,
    /// Joints to identify, counted from 0; the other joints were held during the log. Default: all.
    #[arg(long, value_name = "J,J..", value_delimiter = ',')]
    pub moving: Vec<usize>,
    /// Two joints coupled by a gear: the motor turns with the sum of their angles, for example 4+5.
    #[arg(long, value_name = "J+J", value_parser = pair)]
    pub coupling: Vec<(usize, usize)>,
    /// Cutoff of the zero-phase filter (Hz).
    #[arg(long, value_name = "HZ", default_value_t = 8.0, value_parser = between(1e-3, 1e5))]
    pub cutoff: f64,
    /// Rate of the resampling grid (Hz). Default: the rate of the log.
    #[arg(long, value_name = "HZ", value_parser = between(1e-1, 1e5))]
    pub rate: Option<f64>,
    /// Solver.
    #[arg(long, value_enum, default_value = "consistent")]
    pub method: Solver,
    /// Exclude samples of a joint below this speed from the fit, and fit the Stribeck effect from them (rad/s).
    /// Default: 0.15 for MCAP, 0 (none) for CSV, where friction columns are chosen by cross-validation.
    #[arg(long, value_name = "RAD/S", value_parser = between(0.0, 100.0))]
    pub slow: Option<f64>,
    /// Friction columns of every moving joint. Default: chosen by cross-validation.
    #[arg(long, value_enum, default_value = "auto")]
    pub friction: FrictionArg,
    /// Springs over the joints (hoses, wires), tilt of the base, compliance, and friction of motors that drive several joints:
    /// none, all except the compliance, or all, chosen by cross-validation. Default: auto for MCAP, none for CSV.
    #[arg(long, value_enum)]
    pub effects: Option<EffectsArg>,
    /// Weight of the given arm, in equivalent observations. Default: chosen by cross-validation.
    #[arg(long, value_name = "N", value_parser = between(1e-6, 1e9))]
    pub prior_weight: Option<f64>,
    /// Time from a logged torque to its action (s): positive for commands, negative for measured torques that lag; or
    /// `estimate`. Default: 1.5 control periods for supple's own logs, which hold commands; otherwise `estimate`.
    #[arg(long, value_name = "S|estimate", value_parser = torque_delay, allow_hyphen_values = true)]
    pub torque_delay: Option<TorqueDelay>,
    /// Logs with a weight of known mass at the last link, to find the ratio of true to logged torque of each joint and the
    /// centre of mass of the weight; --weight-kg is its mass.
    #[arg(long, value_name = "LOG", requires = "weight_kg")]
    pub weighed: Vec<PathBuf>,
    /// Mass of the weight in the logs of --weighed (kg).
    #[arg(long, value_name = "KG", requires = "weighed", value_parser = between(1e-3, 1e3))]
    pub weight_kg: Option<f64>,
    /// Fit a log even if the checks against the arm find an error in it; the error is then a warning.
    #[arg(long)]
    pub accept_wrong_logs: bool,
    /// Standard deviation of the torque noise of each moving joint (N m). Default: estimated from the residuals.
    #[arg(long, value_name = "NM,NM..", value_delimiter = ',', value_parser = between(1e-9, 1e6))]
    pub noise: Vec<f64>,
    /// Print the summary as JSON.
    #[arg(long)]
    pub json: bool,
    /// Print no progress.
    #[arg(long)]
    pub quiet: bool,
}

/// Arguments of `excite design`.
#[derive(Clone, Debug, Args)]
pub struct DesignArgs {
    /// A built-in arm, or the path of an arm's TOML, of its folder, or of a URDF.
    #[arg(long, value_name = "NAME|PATH")]
    pub arm: String,
    /// Reject a URDF with elements or attributes that supple does not read, instead of only warning.
    #[arg(long)]
    pub strict: bool,
    /// What a URDF alone does not contain.
    #[command(flatten)]
    pub urdf: UrdfArgs,
    /// Folder for excitation.csv, excitation.svg and summary.json.
    #[arg(long, value_name = "DIR", default_value = "out/excitation")]
    pub out: PathBuf,
    /// Joints to move, counted from 0. Default: all.
    #[arg(long, value_name = "J,J..", value_delimiter = ',')]
    pub moving: Vec<usize>,
    /// Criterion to minimise.
    #[arg(long, value_enum, default_value = "condition")]
    pub criterion: Criterion,
    /// Length of a period (s).
    #[arg(long, value_name = "S", default_value_t = 15.0, value_parser = between(0.1, 3600.0))]
    pub period: f64,
    /// Number of periods.
    #[arg(long, value_name = "N", default_value_t = 4.0, value_parser = between(0.1, 1000.0))]
    pub periods: f64,
    /// Number of candidates.
    #[arg(
        long,
        value_name = "N",
        default_value_t = 3000,
        value_parser = RangedU64ValueParser::<usize>::new().range(1..=MAX_CANDIDATES as u64)
    )]
    pub candidates: usize,
    /// Box that the tip stays in, base axes: minimum x, y, z, maximum x, y, z (m).
    #[arg(
        long,
        value_name = "X,Y,Z,X,Y,Z",
        value_delimiter = ',',
        value_parser = between(-1e3, 1e3),
        allow_hyphen_values = true
    )]
    pub workspace: Vec<f64>,
    /// Seed of the search.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Print the summary as JSON.
    #[arg(long)]
    pub json: bool,
    /// Print no progress.
    #[arg(long)]
    pub quiet: bool,
}

/// The arm that a command moves, on a system that it starts or that runs already.
#[derive(Clone, Debug, Args)]
pub struct MovedArmArgs {
    /// Move this arm as a real one, instead of the simulated arm alone.
    #[arg(long = "plant", value_enum)]
    pub on: Option<CalibrationPlant>,
    /// Model to start from: path of its TOML or folder. Default: the arm's own.
    #[arg(long, value_name = "PATH", requires = "on")]
    pub model: Option<PathBuf>,
    /// Relative errors of the starting model in gravity, in friction and, if given, in rotor inertia, with the signs of
    /// --seed, for example 0.15,0.5,1. For simulated arms.
    #[arg(long, value_name = "GRAVITY,FRICTION[,INERTIA]", value_delimiter = ',', requires = "on", value_parser = between(0.0, 1.0))]
    pub start_error: Vec<f64>,
    /// Confirm that the space swept by the arm is free; the program does not ask.
    #[arg(long, requires = "on")]
    pub yes: bool,
    /// The arm's bus, can:NAME or unix:FOLDER. Default: can:can0 for `can`, private sockets for `emu`.
    #[arg(long, value_name = "BUS", requires = "on")]
    pub bus: Option<String>,
    /// Declare that the arm is in its home pose now; used if the motor pucks have lost their position reference.
    #[arg(long, requires = "on")]
    pub zero_at_home: bool,
    /// Inject a fault into the simulated or emulated arm, as `supple up --inject`.
    #[arg(long, value_name = "SPEC", requires = "on")]
    pub inject: Vec<Injection>,
    /// Run the processes in lockstep, as fast as possible: `emu` only.
    #[arg(long, requires = "on")]
    pub virtual_time: bool,
    /// Prefix of the system. Default: SUPPLE_PREFIX or `supple`.
    #[arg(long, value_name = "NAME", requires = "on")]
    pub prefix: Option<String>,
    /// Run without realtime priority, locked memory or processor binding.
    #[arg(long, requires = "on")]
    pub no_realtime: bool,
}

/// Arguments of `excite run`.
#[derive(Clone, Debug, Args)]
pub struct RunArgs {
    /// The arm that moves.
    #[command(flatten)]
    pub moved: MovedArmArgs,
    /// A built-in arm, or the path of an arm's TOML, of its folder, or of a URDF: plant and controller.
    #[arg(long, value_name = "NAME|PATH")]
    pub arm: String,
    /// Reject a URDF with elements or attributes that supple does not read, instead of only warning.
    #[arg(long)]
    pub strict: bool,
    /// What a URDF alone does not contain.
    #[command(flatten)]
    pub urdf: UrdfArgs,
    /// Folder that `excite design` wrote, or its summary.json.
    #[arg(long, value_name = "PATH", default_value = "out/excitation")]
    pub design: PathBuf,
    /// Folder for logs/excitation.mcap and summary.json.
    #[arg(long, value_name = "DIR", default_value = "out/excited")]
    pub out: PathBuf,
    /// Seed of all noise.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Torque ripple of the plant's motors, seen at the joints (N m).
    #[arg(long, value_name = "NM", default_value_t = 0.0, value_parser = between(0.0, 100.0))]
    pub ripple: f64,
    /// Simulate the plant without friction that depends on direction and load.
    #[arg(long)]
    pub no_load_friction: bool,
    /// Skip the slow motion, which is needed to identify dry friction at low speed.
    #[arg(long)]
    pub no_slow: bool,
    /// The simulated arm.
    #[command(flatten)]
    pub plant: PlantArgs,
    /// Print the summary as JSON.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `breakaway`.
#[derive(Clone, Debug, Args)]
pub struct BreakawayArgs {
    /// The arm that moves.
    #[command(flatten)]
    pub moved: MovedArmArgs,
    /// Folder for the logs of --plant and calibration.json.
    #[arg(
        long,
        value_name = "DIR",
        default_value = "out/breakaway",
        requires = "on"
    )]
    pub out: PathBuf,
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
    /// Joints, counted from 0. Default: all, as always with --plant.
    #[arg(
        long,
        value_name = "J,J..",
        value_delimiter = ',',
        conflicts_with = "on"
    )]
    pub joints: Vec<usize>,
    /// Seed of the initial model and of all noise.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Torque ripple of the plant's motors, seen at the joints (N m). It is identified first from slow runs, then
    /// compensated; with --plant in-process it is not.
    #[arg(long, value_name = "NM", default_value_t = 0.0, value_parser = between(0.0, 100.0))]
    pub ripple: f64,
    /// The simulated arm.
    #[command(flatten)]
    pub plant: PlantArgs,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// The arm that is calibrated step by step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum CalibrationPlant {
    /// A simulated arm in this process, in virtual time.
    InProcess,
    /// A simulated arm on shared memory.
    Sim,
    /// A simulated arm on an emulated CAN bus: with motor pucks, safety module and pendant, or with Damiao motors.
    Emu,
    /// An arm on a CAN bus. The operator activates a WAM on its pendant; the program enables Damiao motors.
    Can,
    /// The arm of a running system; loading another model requires a restart of that system.
    Running,
}

/// Arguments of `calibrate`.
#[derive(Clone, Debug, Args)]
pub struct CalibrateArgs {
    /// The arm that moves.
    #[command(flatten)]
    pub moved: MovedArmArgs,
    /// Continue after the last finished step of the calibration in --out.
    #[arg(long, requires = "on")]
    pub resume: bool,
    /// Perform no step after this one, for example wiring, breakaway or validation_motion.
    #[arg(long, value_name = "STEP", requires = "on")]
    pub until: Option<StepName>,
    /// Duration of the warm-up (s).
    #[arg(long, value_name = "S", default_value_t = 7.0, requires = "on", value_parser = between(0.0, 3600.0))]
    pub warm_up: f64,
    /// Run at constant speeds, for torque ripple, also on an arm that falls without torque; others always do.
    #[arg(long, requires = "on")]
    pub ripple_runs: bool,
    /// Mass of a weight for the last link (kg). At the end the arm is set down, takes it and moves once more, which gives the ratio of
    /// true to commanded torque of each joint. A simulated arm takes it by itself; at any other somebody is asked to attach it.
    #[arg(long, value_name = "KG", requires = "on", value_parser = between(0.05, 20.0))]
    pub weight_kg: Option<f64>,
    /// Number of candidates of the design of the excitation.
    #[arg(
        long,
        value_name = "N",
        default_value_t = 600,
        requires = "on",
        value_parser = RangedU64ValueParser::<usize>::new().range(1..=MAX_CANDIDATES as u64)
    )]
    pub candidates: usize,
    /// A built-in arm, or the path of an arm's TOML, of its folder, or of a URDF: the simulated plant. Default: the arm of the
    /// running system with `running`, else `wam4`.
    #[arg(long, value_name = "NAME|PATH")]
    pub arm: Option<String>,
    /// Reject a URDF with elements or attributes that supple does not read, instead of only warning.
    #[arg(long)]
    pub strict: bool,
    /// What a URDF alone does not contain.
    #[command(flatten)]
    pub urdf: UrdfArgs,
    /// Folder for the identified arm, the reports and the logs.
    #[arg(long, value_name = "DIR", default_value = "out/calibrate")]
    pub out: PathBuf,
    /// Seed of the initial model and of all noise.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Torque ripple of the plant's motors, seen at the joints (N m).
    #[arg(long, value_name = "NM", default_value_t = 0.0, value_parser = between(0.0, 100.0))]
    pub ripple: f64,
    /// Simulate the plant without friction that depends on direction and load.
    #[arg(long)]
    pub no_load_friction: bool,
    /// Stop after identification; do not run the demo.
    #[arg(long)]
    pub no_demo: bool,
    /// The simulated arm.
    #[command(flatten)]
    pub plant: PlantArgs,
    /// Print the summary as JSON.
    #[arg(long)]
    pub json: bool,
    /// Print no progress.
    #[arg(long)]
    pub quiet: bool,
}

/// Arguments of `calibrate-paper`.
#[derive(Clone, Debug, Args)]
pub struct CalibratePaperArgs {
    /// Number of samples, spread over the excitation: at least the 1600 of the paper.
    #[arg(
        long,
        value_name = "N",
        default_value_t = MIN_SAMPLES,
        value_parser = RangedU64ValueParser::<usize>::new().range(MIN_SAMPLES as u64..=1_000_000)
    )]
    pub samples: usize,
    /// Seed of the starting model, of the design and of all noise.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Simulate the plant without friction that depends on direction and load.
    #[arg(long)]
    pub no_load_friction: bool,
    /// The simulated arm.
    #[command(flatten)]
    pub plant: PlantArgs,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
    /// Print no progress.
    #[arg(long)]
    pub quiet: bool,
}

/// Arguments of `learn`.
#[derive(Clone, Debug, Args)]
pub struct LearnArgs {
    /// Logs of the motion, supple's MCAP or CSV; the last periods are enough. With --plant the arm tracks the sinusoid at 5 N/m,
    /// which gives the log.
    #[arg(
        required_unless_present = "on",
        conflicts_with = "on",
        value_name = "LOG"
    )]
    pub logs: Vec<PathBuf>,
    /// The arm that moves.
    #[command(flatten)]
    pub moved: MovedArmArgs,
    /// The simulated arm.
    #[command(flatten)]
    pub plant: PlantArgs,
    /// Duration of the sinusoid (s).
    #[arg(long = "for", value_name = "S", default_value_t = 24.0, requires = "on", value_parser = between(10.0, 3600.0))]
    pub for_s: f64,
    /// Seed of the effects of the simulated arm.
    #[arg(long, value_name = "N", default_value_t = 0, requires = "on")]
    pub seed: u64,
    /// The model that the controller used: a built-in arm, or the path of a TOML or of its folder. With --plant the arm, whose
    /// controller may use another --model.
    #[arg(long, value_name = "NAME|PATH")]
    pub arm: String,
    /// Reject a URDF with elements or attributes that supple does not read, instead of only warning.
    #[arg(long)]
    pub strict: bool,
    /// What a URDF alone does not contain.
    #[command(flatten)]
    pub urdf: UrdfArgs,
    /// Folder for the refitted model.
    #[arg(long, value_name = "DIR", default_value = "out/learnt")]
    pub out: PathBuf,
    /// Use only the last part of each log, of this length (s). Default: all.
    #[arg(long, value_name = "S", value_parser = between(1e-3, 1e9))]
    pub last: Option<f64>,
    /// Also identify a payload of about this mass (kg).
    #[arg(long, value_name = "KG", value_parser = between(1e-6, 1e3))]
    pub payload: Option<f64>,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

impl IdentificationCommand {
    /// Whether the command prints JSON on standard output.
    pub fn json(&self) -> bool {
        match self {
            IdentificationCommand::Identify(args) => args.json,
            IdentificationCommand::Excite(ExciteCommand::Design(args)) => args.json,
            IdentificationCommand::Excite(ExciteCommand::Run(args)) => args.json,
            IdentificationCommand::Breakaway(args) => args.json,
            IdentificationCommand::Calibrate(args) => args.json,
            IdentificationCommand::CalibratePaper(args) => args.json,
            IdentificationCommand::Learn(args) => args.json,
        }
    }
}

fn pair(text: &str) -> Result<(usize, usize), String> {
    let parts = text.split_once('+');
    let number = |part: &str| part.trim().parse::<usize>();
    match parts.map(|(a, b)| (number(a), number(b))) {
        Some((Ok(a), Ok(b))) => Ok((a, b)),
        _ => Err("give two joints as 4+5".to_owned()),
    }
}
