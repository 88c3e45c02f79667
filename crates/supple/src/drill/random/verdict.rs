//! What of a course is worse than allowed. No rule depends on the task or, but for a dead motor, on the fault. The bounds were
//! written before the first search; after it, what a blow adds counts as motion before the fault, and idle by request is no stop.

use super::course::Course;
use super::draw::Case;
use core::fmt;
use serde::Serialize;
use supple_plant::InjectionKind;

/// Until the stop the kinetic energy may reach this multiple of the task's, or this many joules if that is more.
const UNSTOPPED: (f64, f64) = (3.0, 0.5);
/// The same after the stop, of what it was at the stop or before the fault.
const AFTER: (f64, f64) = (1.5, 0.12);
/// Energy that an arm with a dead motor may gain after the stop, besides that of its fall \[J\].
const GAINED_J: f64 = 0.1;
/// Speed of the tip with active drives later than half a second after the stop \[m/s\].
const SLOW_M_PER_S: f64 = 0.25;

/// Something that is not allowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Excess {
    /// A fault is reported before one is injected.
    FalseFault,
    /// The arm gathers energy, and nothing stops it within the time of the case.
    Unstopped,
    /// The arm gathers energy until it is stopped.
    StoppedLate,
    /// It gathers energy although it is being stopped.
    GainsEnergy,
    /// It still moves with active drives half a second later.
    KeepsMoving,
    /// Idle is requested, and torque remains.
    IdleRefused,
}

impl Excess {
    /// All of them, in the order of the table.
    pub(super) const ALL: [Excess; 6] = [
        Excess::FalseFault,
        Excess::Unstopped,
        Excess::StoppedLate,
        Excess::GainsEnergy,
        Excess::KeepsMoving,
        Excess::IdleRefused,
    ];
}

impl fmt::Display for Excess {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Excess::FalseFault => "false fault",
            Excess::Unstopped => "not stopped",
            Excess::StoppedLate => "stopped late",
            Excess::GainsEnergy => "gains energy",
            Excess::KeepsMoving => "keeps moving",
            Excess::IdleRefused => "idle refused",
        })
    }
}

/// What of this course is not allowed.
pub(super) fn excesses<const N: usize>(case: &Case<N>, course: &Course) -> Vec<Excess> {
    if course.false_fault.is_some() {
        return vec![Excess::FalseFault];
    }
    let mut found = Vec::new();
    let is_dead = |kind| matches!(kind, InjectionKind::MotorDead { .. });
    let has_dead_motor = case.injections.iter().any(|of| is_dead(of.kind));
    let (ratio, least_j) = UNSTOPPED;
    if course.unstopped_j > (ratio * course.task_j.max(course.before_j)).max(least_j) {
        found.push(match course.stopped_s {
            None => Excess::Unstopped,
            Some(_) => Excess::StoppedLate,
        });
    }
    let (ratio, least_j) = AFTER;
    let allowed_j = (ratio * course.stop_j.max(course.before_j)).max(least_j);
    // A joint without its motor falls: then its energy is that of the height that it loses.
    let gains = match has_dead_motor {
        true => course.gained_j > GAINED_J,
        false => course.after_j > allowed_j,
    };
    if gains {
        found.push(Excess::GainsEnergy);
    }
    if course.late_m_per_s > SLOW_M_PER_S {
        found.push(Excess::KeepsMoving);
    }
    if course.idle_refused {
        found.push(Excess::IdleRefused);
    }
    found
}
