//! State machine of the safe action: which torque is sent, and when the safety module is switched to idle, after
//! a loss.
//!
//! ```text
//! resting --(operator activates, controller requests torque)--> active
//! active  --(loss, or the controller requests none)--> lowering --(module idle, or 100 ms)--> resting
//! ```
//!
//! Torques are sent in the active stage and also in the resting stage, in which idle motors ignore them, so that
//! the weight of the arm is compensated from the moment the operator activates it. While the answer is missing,
//! the fallback torque is sent from the first cycle on. After [`ANSWER_TIMEOUT_NS`] the safety module is set
//! to idle, in which the motors brake; the fallback continues until they do, for at most [`FALLBACK_NS`],
//! because the arm would drop without torque before the motors brake. A lost encoder ends torque at once,
//! because gravity computed from it would be wrong. The machine never activates the arm. It has no
//! access to bus or clock: time is an argument.

use supple_core::drive_guard::GuardReason;
use supple_puck::safety::SafetyMode;

/// Time for which answers or transmissions may fail before the module is set to idle \[ns\].
pub const ANSWER_TIMEOUT_NS: u64 = 10_000_000;
/// Maximum time of the fallback torque while answers are missing \[ns\].
pub const FALLBACK_NS: u64 = 100_000_000;
/// Consecutive cycles in which a motor may miss its reply; in the next one its encoder counts as lost.
const TOLERATED_MISSED_REPLIES: u32 = 1;
/// Silence of the safety module after which it counts as lost \[ns\].
const MODULE_SILENCE_NS: u64 = 100_000_000;

/// Reason for which the motors were set to idle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LossReason {
    /// The controller did not answer.
    Answer,
    /// The controller requests no torque.
    TorqueNotWanted,
    /// A joint is at twice its speed limit; its index.
    Overspeed(usize),
    /// A joint does not stop although the controller is in a fault; its index.
    NotStopped(usize),
    /// The motors were activated while the controller was not in gravity hold.
    Activated,
    /// A motor puck did not reply; its index.
    Encoder(usize),
    /// Frames were not sent.
    Transmit,
    /// The controller of the CAN interface is bus-off.
    BusOff,
    /// The safety module did not answer.
    Module,
    /// This program is about to end.
    Leaving,
}

impl core::fmt::Display for LossReason {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            LossReason::Answer => f.write_str("the controller did not answer"),
            LossReason::TorqueNotWanted => f.write_str("the controller requests no torque"),
            LossReason::Overspeed(joint) => {
                write!(f, "joint {joint} moves at twice its speed limit")
            }
            LossReason::NotStopped(joint) => {
                write!(
                    f,
                    "joint {joint} does not stop although the controller is in a fault"
                )
            }
            LossReason::Activated => f.write_str(
                "the motors were activated while the controller was not in gravity hold",
            ),
            LossReason::Encoder(index) => {
                write!(f, "motor puck {} did not reply in two cycles", index + 1)
            }
            LossReason::Transmit => f.write_str("the CAN interface does not send its frames"),
            LossReason::BusOff => f.write_str("the CAN interface is bus-off"),
            LossReason::Module => f.write_str("the safety module does not answer"),
            LossReason::Leaving => f.write_str("the program is shutting down"),
        }
    }
}

impl LossReason {
    /// Whether the fallback torque (gravity at the last pose) may hold the arm until the motors brake: not if
    /// the pose or its torque is itself in doubt.
    fn allows_fallback(self) -> bool {
        !matches!(
            self,
            LossReason::Encoder(_) | LossReason::Overspeed(_) | LossReason::NotStopped(_)
        )
    }
}

impl From<GuardReason> for LossReason {
    fn from(reason: GuardReason) -> LossReason {
        match reason {
            GuardReason::Overspeed { joint, .. } => LossReason::Overspeed(joint),
            GuardReason::NotStopped { joint, .. } => LossReason::NotStopped(joint),
            GuardReason::NotInGravityHold => LossReason::Activated,
        }
    }
}

/// Observations of one cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GuardInput {
    /// Time of the bus \[ns\].
    pub now_ns: u64,
    /// Whether the controller's answer requests torque; `None` without an answer.
    pub answer: Option<bool>,
    /// Verdict of the drive guard, if it ended the torque.
    pub drive_guard_loss: Option<LossReason>,
    /// Bit `i` is set if motor `i` did not reply although the request was sent.
    pub missing: u8,
    /// Frames of the previous cycle were not sent.
    pub unsent: bool,
    /// The interface is bus-off.
    pub bus_off: bool,
    /// Last known mode of the safety module, and when it was received \[ns\].
    pub module: Option<(SafetyMode, u64)>,
    /// The program is about to end.
    pub leaving: bool,
}

/// Torque that a cycle sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Torque {
    /// The command of this cycle.
    Command,
    /// The fallback of the last command.
    Fallback,
    /// Zero.
    None,
}

/// Action of a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Action {
    /// Torque to send.
    pub torque: Torque,
    /// Request idle from the safety module.
    pub lower_module: bool,
    /// Set the motors directly to idle, because the module did not.
    pub idle_motors: bool,
}

/// State of the state machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// The motors brake.
    Resting,
    /// The motors apply torques.
    Active,
    /// Between active and resting: the reason, and since when \[ns\].
    Lowering(LossReason, u64),
}

/// State machine of the safe action.
#[derive(Clone, Copy, Debug)]
pub struct SafeActionMachine {
    stage: Stage,
    /// Times at which answers and transmissions began to fail \[ns\].
    unanswered_ns: Option<u64>,
    unsent_ns: Option<u64>,
    missing: [u32; 8],
    last_loss: Option<(LossReason, u64)>,
}

impl Default for SafeActionMachine {
    fn default() -> Self {
        SafeActionMachine::new()
    }
}

impl SafeActionMachine {
    /// A machine in the resting stage, without a loss.
    pub const fn new() -> SafeActionMachine {
        SafeActionMachine {
            stage: Stage::Resting,
            unanswered_ns: None,
            unsent_ns: None,
            missing: [0; 8],
            last_loss: None,
        }
    }

    /// Current stage.
    pub fn stage(&self) -> Stage {
        self.stage
    }

    /// The last loss that ended torque, with its time \[ns\].
    pub fn last_loss(&self) -> Option<(LossReason, u64)> {
        self.last_loss
    }

    /// Runs one cycle.
    pub fn cycle(&mut self, input: &GuardInput) -> Action {
        let loss = self.watch(input);
        let active = matches!(input.module, Some((SafetyMode::Active, _)));
        match self.stage {
            Stage::Resting if active && loss.is_none() => self.stage = Stage::Active,
            Stage::Resting if active => {
                // The operator activated the arm while a loss is present: switch it to idle again at once.
                self.lower(loss.unwrap_or(LossReason::Answer), input.now_ns);
            }
            Stage::Active if !active => self.stage = Stage::Resting,
            Stage::Active => {
                if let Some(loss) = loss {
                    self.lower(loss, input.now_ns);
                }
            }
            Stage::Lowering(..) if !active => self.stage = Stage::Resting,
            Stage::Lowering(before, since_ns) => {
                // A lost encoder, or motion that does not stop, ends the fallback too.
                if let Some(loss) = loss.filter(|loss| !loss.allows_fallback()) {
                    self.stage = Stage::Lowering(loss, since_ns);
                } else {
                    self.stage = Stage::Lowering(before, since_ns);
                }
            }
            Stage::Resting => {}
        }
        let wanted = input.answer == Some(true);
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
                let overdue = input.now_ns >= since_ns + FALLBACK_NS;
                let held = !overdue && loss.allows_fallback();
                Action {
                    torque: if held { Torque::Fallback } else { Torque::None },
                    lower_module: true,
                    idle_motors: overdue,
                }
            }
        }
    }

    fn lower(&mut self, loss: LossReason, now_ns: u64) {
        self.stage = Stage::Lowering(loss, now_ns);
        self.last_loss = Some((loss, now_ns));
    }

    fn encoder_lost(&self) -> bool {
        self.missing
            .iter()
            .any(|count| *count > TOLERATED_MISSED_REPLIES)
    }

    /// Returns the most severe loss that has lasted longer than its tolerance.
    fn watch(&mut self, input: &GuardInput) -> Option<LossReason> {
        for (index, count) in self.missing.iter_mut().enumerate() {
            *count = if input.missing >> index & 1 == 1 {
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
            input.now_ns >= *began.get_or_insert(input.now_ns) + ANSWER_TIMEOUT_NS
        };
        let unanswered = since(&mut self.unanswered_ns, input.answer.is_none());
        let unsent = since(&mut self.unsent_ns, input.unsent);
        let mut counts = self.missing.iter();
        if let Some(index) = counts.position(|count| *count > TOLERATED_MISSED_REPLIES) {
            return Some(LossReason::Encoder(index));
        }
        if let Some(loss) = input
            .drive_guard_loss
            .filter(|loss| !loss.allows_fallback())
        {
            return Some(loss);
        }
        if input.bus_off {
            return Some(LossReason::BusOff);
        }
        if unsent {
            return Some(LossReason::Transmit);
        }
        if input.leaving {
            return Some(LossReason::Leaving);
        }
        if unanswered {
            return Some(LossReason::Answer);
        }
        if input.answer == Some(false) {
            return Some(LossReason::TorqueNotWanted);
        }
        if input.drive_guard_loss.is_some() {
            return input.drive_guard_loss;
        }
        match input.module {
            Some((SafetyMode::Active, last_reply_ns))
                if input.now_ns > last_reply_ns + MODULE_SILENCE_NS =>
            {
                Some(LossReason::Module)
            }
            _ => None,
        }
    }
}
