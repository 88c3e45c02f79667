//! What is lost, and what should come of it.

use crate::cli::PlantKind;
use crate::up::CONTROLLER;
use serde::Serialize;

/// How a process is lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Loss {
    /// Not at all: what the others are compared with.
    Nothing,
    /// By `kill -9`.
    Kill,
    /// By SIGSTOP; SIGCONT follows.
    Stop,
}

/// What should come of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Expected {
    /// Tracking goes on.
    Unharmed,
    /// The motors keep the last or the fallback torque, and brake after this time at the earliest and at the
    /// latest \[ms\].
    BrakedWithin(f64, f64),
    /// There are no motors any more: the controller latches a fault.
    ControllerFault,
}

/// One loss.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Case {
    /// What plays the arm.
    pub plant: PlantKind,
    /// Which process.
    pub process: &'static str,
    /// How it is lost.
    pub loss: Loss,
    /// What should come of it.
    pub expected: Expected,
}

/// The program itself, as `supple up`.
pub const UP: &str = "supple";

/// Time in which the motors of an arm on a bus brake once its host has noticed a loss \[ms\]: 10 ms without
/// an answer, a frame to the safety module, its frame to the motors.
const LOWERED_MS: (f64, f64) = (8.0, 25.0);
/// Silence of the host after which the safety module ends torque by itself \[ms\].
const HEARTBEAT_MS: (f64, f64) = (90.0, 120.0);
/// Time for which the simulated arm's motors apply the fallback torque \[ms\].
const FALLBACK_MS: (f64, f64) = (95.0, 120.0);
/// A controller that is asked to end has the drives lowered within this time \[ms\].
const LEAVING_MS: (f64, f64) = (0.0, 50.0);

impl Case {
    /// Every loss of a plant, the comparison first.
    pub fn all(plant: PlantKind) -> Vec<Case> {
        let braked = |(from, to)| Expected::BrakedWithin(from, to);
        let processes = match plant {
            PlantKind::Sim => vec![
                (CONTROLLER, braked(FALLBACK_MS)),
                ("supple-sim", Expected::ControllerFault),
            ],
            PlantKind::Emu | PlantKind::Can => vec![
                (CONTROLLER, braked(LOWERED_MS)),
                ("supple-can", braked(HEARTBEAT_MS)),
                ("supple-emu", Expected::ControllerFault),
            ],
        };
        let case = |process, loss, expected| Case {
            plant,
            process,
            loss,
            expected,
        };
        let mut cases = vec![case(CONTROLLER, Loss::Nothing, Expected::Unharmed)];
        for (process, expected) in processes {
            cases.push(case(process, Loss::Kill, expected));
            cases.push(case(process, Loss::Stop, expected));
        }
        cases.push(case(UP, Loss::Kill, braked(LEAVING_MS)));
        cases.push(case(UP, Loss::Stop, Expected::Unharmed));
        cases
    }
}

impl core::fmt::Display for Expected {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Expected::Unharmed => f.write_str("tracks on"),
            Expected::BrakedWithin(from_ms, to_ms) => {
                write!(f, "brakes within {from_ms:.0} to {to_ms:.0} ms")
            }
            Expected::ControllerFault => f.write_str("controller in fault"),
        }
    }
}

impl core::fmt::Display for Loss {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Loss::Nothing => "nothing",
            Loss::Kill => "kill -9",
            Loss::Stop => "SIGSTOP",
        })
    }
}
