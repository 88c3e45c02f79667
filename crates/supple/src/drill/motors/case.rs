//! A test case: task, event, expected result.

use core::fmt;
use serde::Serialize;

/// Task of the arm when the event occurs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Task {
    /// Gravity hold in the home pose.
    GravityHold,
    /// A move of the elbow.
    Move,
    /// The sinusoid at 5 N/m.
    Track,
}

/// All tasks.
pub const TASKS: [Task; 3] = [Task::GravityHold, Task::Move, Task::Track];

/// Event.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// No event; the run ends as after Ctrl-C.
    Nothing,
    /// A motor or the bus misbehaves.
    Misbehaves {
        /// Specification for `supple-emu --misbehave`, without a time.
        spec: String,
        /// Motor, counted from 0, whose joint then has no torque, so that its speed is not evaluated.
        without: Option<usize>,
    },
    /// The operator requests idle.
    Idle,
    /// The controller is killed.
    KillController,
    /// The process of the bus is killed, in wall-clock time.
    KillHost,
    /// The process of the bus is stopped (SIGSTOP), in wall-clock time.
    StopHost,
    /// `supple up` is killed, in wall-clock time.
    KillUp,
}

/// Expected result.
#[derive(Clone, Debug, PartialEq)]
pub enum Expected {
    /// The system keeps running; at the end of the run the arm is laid down.
    KeepsRunning,
    /// The plant loop reports a reason in time; the arm is held, laid down, then disabled.
    LaidDown {
        /// Text that the reason contains.
        reason: String,
        /// Maximum time from the event \[ms\].
        within_ms: f64,
    },
    /// The plant loop reports a reason, or the controller latches a fault, in time; the arm is laid down after the loss, or held
    /// by the controller in its fault.
    Fault {
        /// Text that the reason of the plant loop contains, if the loop detects the event first.
        reason: Option<String>,
        /// Names of the valid faults of the controller.
        names: &'static [&'static str],
        /// Maximum time from the event \[ms\].
        within_ms: f64,
    },
    /// The watchdogs of all motors end their torque. The time counts from the last command that the motors received.
    TorqueEnds {
        /// Text of the reason that the plant loop reports, if it still runs.
        reason: Option<&'static str>,
        /// Maximum time from the event \[ms\].
        within_ms: f64,
    },
}

/// A test case.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// Task.
    pub task: Task,
    /// Event.
    pub event: Event,
    /// Expected result.
    pub expected: Expected,
}

impl Case {
    /// Whether the case runs in wall-clock time instead of virtual time.
    pub fn runs_in_wall_clock_time(&self) -> bool {
        matches!(
            self.event,
            Event::KillHost | Event::StopHost | Event::KillUp
        )
    }

    /// Returns the joint whose motor has no torque.
    pub fn without(&self) -> Option<usize> {
        match self.event {
            Event::Misbehaves { without, .. } => without,
            _ => None,
        }
    }
}

impl fmt::Display for Task {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Task::GravityHold => "gravity_hold",
            Task::Move => "move",
            Task::Track => "track",
        })
    }
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Event::Nothing => "nothing",
            Event::Misbehaves { spec, .. } => spec,
            Event::Idle => "idle",
            Event::KillController => "kill-supple-rt",
            Event::KillHost => "kill-supple-can",
            Event::StopHost => "stop-supple-can",
            Event::KillUp => "kill-supple",
        })
    }
}

impl fmt::Display for Expected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Expected::KeepsRunning => f.write_str("keeps running; laid down at the end"),
            Expected::LaidDown { reason, within_ms } => {
                write!(
                    f,
                    "\"{reason}\" within {within_ms:.1} ms; held, laid down, disabled"
                )
            }
            Expected::Fault {
                reason,
                names,
                within_ms,
            } => {
                if let Some(reason) = reason {
                    write!(f, "\"{reason}\" or ")?;
                }
                write!(
                    f,
                    "a fault within {within_ms:.0} ms: {}; then laid down, or damped if a joint is too fast",
                    names.join(" or ")
                )
            }
            Expected::TorqueEnds { reason, within_ms } => {
                write!(
                    f,
                    "no torque {within_ms:.0} ms after the last command, by the motors' watchdog"
                )?;
                match reason {
                    Some(reason) => write!(f, "; \"{reason}\""),
                    None => Ok(()),
                }
            }
        }
    }
}

/// Writes the name, as used by `--only` and `--list`.
impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "emu/{}/{}", self.task, self.event)
    }
}
