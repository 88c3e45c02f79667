//! A row of the drill before it is performed: what plays the arm, what the arm does, what happens to it, and what
//! should come of it.

use crate::cli::PlantKind;
use core::fmt;
use serde::Serialize;
use supple_plant::InjectionKind;

/// What the arm does when it happens.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Work {
    /// Gravity hold, stretched out.
    GravityHold,
    /// A stiff move downwards at up to 0.25 m/s.
    Move,
    /// The sinusoid of the paper; along a line downwards where a block is in the way.
    Track,
    /// The probing cycle.
    Probe,
    /// A stiff swing of the shoulder, the tip at up to 0.25 m/s.
    Excite,
}

/// How a process is lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Loss {
    /// By `kill -9`.
    Kill,
    /// By SIGSTOP; SIGCONT follows.
    Stop,
}

/// How drives are lowered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lowered {
    /// To idle.
    Idle,
    /// To idle, once the operator has asked for gains of 1000 N/m.
    IdleWhenStiff,
    /// By the emergency stop.
    EStop,
}

/// A request that must be refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrong {
    /// The sinusoid at a thousand times its pace.
    TooFast,
    /// Damping that the delay of the drives does not allow.
    TooStiff,
    /// A move while the drives are idle.
    WhileIdle,
}

/// What happens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// Nothing: what the others are compared with. By the wall clock where `wall` is set.
    Nothing {
        /// By the wall clock.
        wall: bool,
    },
    /// A process is lost, by the wall clock.
    Process {
        /// Its name.
        name: &'static str,
        /// How.
        loss: Loss,
    },
    /// Sixteen requests wait when idle is asked for, by the wall clock.
    Flood,
    /// A fault in the arm, while it works or, `at_once`, from the start.
    Injected {
        /// Which.
        kind: InjectionKind,
        /// Before the first cycle.
        at_once: bool,
    },
    /// A block of wood is in the way.
    Obstacle,
    /// The drives are lowered, and activated again a second later.
    Drives(Lowered),
    /// An operator asks for what cannot be.
    Request(Wrong),
}

/// What should come of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Expected {
    /// It works on: no fault, drives active.
    Unharmed,
    /// A fault of one of these names, and then rest or braking.
    Stops(&'static [&'static str]),
    /// Either of the two; in neither the arm gets faster.
    Bears(&'static [&'static str]),
    /// The motors keep the last or the fallback torque, and brake after this time at the earliest and at the
    /// latest \[ms\].
    Brakes(f64, f64),
    /// There are no motors any more: the controller latches a fault.
    ControllerFault,
    /// The request is refused with words, and nothing moves.
    Refused,
    /// The drives come back in gravity hold, and nothing jumps.
    ComesBack,
    /// Idle is heard within 20 ms.
    Heard,
}

/// A row to be performed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spec {
    /// What plays the arm.
    pub plant: PlantKind,
    /// What it does.
    pub work: Work,
    /// What happens.
    pub event: Event,
    /// What should come of it.
    pub expected: Expected,
    /// From what happens to rest or braking, where it stops \[ms\].
    pub within_ms: f64,
}

/// The program itself, as `supple up`.
pub const UP: &str = "supple";

impl Spec {
    /// By the wall clock, not in virtual time.
    pub fn by_the_wall(&self) -> bool {
        matches!(
            self.event,
            Event::Nothing { wall: true } | Event::Process { .. } | Event::Flood
        )
    }

    /// Its name, as `--only` and `--list` have it.
    pub fn name(&self) -> String {
        let plant = format!("{:?}", self.plant).to_lowercase();
        format!("{plant}/{}/{}", self.work, self.event)
    }
}

impl fmt::Display for Work {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Work::GravityHold => "gravity_hold",
            Work::Move => "move",
            Work::Track => "track",
            Work::Probe => "probe",
            Work::Excite => "excite",
        })
    }
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Event::Nothing { wall: false } => f.write_str("nothing"),
            Event::Nothing { wall: true } => f.write_str("nothing-by-the-clock"),
            Event::Process { name, loss } => {
                let how = match loss {
                    Loss::Kill => "kill",
                    Loss::Stop => "stop",
                };
                write!(f, "{how}-{name}")
            }
            Event::Flood => f.write_str("sixteen-requests-wait"),
            Event::Injected { kind, at_once } => {
                let injection = supple_plant::Injection {
                    kind: *kind,
                    trigger: supple_plant::Trigger::AtOnce,
                };
                let from = if *at_once { "-from-the-start" } else { "" };
                write!(f, "{injection}{from}")
            }
            Event::Obstacle => f.write_str("block-in-the-way"),
            Event::Drives(Lowered::Idle) => f.write_str("drives-idle-and-back"),
            Event::Drives(Lowered::IdleWhenStiff) => f.write_str("stiff-drives-idle-and-back"),
            Event::Drives(Lowered::EStop) => f.write_str("e-stop-and-back"),
            Event::Request(Wrong::TooFast) => f.write_str("too-fast-request"),
            Event::Request(Wrong::TooStiff) => f.write_str("too-much-damping"),
            Event::Request(Wrong::WhileIdle) => f.write_str("work-while-drives-idle"),
        }
    }
}

impl fmt::Display for Expected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let any = |names: &[&str]| names.join(" or ");
        match self {
            Expected::Unharmed => f.write_str("works on"),
            Expected::Stops(names) => write!(f, "stops: {}", any(names)),
            Expected::Bears(names) => write!(f, "works on, or stops: {}", any(names)),
            Expected::Brakes(from_ms, to_ms) => {
                write!(f, "brakes within {from_ms:.0} to {to_ms:.0} ms")
            }
            Expected::ControllerFault => f.write_str("controller in fault"),
            Expected::Refused => f.write_str("refused, nothing moves"),
            Expected::ComesBack => f.write_str("gravity hold again, no jump"),
            Expected::Heard => f.write_str("idle within 20 ms"),
        }
    }
}
