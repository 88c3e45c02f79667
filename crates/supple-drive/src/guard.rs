//! State machine of the safe action: which torque is sent, and when the drives end it, after a loss.
//!
//! ```text
//! resting --(drives active, controller requests torque)--> active
//! arms whose motors brake without torque:
//!   active --(loss, or the controller requests none)--> lowering --(drives idle, or 100 ms)--> resting
//! arms that fall without torque:
//!   active --(the same)--> holding --(a time)--> stowing --(the arm lies)--> lowering --> resting
//!   holding or stowing --(that torque drives the arm)--> damping --(rest, 10 s, or damping drives it)--> lowering --> resting
//! ```
//!
//! Torques are sent in the active stage and also in the resting stage, in which idle motors ignore them, so that
//! the weight of the arm is compensated from the moment it is activated. While the answer is missing, the fallback
//! torque is sent from the first cycle on. After [`ANSWER_TIMEOUT_NS`] the drives are lowered, and the motors brake;
//! the fallback continues until they do, for at most [`FALLBACK_NS`], because the arm would drop without torque before
//! the motors brake. What a loss permits is in [`LossReason::safe_action`]. An arm that falls is first held by gravity
//! compensation and the damping of its motors, then laid down, then disabled. If that torque drives the arm, because an
//! angle is wrong, the motors damp without any torque: what they do then takes energy from the arm; if it does not, as of a motor
//! that turns the wrong way altogether, they are disabled. With a motor that has
//! no torque the arm is held in any case: its joint falls, and moves the others. The machine never activates the arm. It
//! has no access to bus or clock: time is an argument.

use crate::drive::Rest;
use crate::link::Drives;
use crate::loss::LossReason;

/// Time for which answers or transmissions may fail before the drives are lowered \[ns\].
pub const ANSWER_TIMEOUT_NS: u64 = 10_000_000;
/// Maximum time of the fallback torque while the drives are lowered \[ns\].
pub const FALLBACK_NS: u64 = 100_000_000;
/// Maximum time for which motors damp without torque before they are disabled \[ns\].
const DAMPING_NS: u64 = 10_000_000_000;
/// Consecutive cycles in which a motor may miss its reply; in the next one its encoder counts as lost.
const TOLERATED_MISSED_REPLIES: u32 = 1;

/// Observations of one cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GuardInput {
    /// Time of the drives \[ns\].
    pub now_ns: u64,
    /// Whether the controller's answer requests torque; `None` without an answer.
    pub answer: Option<bool>,
    /// Verdict of the drive guard, if it ended the torque.
    pub drive_guard_loss: Option<LossReason>,
    /// The torque with which the loop holds the arm or lays it down drives it.
    pub hold_loss: Option<LossReason>,
    /// Bit `i` is set if motor `i` did not reply although the request was sent.
    pub missing: u8,
    /// Frames of the previous cycle were not sent.
    pub unsent: bool,
    /// The interface is bus-off.
    pub bus_off: bool,
    /// Last known state of the drives.
    pub drives: Drives,
    /// What the drives themselves report.
    pub drive_loss: Option<LossReason>,
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
    /// Gravity compensation of the loop itself, with the damping of the motors.
    Hold,
    /// As [`Torque::Hold`], towards the rest pose.
    Stow,
    /// Zero, with the damping of the motors.
    Damp,
    /// Zero.
    None,
}

/// Action of a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Action {
    /// Torque to send.
    pub torque: Torque,
    /// End the torque in the regular way.
    pub lower: bool,
    /// End it directly at the motors, because the regular way took too long.
    pub idle_motors: bool,
}

/// State of the state machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// The motors brake, or the arm lies.
    Resting,
    /// The motors apply the controller's torques.
    Active,
    /// An arm that falls without torque is held: the reason, and since when \[ns\].
    Holding(LossReason, u64),
    /// It is laid down: the reason, and since when \[ns\].
    Stowing(LossReason, u64),
    /// Its motors damp without torque: the reason, and since when \[ns\].
    Damping(LossReason, u64),
    /// The torque is being ended: the reason, and since when \[ns\].
    Lowering(LossReason, u64),
}

/// State machine of the safe action.
#[derive(Clone, Copy, Debug)]
pub struct SafeActionMachine {
    rest: Rest,
    /// Time for which an arm that falls is held before it is laid down \[ns\].
    hold_ns: u64,
    stage: Stage,
    /// Times at which answers and transmissions began to fail \[ns\].
    unanswered_ns: Option<u64>,
    unsent_ns: Option<u64>,
    missing: [u32; 8],
    /// A motor has no torque since the loss.
    motor_ended: bool,
    last_loss: Option<(LossReason, u64)>,
}

impl Default for SafeActionMachine {
    fn default() -> Self {
        SafeActionMachine::new()
    }
}

impl SafeActionMachine {
    /// A machine of drives that brake without torque, in the resting stage, without a loss.
    pub const fn new() -> SafeActionMachine {
        SafeActionMachine {
            rest: Rest::Brakes,
            hold_ns: 0,
            stage: Stage::Resting,
            unanswered_ns: None,
            unsent_ns: None,
            missing: [0; 8],
            motor_ended: false,
            last_loss: None,
        }
    }

    /// A machine of an arm that falls without torque, which is held for `hold_ns` before it is laid down.
    pub const fn falling(hold_ns: u64) -> SafeActionMachine {
        SafeActionMachine {
            rest: Rest::Falls,
            hold_ns,
            ..SafeActionMachine::new()
        }
    }

    /// Current stage.
    pub fn stage(&self) -> Stage {
        self.stage
    }

    /// The last loss that ended normal operation, with its time \[ns\].
    pub fn last_loss(&self) -> Option<(LossReason, u64)> {
        self.last_loss
    }

    /// Whether the loop itself holds an arm that falls without torque, or lays it down.
    pub fn holds(&self) -> bool {
        match self.stage {
            Stage::Holding(..) | Stage::Stowing(..) | Stage::Damping(..) => true,
            Stage::Lowering(..) => self.rest == Rest::Falls,
            Stage::Resting | Stage::Active => false,
        }
    }

    /// Runs one cycle. `lies` is whether an arm that is being laid down has arrived, or one that is damped is at rest or is not slowed.
    pub fn cycle(&mut self, input: &GuardInput, lies: bool) -> Action {
        let loss = self.watch(input);
        let active = input.drives == Drives::Active;
        self.motor_ended |= loss.is_some_and(LossReason::ends_a_motor);
        let hold_loss = input.hold_loss.filter(|_| !self.motor_ended);
        match self.stage {
            Stage::Resting if active && loss.is_none() => self.stage = Stage::Active,
            Stage::Resting if active => {
                // The arm was activated while a loss is present: it is lowered again at once.
                self.lose(loss.unwrap_or(LossReason::Answer), input.now_ns);
            }
            Stage::Active => {
                if let Some(loss) = loss.filter(|_| active || self.rest == Rest::Falls) {
                    self.lose(loss, input.now_ns);
                } else if !active {
                    self.stage = Stage::Resting;
                }
            }
            // Motors of an arm that falls may be lost one after another: the others go on. Without an active motor there is
            // nothing to hold.
            Stage::Holding(..) | Stage::Stowing(..) | Stage::Damping(..) if !active => {
                self.stage = Stage::Resting;
            }
            Stage::Holding(reason, since_ns) => {
                if let Some(loss) = hold_loss {
                    self.stage = Stage::Damping(loss, input.now_ns);
                } else if input.now_ns >= since_ns + self.hold_ns {
                    self.stage = Stage::Stowing(reason, input.now_ns);
                }
            }
            Stage::Stowing(reason, _) => {
                if let Some(loss) = hold_loss {
                    self.stage = Stage::Damping(loss, input.now_ns);
                } else if lies {
                    self.stage = Stage::Lowering(reason, input.now_ns);
                }
            }
            Stage::Damping(reason, since_ns) => {
                if lies || input.now_ns >= since_ns + DAMPING_NS {
                    self.stage = Stage::Lowering(reason, input.now_ns);
                }
            }
            Stage::Lowering(..) if !active => self.stage = Stage::Resting,
            Stage::Lowering(before, since_ns) => {
                // A lost encoder, or motion that does not stop, ends the fallback too.
                let worse = loss.filter(|loss| !loss.safe_action().gravity);
                self.stage = Stage::Lowering(worse.unwrap_or(before), since_ns);
            }
            Stage::Resting => {}
        }
        self.action(input)
    }

    fn action(&self, input: &GuardInput) -> Action {
        let wanted = input.answer == Some(true);
        let commanded = |otherwise| if wanted { Torque::Command } else { otherwise };
        let only = |torque| Action {
            torque,
            lower: false,
            idle_motors: false,
        };
        match self.stage {
            Stage::Resting if self.encoder_lost() => only(Torque::None),
            Stage::Resting => only(commanded(Torque::None)),
            Stage::Active => only(commanded(Torque::Fallback)),
            Stage::Holding(..) => only(Torque::Hold),
            Stage::Stowing(..) => only(Torque::Stow),
            Stage::Damping(..) => only(Torque::Damp),
            Stage::Lowering(loss, since_ns) => {
                let overdue = input.now_ns >= since_ns + FALLBACK_NS;
                let torque = match self.rest {
                    Rest::Falls => Torque::None,
                    Rest::Brakes if !overdue && loss.safe_action().gravity => Torque::Fallback,
                    Rest::Brakes => Torque::None,
                };
                Action {
                    torque,
                    lower: true,
                    idle_motors: overdue,
                }
            }
        }
    }

    fn lose(&mut self, loss: LossReason, now_ns: u64) {
        self.stage = match self.rest {
            Rest::Brakes => Stage::Lowering(loss, now_ns),
            Rest::Falls => Stage::Holding(loss, now_ns),
        };
        self.motor_ended = loss.ends_a_motor();
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
        let severe = |loss: &LossReason| !loss.safe_action().gravity;
        if let Some(loss) = input.drive_loss.filter(severe) {
            return Some(loss);
        }
        if let Some(loss) = input.drive_guard_loss.filter(severe) {
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
            // Motors that carry their state in the reply to their torque are lost to the controller with the frames: it
            // wants no torque before the transmission has failed for long.
            let cause = self.rest == Rest::Falls && input.unsent;
            return Some(match cause {
                true => LossReason::Transmit,
                false => LossReason::TorqueNotWanted,
            });
        }
        input.drive_guard_loss.or(input.drive_loss)
    }
}
