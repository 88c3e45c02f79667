//! Rules for the outcome of a random case. No rule depends on the task or, except for a dead motor, on the fault. The bounds
//! were written before the first search. Two rules were changed after it: the energy of a blow counts as motion before the
//! fault, and a requested idle is no stop.

use super::course::CaseOutcome;
use super::draw::Case;
use core::fmt;
use serde::Serialize;
use supple_plant::InjectionKind;

/// Bound of the kinetic energy until the stop: this multiple of the energy of the task, or this energy \[J\] if it is higher.
const UNSTOPPED: (f64, f64) = (3.0, 0.5);
/// Bound of the kinetic energy after the stop, as a multiple of the energy at the stop or before the fault, or in joules.
const AFTER: (f64, f64) = (1.5, 0.12);
/// Energy that an arm with a dead motor may gain after the stop, in addition to the energy of its fall \[J\].
const GAINED_J: f64 = 0.1;
/// Maximum tip speed with active drives later than half a second after the stop \[m/s\].
const SLOW_M_PER_S: f64 = 0.25;

/// Violation of a rule.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Violation {
    /// A fault is reported before one is injected.
    FalseFault,
    /// The arm gains energy and is not stopped within the time of the case.
    Unstopped,
    /// The arm gains too much energy before it is stopped.
    StoppedLate,
    /// The arm gains energy after the stop.
    GainsEnergy,
    /// The arm still moves with active drives half a second after the stop.
    KeepsMoving,
    /// Torque remains after an idle request.
    IdleRefused,
}

impl Violation {
    /// All violations, in the order of the table.
    pub(super) const ALL: [Violation; 6] = [
        Violation::FalseFault,
        Violation::Unstopped,
        Violation::StoppedLate,
        Violation::GainsEnergy,
        Violation::KeepsMoving,
        Violation::IdleRefused,
    ];
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Violation::FalseFault => "false fault",
            Violation::Unstopped => "not stopped",
            Violation::StoppedLate => "stopped late",
            Violation::GainsEnergy => "gains energy",
            Violation::KeepsMoving => "keeps moving",
            Violation::IdleRefused => "idle refused",
        })
    }
}

/// Returns the violations of a case.
pub(super) fn excesses<const N: usize>(case: &Case<N>, course: &CaseOutcome) -> Vec<Violation> {
    if course.false_fault.is_some() {
        return vec![Violation::FalseFault];
    }
    let mut found = Vec::new();
    let is_dead = |kind| matches!(kind, InjectionKind::MotorDead { .. });
    let has_dead_motor = case.injections.iter().any(|of| is_dead(of.kind));
    let (ratio, least_j) = UNSTOPPED;
    if course.unstopped_j > (ratio * course.task_j.max(course.before_j)).max(least_j) {
        found.push(match course.stopped_s {
            None => Violation::Unstopped,
            Some(_) => Violation::StoppedLate,
        });
    }
    let (ratio, least_j) = AFTER;
    let allowed_j = (ratio * course.stop_j.max(course.before_j)).max(least_j);
    // A joint without motor torque falls and gains the potential energy of its descent.
    let gains = match has_dead_motor {
        true => course.gained_j > GAINED_J,
        false => course.after_j > allowed_j,
    };
    if gains {
        found.push(Violation::GainsEnergy);
    }
    if course.late_m_per_s > SLOW_M_PER_S {
        found.push(Violation::KeepsMoving);
    }
    if course.idle_refused {
        found.push(Violation::IdleRefused);
    }
    found
}
