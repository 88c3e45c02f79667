//! State machine of the safe action: decides after a loss which torque is sent and when the drives end it.
//!
//! ```text
//! resting --(drives active, controller requests torque)--> active
//! arms whose motors brake without torque:
//!   active --(loss, or the controller requests none)--> lowering --(drives idle, or 100 ms)--> resting
//! arms that fall without torque:
//!   active --(the same)--> holding --(hold time)--> stowing --(the arm lies)--> lowering --> resting
//!   holding or stowing --(overspeed)--> damping --(standstill, 10 s, or runaway)--> lowering --> resting
//! and, if asked, when the program is shutting down:
//!   holding --(the operator has declared that the arm is supported)--> releasing --(torque faded)--> lowering --> resting
//! ```
//!
//! The loop sends torques in the active stage. It also sends them in the resting stage, in which idle motors ignore them, so
//! that the weight of the arm is compensated from the moment the operator activates it. While an answer is missing, the
//! loop sends the fallback torque, from the first cycle on. After [`ANSWER_TIMEOUT_NS`] it ends the torque of the drives.
//! The fallback torque continues until the motors brake, for at most [`FALLBACK_NS`], because the arm would drop between
//! the end of the torque and the start of braking. [`LossReason::safe_action`] gives the losses after which this is
//! allowed.
//!
//! An arm that falls without torque is first held by gravity compensation and the damping of its motors, then laid down,
//! then disabled. If an angle is wrong, this torque may accelerate the arm; the motors then damp without torque, which
//! takes energy from the arm. If damping does not slow the arm, as with a motor whose direction is reversed, the motors are
//! disabled. If one motor has no torque, the others hold the arm even if a joint is too fast: the joint of that motor
//! falls and moves the others. The state machine never activates the arm. It has no access to bus or clock: time is an
//! argument.

use crate::drive::TorqueOffBehaviour;
use crate::link::Drives;
use crate::loss::LossReason;

/// Time for which answers or transmissions may fail before the torque is ended \[ns\].
pub const ANSWER_TIMEOUT_NS: u64 = 10_000_000;
/// Maximum time of the fallback torque while the torque is being ended \[ns\].
pub const FALLBACK_NS: u64 = 100_000_000;
/// Maximum time for which motors damp without torque before they are disabled \[ns\].
const DAMPING_NS: u64 = 10_000_000_000;
/// Number of consecutive cycles in which the reply of a motor may be missing; in the next cycle its encoder counts as lost.
const TOLERATED_MISSED_REPLIES: u32 = 1;

/// Observations of one cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GuardInput {
    /// Time of the drives \[ns\].
    pub now_ns: u64,
    /// Whether the controller's answer requests torque; `None` without an answer.
    pub answer: Option<bool>,
    /// Loss for which the drive guard rejected the command.
    pub drive_guard_loss: Option<LossReason>,
    /// Loss if a joint exceeds its speed limit while the loop holds the arm or lays it down.
    pub hold_loss: Option<LossReason>,
    /// Bit `i` is set if motor `i` did not reply although the request was sent.
    pub missing: u8,
    /// Whether frames of the previous cycle were not sent.
    pub unsent: bool,
    /// Whether the CAN interface is bus-off.
    pub bus_off: bool,
    /// Last known state of the drives.
    pub drives: Drives,
    /// Loss that the drives report.
    pub drive_loss: Option<LossReason>,
    /// Whether the program is shutting down.
    pub shutting_down: bool,
    /// Whether the operator has declared that the arm is supported.
    pub supported: bool,
}

/// Torque that a cycle sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Torque {
    /// The command of this cycle.
    Command,
    /// The fallback torque of the last command.
    Fallback,
    /// Gravity compensation that the loop computes, with the damping of the motors.
    Hold,
    /// As [`Torque::Hold`], with a spring towards the rest pose.
    Stow,
    /// As [`Torque::Hold`], fading to zero.
    Release,
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
    /// Whether to end the torque.
    pub lower: bool,
    /// Whether to end it also by setting the motors to idle directly, because the regular way took too long.
    pub idle_motors: bool,
}

/// State of the safe action.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// The motors brake, or the arm lies.
    Resting,
    /// The motors apply the controller's torques.
    Active,
    /// An arm that falls without torque is held: the reason, and since when \[ns\].
    Holding(LossReason, u64),
    /// An arm that falls without torque is laid down: the reason, and since when \[ns\].
    Stowing(LossReason, u64),
    /// The torque of an arm that is supported fades while the motors damp: the reason, and since when \[ns\].
    Releasing(LossReason, u64),
    /// The motors of an arm that falls damp without torque: the reason, and since when \[ns\].
    Damping(LossReason, u64),
    /// The torque is being ended: the reason, and since when \[ns\].
    Lowering(LossReason, u64),
}

/// State machine of the safe action.
#[derive(Clone, Copy, Debug)]
pub struct SafeActionMachine {
    torque_off_behaviour: TorqueOffBehaviour,
    /// Time for which an arm that falls is held before it is laid down \[ns\].
    hold_ns: u64,
    /// Whether a shutdown holds the arm until it is supported, instead of laying it down.
    holds_until_supported: bool,
    /// Whether the arm is held for this reason.
    waits_for_support: bool,
    stage: Stage,
    /// Time since which answers are missing \[ns\].
    unanswered_ns: Option<u64>,
    /// Time since which transmissions fail \[ns\].
    unsent_ns: Option<u64>,
    missing: [u32; 8],
    /// Whether a motor has no torque since the loss.
    motor_without_torque: bool,
    last_loss: Option<(LossReason, u64)>,
}

impl Default for SafeActionMachine {
    fn default() -> Self {
        SafeActionMachine::new()
    }
}

impl SafeActionMachine {
    /// Creates the state machine of an arm whose motors brake without torque, in the resting stage.
    pub const fn new() -> SafeActionMachine {
        SafeActionMachine {
            torque_off_behaviour: TorqueOffBehaviour::Brakes,
            hold_ns: 0,
            holds_until_supported: false,
            waits_for_support: false,
            stage: Stage::Resting,
            unanswered_ns: None,
            unsent_ns: None,
            missing: [0; 8],
            motor_without_torque: false,
            last_loss: None,
        }
    }

    /// Creates the state machine of an arm that falls without torque; the loop holds it for `hold_ns` before laying it down.
    pub const fn falling(hold_ns: u64) -> SafeActionMachine {
        SafeActionMachine {
            torque_off_behaviour: TorqueOffBehaviour::Falls,
            hold_ns,
            ..SafeActionMachine::new()
        }
    }

    /// Makes a shutdown hold an arm that falls until the operator has declared that it is supported, instead of laying it down.
    pub const fn hold_until_supported(&mut self) {
        self.holds_until_supported = true;
    }

    /// Current stage.
    pub fn stage(&self) -> Stage {
        self.stage
    }

    /// Returns the last loss that ended normal operation, with its time \[ns\].
    pub fn last_loss(&self) -> Option<(LossReason, u64)> {
        self.last_loss
    }

    /// Whether the arm is held until the operator declares that it is supported.
    pub fn waits_for_support(&self) -> bool {
        self.waits_for_support
    }

    /// Whether the loop itself holds an arm that falls without torque, or lays it down.
    pub fn holds(&self) -> bool {
        match self.stage {
            Stage::Holding(..) | Stage::Stowing(..) | Stage::Releasing(..) | Stage::Damping(..) => {
                true
            }
            Stage::Lowering(..) => self.torque_off_behaviour == TorqueOffBehaviour::Falls,
            Stage::Resting | Stage::Active => false,
        }
    }

    /// Runs one cycle. `lies` is whether an arm that is being laid down has arrived, whether the torque of a supported arm has
    /// faded, or whether an arm that is damped stands still or is not slowed.
    pub fn cycle(&mut self, input: &GuardInput, lies: bool) -> Action {
        let loss = self.most_severe_loss(input);
        let active = input.drives == Drives::Active;
        self.motor_without_torque |= loss.is_some_and(LossReason::leaves_a_motor_without_torque);
        let hold_loss = input.hold_loss.filter(|_| !self.motor_without_torque);
        match self.stage {
            Stage::Resting if active && loss.is_none() => self.stage = Stage::Active,
            Stage::Resting if active => {
                // The arm was activated while a loss is present: its torque is ended at once.
                self.begin_safe_action(loss.unwrap_or(LossReason::NoAnswer), input.now_ns);
            }
            Stage::Active => {
                if let Some(loss) = loss
                    .filter(|_| active || self.torque_off_behaviour == TorqueOffBehaviour::Falls)
                {
                    self.begin_safe_action(loss, input.now_ns);
                } else if !active {
                    self.stage = Stage::Resting;
                }
            }
            // An arm that falls may lose its motors one after another: the remaining motors continue. Without an active motor the
            // arm cannot be held.
            Stage::Holding(..) | Stage::Stowing(..) | Stage::Releasing(..) | Stage::Damping(..)
                if !active =>
            {
                self.stage = Stage::Resting;
            }
            Stage::Holding(reason, since_ns) => {
                if let Some(loss) = hold_loss {
                    self.stage = Stage::Damping(loss, input.now_ns);
                } else if self.must_wait_for_support(input) {
                    if input.supported {
                        self.stage = Stage::Releasing(reason, input.now_ns);
                    }
                } else if input.now_ns >= since_ns + self.hold_ns {
                    self.stage = Stage::Stowing(reason, input.now_ns);
                }
            }
            Stage::Stowing(reason, _) | Stage::Releasing(reason, _) => {
                if let Some(loss) = hold_loss {
                    self.stage = Stage::Damping(loss, input.now_ns);
                } else if self.is_stowing() && self.must_wait_for_support(input) {
                    self.stage = Stage::Holding(reason, input.now_ns);
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
                // A lost encoder, or motion that does not stop, also ends the fallback torque.
                let worse = loss.filter(|loss| !loss.safe_action().gravity);
                self.stage = Stage::Lowering(worse.unwrap_or(before), since_ns);
            }
            Stage::Resting => {}
        }
        self.waits_for_support =
            matches!(self.stage, Stage::Holding(..)) && self.must_wait_for_support(input);
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
            Stage::Releasing(..) => only(Torque::Release),
            Stage::Damping(..) => only(Torque::Damp),
            Stage::Lowering(loss, since_ns) => {
                let overdue = input.now_ns >= since_ns + FALLBACK_NS;
                let torque = match self.torque_off_behaviour {
                    TorqueOffBehaviour::Falls => Torque::None,
                    TorqueOffBehaviour::Brakes if !overdue && loss.safe_action().gravity => {
                        Torque::Fallback
                    }
                    TorqueOffBehaviour::Brakes => Torque::None,
                };
                Action {
                    torque,
                    lower: true,
                    idle_motors: overdue,
                }
            }
        }
    }

    fn begin_safe_action(&mut self, loss: LossReason, now_ns: u64) {
        self.stage = match self.torque_off_behaviour {
            TorqueOffBehaviour::Brakes => Stage::Lowering(loss, now_ns),
            TorqueOffBehaviour::Falls => Stage::Holding(loss, now_ns),
        };
        self.motor_without_torque = loss.leaves_a_motor_without_torque();
        self.last_loss = Some((loss, now_ns));
    }

    fn is_stowing(&self) -> bool {
        matches!(self.stage, Stage::Stowing(..))
    }

    /// Whether the arm is held until the operator has declared that it is supported. An arm with a motor that has no torque or reports a
    /// fault, as one that is hot, cannot be held for long, and is laid down.
    fn must_wait_for_support(&self, input: &GuardInput) -> bool {
        let of_motor =
            |loss: LossReason| matches!(loss, LossReason::Motor(..) | LossReason::EncoderLost(_));
        let began_by_motor = self.last_loss.is_some_and(|(loss, _)| of_motor(loss));
        let motor_fails =
            began_by_motor || input.drive_loss.is_some_and(of_motor) || self.encoder_lost();
        self.holds_until_supported
            && input.shutting_down
            && !self.motor_without_torque
            && !motor_fails
    }

    fn encoder_lost(&self) -> bool {
        self.missing
            .iter()
            .any(|count| *count > TOLERATED_MISSED_REPLIES)
    }

    /// Returns the most severe loss that has lasted longer than its tolerance.
    fn most_severe_loss(&mut self, input: &GuardInput) -> Option<LossReason> {
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
            return Some(LossReason::EncoderLost(index));
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
            return Some(LossReason::NotTransmitted);
        }
        if input.shutting_down {
            return Some(LossReason::ShuttingDown);
        }
        if unanswered {
            return Some(LossReason::NoAnswer);
        }
        if input.answer == Some(false) {
            // If motors send their state in the reply to a torque command, frames that are not sent also leave the controller
            // without states: it requests no torque before the transmission timeout has passed.
            let cause = self.torque_off_behaviour == TorqueOffBehaviour::Falls && input.unsent;
            return Some(match cause {
                true => LossReason::NotTransmitted,
                false => LossReason::TorqueNotWanted,
            });
        }
        input.drive_guard_loss.or(input.drive_loss)
    }
}
