//! What is sent when something is lost: the safe action, as a small machine of its own.
//!
//! ```text
//! resting --(operator activates, controller wants torque)--> active
//! active  --(loss, or the controller wants none)--> lowering --(module idle, or 100 ms)--> resting
//! ```
//!
//! Torques go out in active and, since idle motors ignore them, in resting too, so that the operator
//! activates an arm whose weight is held already. While the answer is missing the fallback goes out from
//! the first cycle on; after [`PATIENCE_NS`] the safety module is lowered to idle, in which the motors
//! brake, and the fallback stays on until they do, for at most [`FALLBACK_NS`]: dropping the torque first
//! would drop the arm. A lost encoder ends torque at once: never gravity from that encoder. The module is
//! lowered, never raised. It knows no bus and no clock: time is an argument.

use supple_core::drive_guard::GuardReason;
use supple_puck::safety::SafetyMode;

/// How long answers or transmissions may fail before the module is lowered \[ns\].
pub const PATIENCE_NS: u64 = 10_000_000;
/// How long the fallback torque is applied at most \[ns\].
pub const FALLBACK_NS: u64 = 100_000_000;
/// Cycles in which a motor may miss its reply; in the next one its encoder is lost.
const TOLERATED_REPLIES: u32 = 1;
/// Silence of the safety module after which it is lost \[ns\].
const MODULE_SILENCE_NS: u64 = 100_000_000;

/// Why the motors were lowered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// The controller did not answer.
    Answer,
    /// The controller wants no torque.
    Unwanted,
    /// A joint is far too fast; its index.
    Overspeed(usize),
    /// A joint does not stop although the controller is in a fault; its index.
    NotStopped(usize),
    /// The motors were activated while the controller was not in gravity hold.
    Activated,
    /// A motor puck did not reply; its index.
    Encoder(usize),
    /// Frames did not leave.
    Transmit,
    /// The controller of the CAN interface went off the bus.
    BusOff,
    /// The safety module did not answer.
    Module,
    /// This program is about to end.
    Leaving,
}

impl core::fmt::Display for Loss {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Loss::Answer => f.write_str("the controller did not answer"),
            Loss::Unwanted => f.write_str("the controller wants no torque"),
            Loss::Overspeed(joint) => write!(f, "joint {joint} is twice as fast as it may be"),
            Loss::NotStopped(joint) => {
                write!(
                    f,
                    "joint {joint} does not stop although the controller is in a fault"
                )
            }
            Loss::Activated => f.write_str(
                "the motors were activated while the controller was not in gravity hold",
            ),
            Loss::Encoder(index) => {
                write!(f, "motor puck {} did not reply in two cycles", index + 1)
            }
            Loss::Transmit => f.write_str("frames do not leave the CAN interface"),
            Loss::BusOff => f.write_str("the CAN interface is off the bus"),
            Loss::Module => f.write_str("the safety module does not answer"),
            Loss::Leaving => f.write_str("the program ends"),
        }
    }
}

impl Loss {
    /// Gravity from the last pose holds the arm until the motors brake; not where that pose, or the torque that
    /// came of it, is what is wrong.
    fn keeps_the_fallback(self) -> bool {
        !matches!(
            self,
            Loss::Encoder(_) | Loss::Overspeed(_) | Loss::NotStopped(_)
        )
    }
}

impl From<GuardReason> for Loss {
    fn from(reason: GuardReason) -> Loss {
        match reason {
            GuardReason::Overspeed { joint, .. } => Loss::Overspeed(joint),
            GuardReason::NotStopped { joint, .. } => Loss::NotStopped(joint),
            GuardReason::NotInGravityHold => Loss::Activated,
        }
    }
}

/// What a cycle saw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seen {
    /// Time of the bus \[ns\].
    pub now_ns: u64,
    /// Whether the controller answered, and if so whether it wants torque.
    pub answer: Option<bool>,
    /// What the drives' guard made of motion and answer, if it ended torque.
    pub judged: Option<Loss>,
    /// For each motor, bit by bit: its reply is missing although the request left.
    pub missing: u8,
    /// Frames of the previous cycle did not leave.
    pub unsent: bool,
    /// The interface is off the bus.
    pub bus_off: bool,
    /// Mode of the safety module as it was last told, and when \[ns\].
    pub module: Option<(SafetyMode, u64)>,
    /// The program is about to end.
    pub leaving: bool,
}

/// Which torque a cycle sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Torque {
    /// The command of this cycle.
    Command,
    /// The fallback of the last command.
    Fallback,
    /// Zero.
    None,
}

/// What a cycle does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Action {
    /// Torque to send.
    pub torque: Torque,
    /// Ask the safety module for idle.
    pub lower_module: bool,
    /// Set the motors themselves to idle: the module did not do it.
    pub idle_motors: bool,
}

/// Where the machine is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// The motors brake.
    Resting,
    /// The motors take torques.
    Active,
    /// On the way from active to resting, since this time \[ns\].
    Lowering(Loss, u64),
}

/// The machine.
#[derive(Clone, Copy, Debug)]
pub struct Guard {
    stage: Stage,
    /// When answers, or transmissions, began to fail \[ns\].
    unanswered_ns: Option<u64>,
    unsent_ns: Option<u64>,
    missing: [u32; 8],
    last_loss: Option<(Loss, u64)>,
}

impl Default for Guard {
    fn default() -> Self {
        Guard::new()
    }
}

impl Guard {
    /// Resting, nothing lost.
    pub const fn new() -> Guard {
        Guard {
            stage: Stage::Resting,
            unanswered_ns: None,
            unsent_ns: None,
            missing: [0; 8],
            last_loss: None,
        }
    }

    /// Where it is.
    pub fn stage(&self) -> Stage {
        self.stage
    }

    /// The last loss that ended torque, with its time \[ns\].
    pub fn last_loss(&self) -> Option<(Loss, u64)> {
        self.last_loss
    }

    /// One cycle.
    pub fn cycle(&mut self, seen: &Seen) -> Action {
        let loss = self.watch(seen);
        let active = matches!(seen.module, Some((SafetyMode::Active, _)));
        match self.stage {
            Stage::Resting if active && loss.is_none() => self.stage = Stage::Active,
            Stage::Resting if active => {
                // Activated by the operator while something is wrong: straight back.
                self.lower(loss.unwrap_or(Loss::Answer), seen.now_ns);
            }
            Stage::Active if !active => self.stage = Stage::Resting,
            Stage::Active => {
                if let Some(loss) = loss {
                    self.lower(loss, seen.now_ns);
                }
            }
            Stage::Lowering(..) if !active => self.stage = Stage::Resting,
            Stage::Lowering(before, since_ns) => {
                // A lost encoder, or motion that does not stop, ends the fallback too.
                if let Some(loss) = loss.filter(|loss| !loss.keeps_the_fallback()) {
                    self.stage = Stage::Lowering(loss, since_ns);
                } else {
                    self.stage = Stage::Lowering(before, since_ns);
                }
            }
            Stage::Resting => {}
        }
        let wanted = seen.answer == Some(true);
        let commanded = |otherwise| if wanted { Torque::Command } else { otherwise };
        match self.stage {
            Stage::Resting => Action {
                torque: if self.encoder_lost() {
                    Torque::None
                } else {
                    commanded(Torque::None)
                },
                lower_module: false,
                idle_motors: false,
            },
            Stage::Active => Action {
                torque: commanded(Torque::Fallback),
                lower_module: false,
                idle_motors: false,
            },
            Stage::Lowering(loss, since_ns) => {
                let overdue = seen.now_ns >= since_ns + FALLBACK_NS;
                let held = !overdue && loss.keeps_the_fallback();
                Action {
                    torque: if held { Torque::Fallback } else { Torque::None },
                    lower_module: true,
                    idle_motors: overdue,
                }
            }
        }
    }

    fn lower(&mut self, loss: Loss, now_ns: u64) {
        self.stage = Stage::Lowering(loss, now_ns);
        self.last_loss = Some((loss, now_ns));
    }

    fn encoder_lost(&self) -> bool {
        self.missing.iter().any(|count| *count > TOLERATED_REPLIES)
    }

    /// What is lost for too long, the worst first.
    fn watch(&mut self, seen: &Seen) -> Option<Loss> {
        for (index, count) in self.missing.iter_mut().enumerate() {
            *count = if seen.missing >> index & 1 == 1 {
                count.saturating_add(1)
            } else {
                0
            };
        }
        let since = |began: &mut Option<u64>, failing: bool| {
            if !failing {
                *began = None;
                return false;
            }
            seen.now_ns >= *began.get_or_insert(seen.now_ns) + PATIENCE_NS
        };
        let unanswered = since(&mut self.unanswered_ns, seen.answer.is_none());
        let unsent = since(&mut self.unsent_ns, seen.unsent);
        let mut counts = self.missing.iter();
        if let Some(index) = counts.position(|count| *count > TOLERATED_REPLIES) {
            return Some(Loss::Encoder(index));
        }
        if seen.bus_off {
            return Some(Loss::BusOff);
        }
        if unsent {
            return Some(Loss::Transmit);
        }
        if seen.leaving {
            return Some(Loss::Leaving);
        }
        if unanswered {
            return Some(Loss::Answer);
        }
        if seen.answer == Some(false) {
            return Some(Loss::Unwanted);
        }
        if seen.judged.is_some() {
            return seen.judged;
        }
        match seen.module {
            Some((SafetyMode::Active, heard_ns)) if seen.now_ns > heard_ns + MODULE_SILENCE_NS => {
                Some(Loss::Module)
            }
            _ => None,
        }
    }
}
