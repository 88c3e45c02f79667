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
    /// None; the run ends as by Ctrl-C.
    Nothing,
    /// A motor or the bus misbehaves, as `supple-emu --misbehave` names it, without a time.
    Misbehaves {
        /// Kind with its keys.
        spec: String,
        /// Motor, counted from 0, whose joint then has no torque: its speed is not judged.
        without: Option<usize>,
    },
    /// The operator wants idle.
    Idle,
    /// The controller is killed.
    KillController,
    /// The process of the bus is killed, by the wall clock.
    KillHost,
    /// It is stopped (SIGSTOP), by the wall clock.
    StopHost,
    /// `supple up` is killed, by the wall clock.
    KillUp,
}

/// Expected result.
#[derive(Clone, Debug, PartialEq)]
pub enum Expected {
    /// It goes on; at the end of the run the arm is laid down.
    KeepsRunning,
    /// The loop names this reason within this time \[ms\]; the arm is held, laid down, disabled.
    LaidDown {
        /// What the reason contains.
        reason: String,
        /// Time \[ms\].
        within_ms: f64,
    },
    /// The loop names a reason, or the controller latches one of these faults, within this time \[ms\]; the arm is laid
    /// down after the loss, or held by the controller in its fault.
    Fault {
        /// What the reason of the loop contains, if it is the first to notice.
        reason: Option<String>,
        /// Names of the controller's faults.
        names: &'static [&'static str],
        /// Time \[ms\].
        within_ms: f64,
    },
    /// All motors end their torque by their own watchdog. The time counts from the last command that they got \[ms\].
    TorqueGone {
        /// What the loop, if there still is one, names.
        reason: Option<&'static str>,
        /// Time \[ms\].
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
    /// Whether the case runs by the wall clock instead of in virtual time.
    pub fn runs_in_wall_clock_time(&self) -> bool {
        matches!(
            self.event,
            Event::KillHost | Event::StopHost | Event::KillUp
        )
    }

    /// Joint whose motor has no torque.
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
            Expected::TorqueGone { reason, within_ms } => {
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

/// The name, as used by `--only` and `--list`.
impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "emu/{}/{}", self.task, self.event)
    }
}
