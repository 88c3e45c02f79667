//! How the program ends when it does not end well: one type, one code, one line.
//!
//! | code | meaning |
//! |---|---|
//! | 0 | done |
//! | 1 | a defect of the program: please report it |
//! | 2 | wrong use of the command line |
//! | 3 | the description of the arm is wrong, or there is no such arm |
//! | 4 | the arm cannot do the experiment |
//! | 5 | a fault ended a run, or is latched in the system that was asked; all results are written |
//! | 6 | a file cannot be read or written |
//! | 7 | a replay does not give the logged answers |
//! | 8 | the machine cannot run an arm in real time as it should |
//! | 9 | the logs do not give a model |
//! | 10 | no system runs, or a process of it cannot start or has ended |
//! | 11 | the controller refused a request |
//! | 12 | a drill did not end as it should |
//! | 130 | interrupted |

use crate::figures::FigureError;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use supple_bus::BusError;
use supple_experiment::ExperimentError;
use supple_ident::{IdentError, ReadError, SaveError};
use supple_ipc::IpcError;
use supple_log::LogError;
use supple_model::ModelError;
use supple_plant::InjectionError;

/// The codes in words, as `--help` ends.
pub const CODES: &str = "Exit codes:
  0    done
  1    a defect of the program: please report it
  2    wrong use of the command line
  3    the description of the arm is wrong, or there is no such arm
  4    the arm cannot do the experiment
  5    a fault ended a run, or is latched in the system that was asked; all results are written
  6    a file cannot be read or written
  7    a replay does not give the logged answers
  8    the machine cannot run an arm in real time as it should
  9    the logs do not give a model
  10   no system runs, or a process of it cannot start or has ended
  11   the controller refused a request
  12   a drill did not end as it should
  130  interrupted";

/// Why the program did not do what it was asked for. One line that names the cause and the remedy.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// Neither a built-in arm nor a file.
    #[error(
        "no arm named `{found}` is built in and there is no such file; give one of {known}, or the \
         path of an arm's TOML or of its folder"
    )]
    UnknownArm {
        /// What was asked for.
        found: String,
        /// Built-in arms.
        known: String,
    },
    /// The description of the arm.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// An experiment that could not be run.
    #[error(transparent)]
    Experiment(#[from] ExperimentError),
    /// Runs ended by a fault, with all results written.
    #[error("a fault ended {runs}; the results are in {}, with the fault in the report", out.display())]
    Fault {
        /// Runs and their faults.
        runs: String,
        /// Where the results are.
        out: PathBuf,
    },
    /// A run of a whole system ended by a fault, its log written.
    #[error("a fault ended the run: {faults}; `supple log info` shows where in the log")]
    RunFault {
        /// The faults in words.
        faults: String,
    },
    /// A request was accepted by a system that is in a fault.
    #[error(
        "the system is in a fault: `supple status` says in which, `supple reset` takes it out once the \
         cause is gone"
    )]
    InFault,
    /// A log that ended before its run, the run being over.
    #[error("the log ends before the run: {cause}")]
    LogEnded {
        /// Why, with the file and the remedy.
        cause: Box<Failure>,
    },
    /// The trace of a simulated arm ended before its run.
    #[error("the trace ends before the run, as {name} says above; all else is whole")]
    TraceEnded {
        /// The process that wrote it.
        name: &'static str,
    },
    /// Shared memory.
    #[error(transparent)]
    Ipc(#[from] IpcError),
    /// Where the arm's bus is.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// An emulated arm's pendant that does not answer.
    #[error(
        "the pendant at {} does not answer: {cause}; an emulated arm has one, start it with `supple up \
         --plant emu`", socket.display()
    )]
    Pendant {
        /// Its socket.
        socket: PathBuf,
        /// What the system says, or what came back.
        cause: String,
    },
    /// A clock that an arm cannot have.
    #[error(
        "an arm on a CAN interface keeps its own time: leave out --virtual-time, or use --plant emu"
    )]
    RealClock,
    /// A system of that name is there.
    #[error(
        "a system runs already under the prefix `{prefix}`, by process {process}: `supple stop` ends it, \
         or choose another --prefix"
    )]
    AlreadyRunning {
        /// The prefix.
        prefix: String,
        /// Its `supple up`.
        process: i32,
    },
    /// A program that belongs beside this one.
    #[error(
        "{} is missing: build it with `cargo build --release -p {name}`, or install it beside this \
         program", program.display()
    )]
    NoSibling {
        /// Its package and name.
        name: &'static str,
        /// Where it should be.
        program: PathBuf,
    },
    /// A process that the system has not.
    #[error("no process {name} belongs to this system: see `supple drill` for those there are")]
    NoSuchProcess {
        /// Which.
        name: &'static str,
    },
    /// A process of the system ended when it should not have.
    #[error("{name} has ended ({status}); its own words are above")]
    ProcessEnded {
        /// Which.
        name: &'static str,
        /// How.
        status: String,
    },
    /// A drill with people's limbs within reach.
    #[error(
        "a drill drops the arm on what is beneath it: only --plant sim and --plant emu have one"
    )]
    RealArm,
    /// No row of the drill has such a name.
    #[error("no row of the drill contains {patterns}: see `supple drill --list`")]
    NoSuchRow {
        /// What was asked for.
        patterns: String,
    },
    /// A fault to be put into an arm, that it cannot have.
    #[error("--inject: {0}")]
    Injection(#[from] InjectionError),
    /// A fault to be put into a real arm.
    #[error("--inject puts faults into a simulated arm: use --plant sim or --plant emu")]
    InjectionIntoRealArm,
    /// A system that is to be drilled and does not work.
    #[error(
        "the system did not come to track within 20 s, three times: its processes say why above; \
         `supple doctor` looks at the machine"
    )]
    NotTracking,
    /// A loss that was not met as it should have been.
    #[error("the drill did not end as it should: {rows}; the table above says what was expected")]
    Drill {
        /// The losses.
        rows: String,
    },
    /// No answer.
    #[error(
        "no system answers under the prefix `{prefix}`: start one with `supple up`, or choose another \
         with --prefix"
    )]
    NotRunning {
        /// The prefix.
        prefix: String,
    },
    /// The controller says no.
    #[error("the controller says: {words}")]
    Refused {
        /// Its words.
        words: String,
    },
    /// A log.
    #[error(transparent)]
    Log(#[from] LogError),
    /// A replay that is not the run.
    #[error(
        "{different} of {steps} steps of {} do not give the logged answers; the log is of another \
         version of the controller, or was changed",
        path.display()
    )]
    Different {
        /// The log.
        path: PathBuf,
        /// Steps that differ.
        different: u64,
        /// All steps.
        steps: u64,
    },
    /// A machine that is not ready for real time.
    #[error("this machine is not ready for real time: {failed}; each line above says what to do")]
    NotReady {
        /// Names of the checks that failed.
        failed: String,
    },
    /// Logs that give no model.
    #[error(transparent)]
    Ident(#[from] IdentError),
    /// A log that cannot be taken for identification.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A model that cannot be described or saved.
    #[error(transparent)]
    Save(#[from] SaveError),
    /// A file.
    #[error("cannot {action} {}: {error}; {remedy}", path.display())]
    File {
        /// What was tried: `create`, `write`, `rename` ...
        action: &'static str,
        /// Which.
        path: PathBuf,
        /// What the system says.
        error: std::io::Error,
        /// What to do about it.
        remedy: &'static str,
    },
    /// A file that would be replaced.
    #[error("{} exists; give another name, or --force to replace it", path.display())]
    Exists {
        /// Which.
        path: PathBuf,
    },
    /// A figure.
    #[error("{0}; this is a defect, please report it")]
    Figure(#[from] FigureError),
    /// The report or the summary.
    #[error("the report cannot be composed: {0}; this is a defect, please report it")]
    Compose(String),
}

impl Failure {
    /// A file that could not be written.
    pub fn file(action: &'static str, path: &Path, error: std::io::Error) -> Failure {
        use std::io::ErrorKind;
        let remedy = match error.kind() {
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge => {
                "make room, or choose another folder with --out"
            }
            ErrorKind::InvalidInput | ErrorKind::IsADirectory => {
                "name a regular file, or one that is not there yet, in a folder"
            }
            _ => "choose a folder that can be written with --out",
        };
        Failure::File {
            action,
            path: path.to_owned(),
            error,
            remedy,
        }
    }

    /// Short name, as `--json` gives it.
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
            _ => "internal",
        }
    }

    /// Its results are already on standard output, and say what went wrong.
    pub fn comes_with_results(&self) -> bool {
        matches!(
            self,
            Failure::Fault { .. }
                | Failure::InFault
                | Failure::Different { .. }
                | Failure::NotReady { .. }
                | Failure::Drill { .. }
                | Failure::RunFault { .. }
                | Failure::LogEnded { .. }
                | Failure::TraceEnded { .. }
        )
    }

    /// Exit code, see the module.
    pub fn code(&self) -> u8 {
        match self {
            Failure::UnknownArm { .. } | Failure::Model(_) => 3,
            Failure::Experiment(error) => experiment_code(error),
            Failure::Fault { .. } | Failure::RunFault { .. } | Failure::InFault => 5,
            Failure::Log(error) => log_code(error),
            Failure::File { .. }
            | Failure::Exists { .. }
            | Failure::LogEnded { .. }
            | Failure::TraceEnded { .. } => 6,
            Failure::Different { .. } => 7,
            Failure::NotReady { .. } => 8,
            Failure::Ident(_) => 9,
            Failure::Read(error) => read_code(error),
            Failure::Save(error) => save_code(error),
            Failure::RealClock | Failure::RealArm => 2,
            Failure::Injection(_) | Failure::InjectionIntoRealArm => 2,
            Failure::NoSuchProcess { .. } | Failure::NoSuchRow { .. } => 2,
            Failure::Drill { .. } | Failure::NotTracking => 12,
            Failure::Ipc(_)
            | Failure::Bus(_)
            | Failure::Pendant { .. }
            | Failure::AlreadyRunning { .. }
            | Failure::NoSibling { .. }
            | Failure::ProcessEnded { .. }
            | Failure::NotRunning { .. } => 10,
            Failure::Refused { .. } => 11,
            Failure::Figure(_) | Failure::Compose(_) => 1,
        }
    }
}

/// What the description of the arm brings about is an error of the description.
fn experiment_code(error: &ExperimentError) -> u8 {
    match error {
        ExperimentError::Model(_)
        | ExperimentError::Arm(_)
        | ExperimentError::Config(_)
        | ExperimentError::Plant(_) => 3,
        ExperimentError::Unreachable { .. }
        | ExperimentError::Refused { .. }
        | ExperimentError::FaultAtStart { .. }
        | ExperimentError::Fault { .. }
        | ExperimentError::Stuck { .. } => 4,
        ExperimentError::Ident(_) => 9,
        ExperimentError::Save(error) => save_code(error),
        ExperimentError::Log(error) => log_code(error),
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

    /// Rows of the table that are no [`Failure`]: done, wrong use as clap has it, interrupted.
    const ELSEWHERE: [u8; 3] = [0, 2, 130];

    /// The rows of `--help`: code and meaning.
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

    /// A failure of each kind, with words of the row that it belongs to.
    fn failures() -> Vec<(Failure, &'static str)> {
        let words = String::new;
        let path = || PathBuf::from("file");
        let model = || ModelError::Dof { found: 2 };
        let mcap = || LogError::Busy { file: words() };
        let ident = || IdentError::Shape {
            argument: words(),
            expected: words(),
            found: words(),
        };
        let file = || Failure::file("write", Path::new("file"), io());
        let arm = "the description of the arm";
        let (fault, disk, system) = ("a fault", "a file cannot be", "no system runs");
        let runs = words();
        vec![
            (Failure::Compose(words()), "a defect"),
            (Failure::RealClock, "wrong use"),
            (Failure::RealArm, "wrong use"),
            (Failure::NoSuchProcess { name: "" }, "wrong use"),
            (Failure::Model(model()), arm),
            (
                Failure::UnknownArm {
                    found: words(),
                    known: words(),
                },
                arm,
            ),
            (Failure::Log(LogError::Model(model())), arm),
            (Failure::Save(SaveError::Model(model())), arm),
            (Failure::Experiment(ExperimentError::Model(model())), arm),
            (Failure::Fault { runs, out: path() }, fault),
            (Failure::RunFault { faults: words() }, fault),
            (Failure::InFault, fault),
            (file(), disk),
            (Failure::Exists { path: path() }, disk),
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
                    file: words(),
                    error: io(),
                })),
                disk,
            ),
            (
                Failure::Different {
                    path: path(),
                    different: 1,
                    steps: 2,
                },
                "a replay",
            ),
            (Failure::NotReady { failed: words() }, "the machine"),
            (Failure::Ident(ident()), "the logs do not give"),
            (
                Failure::Save(SaveError::Fit(ident())),
                "the logs do not give",
            ),
            (
                Failure::Experiment(ExperimentError::Ident(ident())),
                "the logs do not give",
            ),
            (Failure::NotRunning { prefix: words() }, system),
            (
                Failure::ProcessEnded {
                    name: "",
                    status: words(),
                },
                system,
            ),
            (
                Failure::AlreadyRunning {
                    prefix: words(),
                    process: 1,
                },
                system,
            ),
            (
                Failure::NoSibling {
                    name: "",
                    program: path(),
                },
                system,
            ),
            (
                Failure::Pendant {
                    socket: path(),
                    cause: words(),
                },
                system,
            ),
            (Failure::Refused { words: words() }, "refused a request"),
            (Failure::NotTracking, "a drill"),
            (Failure::Drill { rows: words() }, "a drill"),
            (
                Failure::Experiment(ExperimentError::Stuck {
                    joint: 0,
                    torque_nm: 1.0,
                }),
                "the arm cannot do",
            ),
        ]
    }

    #[test]
    fn every_failure_has_the_code_of_its_row_and_every_row_its_failure() {
        let rows = rows();
        let mut seen = BTreeSet::from(ELSEWHERE);
        for (failure, words) in failures() {
            let code = failure.code();
            let row = rows.iter().find(|(of, _)| *of == code);
            let (_, meaning) = row.unwrap_or_else(|| panic!("{code} of {failure} is in no row"));
            assert!(meaning.contains(words), "{failure}: {code} is `{meaning}`");
            assert_ne!(failure.kind(), "", "{failure}");
            assert_eq!(failure.kind() == "internal", code == 1, "{failure}");
            seen.insert(code);
        }
        let stated: BTreeSet<u8> = rows.iter().map(|(code, _)| *code).collect();
        assert_eq!(seen, stated);
        assert_eq!(stated.len(), rows.len(), "a code has one row");
    }

    /// The table of the module is that of `--help`.
    #[test]
    fn both_tables_say_the_same() {
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
