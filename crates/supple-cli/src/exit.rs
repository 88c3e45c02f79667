//! Error type and exit codes of `supple` and `supple-report`. Every error prints one line.
//!
//! | code | meaning |
//! |---|---|
//! | 0 | success |
//! | 1 | a bug in supple: please report it |
//! | 2 | invalid command line |
//! | 3 | invalid arm description, or unknown arm |
//! | 4 | the arm cannot perform the experiment |
//! | 5 | a fault ended a run, or is latched in the running system; all results are written |
//! | 6 | a file cannot be read or written |
//! | 7 | a replay differs from the logged outputs |
//! | 8 | the machine does not meet the requirements: real time, or instructions of the processor |
//! | 9 | no model can be identified from the logs |
//! | 10 | no system is running, one of its processes cannot start or has exited, or a motor does not fit |
//! | 11 | the controller refused a request |
//! | 12 | a test case of `supple drill` failed |
//! | 130 | interrupted |

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use supple_experiment::ExperimentError;
use supple_experiment::procedure::ProcedureError;
use supple_experiment::teaching::PointsError;
use supple_ident::{IdentError, ReadError, SaveError};
use supple_log::LogError;
use supple_model::{DhError, ModelError};
use supple_plant::{InjectionError, PlantOptionsError};

/// Table of the exit codes, printed at the end of `--help`.
pub const CODES: &str = "Exit codes:
  0    success
  1    a bug in supple: please report it
  2    invalid command line
  3    invalid arm description, or unknown arm
  4    the arm cannot perform the experiment
  5    a fault ended a run, or is latched in the running system; all results are written
  6    a file cannot be read or written
  7    a replay differs from the logged outputs
  8    the machine does not meet the requirements: real time, or instructions of the processor
  9    no model can be identified from the logs
  10   no system is running, one of its processes cannot start or has exited, or a motor does not fit
  11   the controller refused a request
  12   a test case of `supple drill` failed
  130  interrupted";

/// Error of a command. Each message is one line with the cause and the remedy.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// The name is neither a built-in arm nor a file.
    #[error(
        "`{found}` is neither a built-in arm nor an existing file; give one of {known}, or the path of an \
         arm's TOML or of its folder"
    )]
    UnknownArm {
        /// Name or path given by the user.
        found: String,
        /// Names of the built-in arms.
        known: String,
    },
    /// The arm description is invalid.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A Denavit-Hartenberg table is invalid.
    #[error("{}: {error}", file.display())]
    DhTable {
        /// The file.
        file: PathBuf,
        /// The error.
        error: DhError,
    },
    /// An experiment could not be run.
    #[error(transparent)]
    Experiment(#[from] ExperimentError),
    /// A calibration ended early.
    #[error(transparent)]
    Procedure(#[from] ProcedureError),
    /// The command needs the program `supple`.
    #[error("{option} starts processes, which `supple-report` cannot: use the program `supple`")]
    NeedsSupple {
        /// The option.
        option: &'static str,
    },
    /// Loading another model in virtual time is not supported with this plant.
    #[error("--virtual-time loads models with the plant `emu` only: use that, or leave it out")]
    VirtualTimeNeedsEmu,
    /// The operator or a signal interrupted a calibration, whose logs are complete.
    #[error("interrupted; all logs are complete, a calibration continues with --resume")]
    Interrupted,
    /// Another operator requested a mode during a calibration, whose logs are complete.
    #[error(
        "another operator requested mode {mode}: this command has ended and sends no further requests; all logs are complete, \
         a calibration continues with --resume"
    )]
    OtherMode {
        /// Name of the mode.
        mode: &'static str,
    },
    /// The drives did not become active.
    #[error(
        "the drives did not become active: release the emergency stop, press Shift-Idle and then Shift-Activate on the \
         pendant, and start again (a calibration continues with --resume)"
    )]
    DrivesNotActive,
    /// The running system needs another model.
    #[error(
        "the controller of the running system needs the model of {}: stop the system, start it again with \
         `--arm {}`, and continue with --resume",
        folder.display(), folder.display()
    )]
    OtherModelNeeded {
        /// Folder of the model.
        folder: PathBuf,
    },
    /// A running system cannot be stopped for a weight.
    #[error(
        "a running system keeps its torque, and no weight can be attached: end it, and give --plant can instead of running"
    )]
    WeightNeedsOwnSystem,
    /// A fault ended one or more runs; all results are written.
    #[error("a fault ended {runs}; the results are in {}, with the fault in the report", out.display())]
    Fault {
        /// Runs and their faults.
        runs: String,
        /// Folder of the results.
        out: PathBuf,
    },
    /// A fault ended the run of a complete system; its log is written.
    #[error("a fault ended the run: {faults}; `supple log info` shows its time in the log")]
    RunFault {
        /// Descriptions of the faults.
        faults: String,
    },
    /// The request was accepted, but the system has a latched fault.
    #[error(
        "a fault is latched (see `supple status`): remove its cause, then clear it with `supple reset`"
    )]
    SystemInFault,
    /// The log ended before the end of the run.
    #[error("the log ends before the end of the run: {cause}")]
    LogEnded {
        /// The cause, with the file and the remedy.
        cause: Box<Failure>,
    },
    /// The trace of a simulated arm ended before the end of the run.
    #[error(
        "the trace is incomplete, see the message of {name} above; all other output is complete"
    )]
    TraceEnded {
        /// The process that writes the trace.
        name: &'static str,
    },
    /// Shared memory of a running system, or the address of its bus. The error is
    /// boxed, so that a program that runs no system does not link them.
    #[error(transparent)]
    System(Box<dyn std::error::Error + Send + Sync>),
    /// The pendant of an emulated arm does not answer.
    #[error(
        "the pendant at {} does not answer: {cause}; only an emulated arm has this pendant, start one with \
         `supple up --plant emu`", socket.display()
    )]
    Pendant {
        /// Socket of the pendant.
        socket: PathBuf,
        /// Error of the operating system, or the reply.
        cause: String,
    },
    /// No arm waits for `supple at-home`.
    #[error(
        "no arm asks for its home pose: this is needed only after an emergency stop, after the power has returned (release the button, \
         press Shift-Idle); if the stop was pressed again, repeat these steps and confirm again"
    )]
    NoArmWaits,
    /// The home pose was not confirmed.
    #[error(
        "the home pose was not confirmed and no position was changed: answer y on a terminal, or give --yes"
    )]
    NotConfirmed,
    /// Virtual time was requested for a real CAN bus.
    #[error("--virtual-time is not possible with a CAN interface: omit it, or use --plant emu")]
    VirtualTimeOnRealBus,
    /// A system with this prefix is already running.
    #[error(
        "a system is already running under the prefix `{prefix}` (process {process}): end it with \
         `supple stop`, or choose another --prefix"
    )]
    AlreadyRunning {
        /// The prefix.
        prefix: String,
        /// PID of its `supple up`.
        process: i32,
    },
    /// A program that must be installed in the same folder is missing.
    #[error(
        "{} is missing: build it with `cargo build --release -p {name}`, or install it beside this \
         program", program.display()
    )]
    MissingProgram {
        /// Name of the package and of the program.
        name: &'static str,
        /// Expected path.
        program: PathBuf,
    },
    /// The named process is not part of this system.
    #[error("the system has no process {name}: see `supple drill --list`")]
    NoSuchProcess {
        /// Name of the process.
        name: &'static str,
    },
    /// A process of the system exited unexpectedly.
    #[error("{name} exited ({status}); see its output above")]
    ProcessEnded {
        /// Name of the process.
        name: &'static str,
        /// Exit status of the process.
        status: String,
    },
    /// A fault test was requested for a real arm.
    #[error("the fault test lets the arm fall: use --plant sim or --plant emu")]
    FaultTestOnRealArm,
    /// No test case matches the given patterns.
    #[error("no test case matches {patterns}: see `supple drill --list`")]
    NoSuchTestCase {
        /// Patterns given by the user.
        patterns: String,
    },
    /// The plant does not support an injected fault.
    #[error("--inject: {0}")]
    Injection(#[from] InjectionError),
    /// A file of plant options is invalid.
    #[error(transparent)]
    PlantOptions(#[from] PlantOptionsError),
    /// No effect matches the given texts.
    #[error("no effect of `supple effects` contains {text}: omit --only to see all names")]
    NoSuchEffect {
        /// Texts given by the user.
        text: String,
    },
    /// Fault injection was requested for a real arm.
    #[error("--inject works only with a simulated arm: use --plant sim or --plant emu")]
    InjectionIntoRealArm,
    /// Misbehaviour was requested of an arm that is not emulated with Damiao motors.
    #[error(
        "--misbehave is for emulated Damiao motors: use --plant emu with an arm that has [bus], such as openarm or yam"
    )]
    MisbehaviourWithoutMotors,
    /// The plant has no drives for this arm.
    #[error(
        "--plant {plant} has drives for a WAM with 4 or 7 joints and for arms with [bus] in their TOML; `{arm}` has {joints} joints \
         and no [bus]: use --plant sim"
    )]
    NoDrivesForArm {
        /// The plant.
        plant: &'static str,
        /// Name of the arm.
        arm: String,
        /// Its joints.
        joints: usize,
    },
    /// A shutdown can only hold an arm whose motors do not brake.
    #[error(
        "--hold-until-supported: the motors of `{arm}` brake without torque on this plant: leave the option out"
    )]
    ArmHasBrakes {
        /// Name of the arm.
        arm: String,
    },
    /// Options of a simulated arm were given for a real one.
    #[error(
        "--plant-options, --realistic, --block-m, --trace and --start-error work only with a simulated arm: use --plant sim or --plant emu"
    )]
    OptionsOfRealArm,
    /// An option of an arm on a bus was given for an arm without one.
    #[error("{option} is for an arm on a bus: omit it, or use --plant emu or --plant can")]
    NoBus {
        /// The option.
        option: &'static str,
    },
    /// The hand of an emulated arm waits for a mode, but the emulator does not know the mode of the controller.
    #[error(
        "an emulated arm does not know when float begins: set `when = \"active\"` in [hand] of the plant options, or use \
         --plant sim"
    )]
    HandNeedsMode,
    /// A model was given for a running system.
    #[error(
        "a running system keeps its model: start it with `supple up --arm {0}`, and leave --model out", model.display()
    )]
    ModelOfRunningSystem {
        /// The given model.
        model: PathBuf,
    },
    /// Effects that only the arm in this process has.
    #[error(
        "--ripple and --no-load-friction change the arm of --plant in-process: give other simulated arms --plant-options, and leave \
         these options out"
    )]
    EffectsOfInProcess,
    /// The folder of the results has a calibration that has gone further.
    #[error(
        "{} has a calibration that has gone further, which would be lost: give another --out", file.display()
    )]
    CalibrationWouldBeLost {
        /// The file of the calibration.
        file: PathBuf,
    },
    /// Effects of a simulated arm were given with logs.
    #[error(
        "--realistic and --plant-options are effects of a simulated arm, which a log does not need: leave them out, or give \
         --plant instead of the log"
    )]
    EffectsWithoutArm,
    /// The system under test did not reach tracking mode.
    #[error(
        "the system did not reach tracking mode within 20 s in three attempts: see the messages of its \
         processes above, or run `supple doctor`"
    )]
    DidNotReachTracking,
    /// The result of some test cases differs from the expected result.
    #[error("unexpected results: {rows}; see the table above")]
    Drill {
        /// Names of the test cases.
        rows: String,
    },
    /// No system answers.
    #[error(
        "no system answers under the prefix `{prefix}`: start one with `supple up`, or choose another \
         with --prefix"
    )]
    NotRunning {
        /// The prefix.
        prefix: String,
    },
    /// The plant holds an arm without brakes and lays it down.
    #[error(
        "the arm is being held and laid down, which gravity hold does not end: wait until `supple status` shows `drives idle`, \
         then `supple reset` after a fault, `supple mode idle`, `supple mode gravity-hold`"
    )]
    ArmIsLaidDown,
    /// The process of the controller runs but does not answer.
    #[error(
        "the controller under the prefix `{prefix}` runs but does not answer: the process is stopped or hangs. The plant \
         sets the drives to idle 10 ms after the last answer: motors brake, an arm without brakes is laid down. If the arm moves, \
         press the emergency stop; end the system with `supple stop`"
    )]
    ControllerHangs {
        /// The prefix.
        prefix: String,
    },
    /// No learned terms exist that could be saved.
    #[error(
        "nothing is learned yet: begin with `supple learning on`, let the arm move freely for some seconds, and save \
         again"
    )]
    NothingLearned,
    /// An option has the wrong number of values.
    #[error("{option} has {found} values: give {expected}")]
    ValueCount {
        /// The option.
        option: &'static str,
        /// Number of values given by the user.
        found: usize,
        /// Valid numbers of values, as text.
        expected: String,
    },
    /// The controller refused the request.
    #[error("the controller refused the request: {reason}")]
    Refused {
        /// Reason given by the controller.
        reason: String,
    },
    /// A file of a motion is invalid, or cannot be written.
    #[error(transparent)]
    Points(Box<PointsError>),
    /// A motion cannot be repeated, or was not repeated.
    #[error("{}: {reason}; change the file, or teach another motion", file.display())]
    Motion {
        /// File of the motion.
        file: PathBuf,
        /// The reason.
        reason: String,
    },
    /// The arm was not guided during a recording.
    #[error(
        "the arm stood still during the whole recording, no file was written: guide it by hand in float"
    )]
    NothingTaught,
    /// The running system has another arm.
    #[error(
        "the arm {arm} has {joints}, the arm of the running system has {running}: give that arm with --arm {named}"
    )]
    OtherArm {
        /// Name of the given arm.
        arm: String,
        /// Its joints: their number, or their names if only these differ.
        joints: String,
        /// The joints of the arm of the running system.
        running: String,
        /// Name of the arm of the running system, if it is known.
        named: String,
    },
    /// A log cannot be read or written.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The log still has the temporary name of an incomplete log.
    #[error(
        "cannot read {}: it does not exist; its writer was killed or still writes {part}: read that file, or `supple log recover \
         {part}`", log.display(), part = part.display()
    )]
    UnfinishedLog {
        /// The log.
        log: PathBuf,
        /// The incomplete log.
        part: PathBuf,
    },
    /// A replay differs from the logged run.
    #[error(
        "{different} of {steps} steps of {} differ from the logged outputs; the log was written by \
         another version of the controller, or was modified",
        path.display()
    )]
    ReplayMismatch {
        /// The log.
        path: PathBuf,
        /// Number of steps that differ.
        different: u64,
        /// Number of all steps.
        steps: u64,
    },
    /// A motor does not answer, does not match the arm's description, or refuses a register write.
    #[error("{problem}")]
    Motors {
        /// Problem and remedy.
        problem: String,
    },
    /// The machine does not meet the real-time requirements.
    #[error("this machine is not ready for real time: {failed}; see the remedies above")]
    NotReady {
        /// Names of the checks that failed.
        failed: String,
    },
    /// No model can be identified from the logs.
    #[error(transparent)]
    Ident(#[from] IdentError),
    /// A log cannot be used for identification.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A model cannot be described or saved.
    #[error(transparent)]
    Save(#[from] SaveError),
    /// A file cannot be read or written.
    #[error("cannot {action} {}: {error}; {remedy}", path.display())]
    File {
        /// The failed action: `create`, `write`, `rename` ...
        action: &'static str,
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        error: std::io::Error,
        /// The remedy.
        remedy: &'static str,
    },
    /// The output file exists.
    #[error("{} exists; give another name, or --force to replace it", path.display())]
    Exists {
        /// Path of the file.
        path: PathBuf,
    },
    /// Two outputs of a run have the same name.
    #[error(
        "--trace {} is the file of --log {}: the log would replace the trace; give them different names", trace.display(),
        log.display()
    )]
    SameOutput {
        /// The trace.
        trace: PathBuf,
        /// The log.
        log: PathBuf,
    },
    /// Another run writes a log of this name.
    #[error(
        "--trace {}: another run writes its log {} and would replace the trace; give another file", trace.display(),
        log.display()
    )]
    OutputInUse {
        /// The trace.
        trace: PathBuf,
        /// The log that is being written.
        log: PathBuf,
    },
    /// A figure cannot be drawn.
    #[error("{0}; this is a bug, please report it")]
    Figure(String),
    /// The report or the summary cannot be generated.
    #[error("cannot generate the report: {0}; this is a bug, please report it")]
    ReportGeneration(String),
}

impl Failure {
    /// Creates the failure for a result that cannot be written to standard output.
    pub fn standard_output(error: std::io::Error) -> Failure {
        Failure::File {
            action: "write",
            path: PathBuf::from("standard output"),
            error,
            remedy: "redirect it to a file on a disk with free space, or to a pipe that is read",
        }
    }

    /// Creates the failure of a file operation, with a remedy for its error.
    pub fn file(action: &'static str, path: &Path, error: std::io::Error) -> Failure {
        use std::io::ErrorKind;
        let remedy = match error.kind() {
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge => {
                "free disk space, or choose another folder with --out"
            }
            ErrorKind::InvalidInput | ErrorKind::IsADirectory => {
                "name a regular file or a new file in an existing folder"
            }
            _ if action == "read" => "name a file that exists and that this user may read",
            _ => "choose a writable folder with --out",
        };
        Failure::File {
            action,
            path: path.to_owned(),
            error,
            remedy,
        }
    }

    /// Creates the failure of a running system's shared memory or bus.
    pub fn system(error: impl std::error::Error + Send + Sync + 'static) -> Failure {
        Failure::System(Box::new(error))
    }

    /// Returns the short name of the error that `--json` prints.
    pub fn kind(&self) -> &'static str {
        match self.code() {
            2 => "usage",
            3 => "description",
            4 => "experiment",
            5 => "fault",
            6 => "file",
            7 => "replay",
            10 => "system",
            11 => "refused",
            8 => "machine",
            12 => "drill",
            9 => "identification",
            130 => "interrupted",
            _ => "internal",
        }
    }

    /// Whether the results, which include the error, have been printed to standard output.
    pub fn comes_with_results(&self) -> bool {
        matches!(
            self,
            Failure::Fault { .. }
                | Failure::SystemInFault
                | Failure::ReplayMismatch { .. }
                | Failure::NotReady { .. }
                | Failure::Drill { .. }
                | Failure::RunFault { .. }
                | Failure::LogEnded { .. }
                | Failure::TraceEnded { .. }
        )
    }

    /// Exit code, see the table of the module.
    pub fn code(&self) -> u8 {
        match self {
            Failure::UnknownArm { .. } | Failure::Model(_) | Failure::DhTable { .. } => 3,
            Failure::Experiment(error) => experiment_code(error),
            Failure::Procedure(error) => procedure_code(error),
            Failure::NeedsSupple { .. } | Failure::VirtualTimeNeedsEmu => 2,
            Failure::Interrupted | Failure::OtherMode { .. } => 130,
            Failure::DrivesNotActive
            | Failure::OtherModelNeeded { .. }
            | Failure::WeightNeedsOwnSystem => 10,
            Failure::Fault { .. } | Failure::RunFault { .. } | Failure::SystemInFault => 5,
            Failure::Log(error) => log_code(error),
            Failure::File { .. }
            | Failure::UnfinishedLog { .. }
            | Failure::Exists { .. }
            | Failure::SameOutput { .. }
            | Failure::OutputInUse { .. }
            | Failure::LogEnded { .. }
            | Failure::TraceEnded { .. } => 6,
            Failure::ReplayMismatch { .. } => 7,
            Failure::NotReady { .. } => 8,
            Failure::Ident(_) => 9,
            Failure::Read(error) => read_code(error),
            Failure::Save(error) => save_code(error),
            Failure::VirtualTimeOnRealBus
            | Failure::FaultTestOnRealArm
            | Failure::ValueCount { .. } => 2,
            Failure::Injection(_) | Failure::InjectionIntoRealArm => 2,
            Failure::OptionsOfRealArm
            | Failure::MisbehaviourWithoutMotors
            | Failure::NoDrivesForArm { .. }
            | Failure::ArmHasBrakes { .. } => 2,
            Failure::EffectsWithoutArm
            | Failure::ModelOfRunningSystem { .. }
            | Failure::EffectsOfInProcess
            | Failure::CalibrationWouldBeLost { .. } => 2,
            Failure::HandNeedsMode | Failure::NoBus { .. } | Failure::NoSuchEffect { .. } => 2,
            Failure::PlantOptions(error) => plant_options_code(error),
            Failure::NoSuchProcess { .. } | Failure::NoSuchTestCase { .. } => 2,
            Failure::Drill { .. } | Failure::DidNotReachTracking => 12,
            Failure::System(_)
            | Failure::Pendant { .. }
            | Failure::Motors { .. }
            | Failure::AlreadyRunning { .. }
            | Failure::MissingProgram { .. }
            | Failure::ProcessEnded { .. }
            | Failure::ControllerHangs { .. }
            | Failure::NotRunning { .. } => 10,
            Failure::NoArmWaits | Failure::NotConfirmed => 11,
            Failure::Refused { .. } | Failure::NothingLearned | Failure::ArmIsLaidDown => 11,
            Failure::Points(error) => match **error {
                PointsError::File { .. } => 6,
                _ => 3,
            },
            Failure::OtherArm { .. } => 3,
            Failure::Motion { .. } | Failure::NothingTaught => 4,
            Failure::Figure(_) | Failure::ReportGeneration(_) => 1,
        }
    }
}

fn procedure_code(error: &ProcedureError) -> u8 {
    match error {
        ProcedureError::Experiment(error) => experiment_code(error),
        ProcedureError::Wiring { .. }
        | ProcedureError::NotConfirmed { .. }
        | ProcedureError::HeavyWeight { .. }
        | ProcedureError::NoWeight => 4,
        ProcedureError::Stopped { .. } => 5,
        ProcedureError::Resume { .. }
        | ProcedureError::ReadLog { .. }
        | ProcedureError::Write { .. } => 6,
    }
}

/// Returns the exit code; errors caused by the arm description get the code of the description.
fn experiment_code(error: &ExperimentError) -> u8 {
    match error {
        ExperimentError::Model(_)
        | ExperimentError::Arm(_)
        | ExperimentError::Config(_)
        | ExperimentError::Plant(_)
        | ExperimentError::Injection(_) => 3,
        ExperimentError::BeyondJointStop { .. }
        | ExperimentError::Refused { .. }
        | ExperimentError::FaultAtStart { .. }
        | ExperimentError::Fault { .. }
        | ExperimentError::Stuck { .. } => 4,
        ExperimentError::Interrupted => 130,
        ExperimentError::Ident(_) => 9,
        ExperimentError::Save(error) => save_code(error),
        ExperimentError::Log(error) => log_code(error),
    }
}

fn plant_options_code(error: &PlantOptionsError) -> u8 {
    match error {
        PlantOptionsError::UnknownSet { .. } => 2,
        PlantOptionsError::File { .. } => 6,
        PlantOptionsError::Toml { .. }
        | PlantOptionsError::Value { .. }
        | PlantOptionsError::Needs { .. } => 3,
    }
}

fn read_code(error: &ReadError) -> u8 {
    match error {
        ReadError::Mcap(error) => log_code(error),
        ReadError::File { .. } => 6,
        ReadError::Table { .. } => 9,
    }
}

fn save_code(error: &SaveError) -> u8 {
    match error {
        SaveError::Fit(_) => 9,
        SaveError::Model(ModelError::Write { .. }) => 6,
        SaveError::Model(_) => 3,
    }
}

fn log_code(error: &LogError) -> u8 {
    match error {
        LogError::Model(_) => 3,
        _ => 6,
    }
}

impl From<&Failure> for ExitCode {
    fn from(failure: &Failure) -> ExitCode {
        ExitCode::from(failure.code())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::io::ErrorKind;
    use supple_plant::PlantOptions;

    /// Codes of the table that no [`Failure`] has: success, command-line errors of clap, interrupted.
    const ELSEWHERE: [u8; 3] = [0, 2, 130];

    /// Parses the table of `--help` into codes and meanings.
    fn rows() -> Vec<(u8, &'static str)> {
        let rows = CODES.lines().skip(1).map(|line| {
            let (code, meaning) = line.trim().split_once(' ').expect("a code and its meaning");
            (code.parse().expect("a number"), meaning.trim())
        });
        rows.collect()
    }

    fn io() -> std::io::Error {
        ErrorKind::StorageFull.into()
    }

    /// Returns a failure of each kind, with a part of the meaning of its code.
    fn failures() -> Vec<(Failure, &'static str)> {
        let text = String::new;
        let path = || PathBuf::from("file");
        let model = || ModelError::Dof { found: 2 };
        let mcap = || LogError::Busy { file: text() };
        let ident = || IdentError::Shape {
            argument: text(),
            expected: text(),
            found: text(),
        };
        let file = || Failure::file("write", Path::new("file"), io());
        let arm = "invalid arm description";
        let (fault, disk, system) = ("a fault", "a file cannot be", "no system is running");
        let runs = text();
        let plant = |set| PlantOptions::set(set).expect_err("unknown");
        let plant_file = |toml| PlantOptions::from_toml(toml, "file").expect_err("invalid");
        vec![
            (Failure::ReportGeneration(text()), "a bug"),
            (Failure::VirtualTimeOnRealBus, "invalid command line"),
            (Failure::FaultTestOnRealArm, "invalid command line"),
            (Failure::NoSuchProcess { name: "" }, "invalid command line"),
            (Failure::EffectsWithoutArm, "invalid command line"),
            (Failure::EffectsOfInProcess, "invalid command line"),
            (
                Failure::ModelOfRunningSystem {
                    model: PathBuf::from("a"),
                },
                "invalid command line",
            ),
            (
                Failure::CalibrationWouldBeLost {
                    file: PathBuf::from("a"),
                },
                "invalid command line",
            ),
            (Failure::OptionsOfRealArm, "invalid command line"),
            (Failure::NoBus { option: "" }, "invalid command line"),
            (Failure::MisbehaviourWithoutMotors, "invalid command line"),
            (
                Failure::NoSuchEffect { text: text() },
                "invalid command line",
            ),
            (plant("surreal").into(), "invalid command line"),
            (plant_file("base_tilt_rad = 9").into(), arm),
            (plant_file("tilt = 9").into(), arm),
            (Failure::Model(model()), arm),
            (
                Failure::DhTable {
                    file: PathBuf::from("a.csv"),
                    error: DhError::Rows { found: 0 },
                },
                arm,
            ),
            (
                Failure::UnknownArm {
                    found: text(),
                    known: text(),
                },
                arm,
            ),
            (Failure::Log(LogError::Model(model())), arm),
            (Failure::Save(SaveError::Model(model())), arm),
            (Failure::Experiment(ExperimentError::Model(model())), arm),
            (Failure::Fault { runs, out: path() }, fault),
            (Failure::RunFault { faults: text() }, fault),
            (Failure::SystemInFault, fault),
            (
                Failure::Procedure(ProcedureError::Stopped {
                    motion: text(),
                    fault: text(),
                    remedy: "",
                }),
                fault,
            ),
            (
                Failure::Procedure(ProcedureError::Wiring {
                    problem: text(),
                    remedy: text(),
                }),
                "the arm cannot perform",
            ),
            (Failure::Interrupted, "interrupted"),
            (Failure::OtherMode { mode: "idle" }, "interrupted"),
            (Failure::DrivesNotActive, system),
            (file(), disk),
            (Failure::Exists { path: path() }, disk),
            (
                Failure::SameOutput {
                    trace: path(),
                    log: path(),
                },
                disk,
            ),
            (
                Failure::OutputInUse {
                    trace: path(),
                    log: path(),
                },
                disk,
            ),
            (Failure::Log(mcap()), disk),
            (Failure::Read(ReadError::Mcap(mcap())), disk),
            (
                Failure::LogEnded {
                    cause: Box::new(file()),
                },
                disk,
            ),
            (Failure::TraceEnded { name: "supple-sim" }, disk),
            (
                Failure::Save(SaveError::Model(ModelError::Write {
                    file: text(),
                    error: io(),
                })),
                disk,
            ),
            (
                Failure::ReplayMismatch {
                    path: path(),
                    different: 1,
                    steps: 2,
                },
                "a replay",
            ),
            (Failure::NotReady { failed: text() }, "the machine"),
            (Failure::Ident(ident()), "no model can be identified"),
            (
                Failure::Save(SaveError::Fit(ident())),
                "no model can be identified",
            ),
            (
                Failure::Experiment(ExperimentError::Ident(ident())),
                "no model can be identified",
            ),
            (Failure::NotRunning { prefix: text() }, system),
            (Failure::ControllerHangs { prefix: text() }, system),
            (
                Failure::ProcessEnded {
                    name: "",
                    status: text(),
                },
                system,
            ),
            (
                Failure::AlreadyRunning {
                    prefix: text(),
                    process: 1,
                },
                system,
            ),
            (
                Failure::MissingProgram {
                    name: "",
                    program: path(),
                },
                system,
            ),
            (
                Failure::Pendant {
                    socket: path(),
                    cause: text(),
                },
                system,
            ),
            (Failure::Motors { problem: text() }, system),
            (Failure::Refused { reason: text() }, "refused a request"),
            (Failure::ArmIsLaidDown, "refused a request"),
            (Failure::NoArmWaits, "refused a request"),
            (Failure::NotConfirmed, "refused a request"),
            (Failure::DidNotReachTracking, "supple drill"),
            (Failure::Drill { rows: text() }, "supple drill"),
            (
                Failure::Experiment(ExperimentError::Stuck {
                    joint: text(),
                    torque_nm: 1.0,
                }),
                "the arm cannot perform",
            ),
        ]
    }

    #[test]
    fn every_failure_has_a_documented_code_and_every_code_a_failure() {
        let rows = rows();
        let mut seen = BTreeSet::from(ELSEWHERE);
        for (failure, meaning_part) in failures() {
            let code = failure.code();
            let row = rows.iter().find(|(of, _)| *of == code);
            let (_, meaning) = row.unwrap_or_else(|| panic!("{code} of {failure} is in no row"));
            assert!(
                meaning.contains(meaning_part),
                "{failure}: {code} is `{meaning}`"
            );
            assert_ne!(failure.kind(), "", "{failure}");
            assert_eq!(failure.kind() == "internal", code == 1, "{failure}");
            seen.insert(code);
        }
        let stated: BTreeSet<u8> = rows.iter().map(|(code, _)| *code).collect();
        assert_eq!(seen, stated);
        assert_eq!(stated.len(), rows.len(), "a code has one row");
    }

    /// Compares the table of the module documentation with the table of `--help`.
    #[test]
    fn module_documentation_and_help_have_the_same_codes() {
        let source = include_str!("exit.rs");
        let documented: Vec<(u8, &str)> = source
            .lines()
            .filter_map(|line| {
                line.strip_prefix("//! | ")?
                    .strip_suffix(" |")?
                    .split_once(" | ")
            })
            .filter_map(|(code, meaning)| Some((code.parse().ok()?, meaning)))
            .collect();
        assert_eq!(documented, rows());
    }
}
