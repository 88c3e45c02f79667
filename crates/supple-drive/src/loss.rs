//! The losses that end normal operation, and the safe action after each of them.
//!
//! | loss | arm whose motors brake without torque | arm that falls without torque |
//! |---|---|---|
//! | no answer, no torque requested, frames not sent, bus-off, silent safety module, shutdown, activation outside gravity hold | gravity torque at the last pose until the motors brake | is held, laid down, then disabled |
//! | lost encoder, faulty motor | no torque | the other motors hold the arm and lay it down, then are disabled |
//! | overspeed, no stop in a fault of the controller | no torque | is held, laid down, then disabled |
//! | overspeed while the arm is held | - | the motors damp without torque, then are disabled |

use core::fmt;
use supple_core::controller::{JointLabel, NamesJoints};
use supple_core::drive_guard::GuardReason;
use supple_core::record::Text;

/// Fault of a motor, as the motor reports it or its replies show it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MotorFault {
    /// The motor is disabled although the host did not disable it.
    Disabled,
    /// The supply voltage is too high.
    OverVoltage,
    /// The supply voltage is too low.
    UnderVoltage,
    /// The motor current is too high.
    OverCurrent,
    /// The motor driver is too hot.
    HotDriver,
    /// The winding is too hot.
    HotWinding,
    /// The motor is above the temperature limit in the arm's TOML.
    Hot,
    /// The motor's watchdog received no command in time.
    CommunicationLost,
    /// The motor is overloaded.
    Overload,
    /// The reported position changed by more than the motor can turn in one cycle.
    PositionJump,
    /// Two motors reply with the same id.
    TwoMotors,
    /// The motor reports a status code that the protocol does not define.
    Unknown(u8),
}

impl fmt::Display for MotorFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            MotorFault::Disabled => "is disabled and nobody disabled it",
            MotorFault::OverVoltage => "reports over-voltage; check the supply",
            MotorFault::UnderVoltage => "reports under-voltage; check the supply",
            MotorFault::OverCurrent => "reports over-current",
            MotorFault::HotDriver => "reports that its driver is too hot; let it cool down",
            MotorFault::HotWinding => "reports that its winding is too hot; let it cool down",
            MotorFault::Hot => "is hotter than the arm allows; let it cool down",
            MotorFault::CommunicationLost => "reports that commands were missing",
            MotorFault::Overload => "reports overload",
            MotorFault::PositionJump => "reports a position that jumped farther than it can turn",
            MotorFault::TwoMotors => "shares its id with another motor; two motors reply",
            MotorFault::Unknown(code) => return write!(f, "reports unknown code {code:#x}"),
        })
    }
}

/// Reason why normal operation ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LossReason {
    /// The controller did not answer.
    NoAnswer,
    /// The controller requests no torque.
    TorqueNotWanted,
    /// The joint of this index moves at twice its speed limit.
    Overspeed(usize),
    /// The joint of this index does not stop although the controller is in a fault.
    NotStopped(usize),
    /// The joint of this index exceeds its speed limit while the plant loop holds the arm or lays it down.
    OverspeedInHold(usize),
    /// The motors were activated while the controller was not in gravity hold.
    ActivatedOutsideGravityHold,
    /// The motor of this index did not reply.
    EncoderLost(usize),
    /// The motor of this index has a fault.
    Motor(usize, MotorFault),
    /// Frames were not sent.
    NotTransmitted,
    /// The controller of the CAN interface is bus-off.
    BusOff,
    /// The safety module did not answer.
    SafetyModuleSilent,
    /// The program is shutting down.
    ShuttingDown,
}

impl NamesJoints for LossReason {
    fn write(&self, f: &mut fmt::Formatter<'_>, names: &[Text]) -> fmt::Result {
        let label = |joint: usize| JointLabel::new(joint, names);
        match *self {
            LossReason::NoAnswer => f.write_str("the controller did not answer"),
            LossReason::TorqueNotWanted => f.write_str("the controller requests no torque"),
            LossReason::Overspeed(joint) => {
                write!(f, "{} moves at twice its speed limit", label(joint))
            }
            LossReason::NotStopped(joint) => write!(
                f,
                "{} does not stop although the controller is in a fault",
                label(joint)
            ),
            LossReason::OverspeedInHold(joint) => write!(
                f,
                "{} exceeds its speed limit while the arm is held: an angle is wrong",
                label(joint)
            ),
            LossReason::ActivatedOutsideGravityHold => f.write_str(
                "the motors were activated while the controller was not in gravity hold",
            ),
            LossReason::EncoderLost(index) => {
                write!(f, "motor {} did not reply in two cycles", index + 1)
            }
            LossReason::Motor(index, fault) => write!(f, "motor {} {fault}", index + 1),
            LossReason::NotTransmitted => f.write_str("the CAN interface does not send its frames"),
            LossReason::BusOff => f.write_str("the CAN interface is bus-off"),
            LossReason::SafetyModuleSilent => f.write_str("the safety module does not answer"),
            LossReason::ShuttingDown => f.write_str("the program is shutting down"),
        }
    }
}

impl fmt::Display for LossReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write(f, &[])
    }
}

/// What the drives do after a loss.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SafeAction {
    /// Whether gravity compensation continues until the motors brake. Only for arms whose motors brake without torque: on an
    /// arm that falls without torque it always continues, with damping, as far as the motors can apply it.
    pub gravity: bool,
}

impl LossReason {
    /// Whether the loss leaves a motor without torque, so that its joint moves freely.
    pub const fn leaves_a_motor_without_torque(self) -> bool {
        match self {
            LossReason::EncoderLost(_) => true,
            LossReason::Motor(_, fault) => !matches!(
                fault,
                MotorFault::Hot | MotorFault::PositionJump | MotorFault::TwoMotors
            ),
            _ => false,
        }
    }

    /// Returns the safe action after this loss, for every type of drives.
    pub const fn safe_action(self) -> SafeAction {
        let gravity = match self {
            LossReason::NoAnswer
            | LossReason::TorqueNotWanted
            | LossReason::ActivatedOutsideGravityHold
            | LossReason::NotTransmitted
            | LossReason::BusOff
            | LossReason::SafetyModuleSilent
            | LossReason::ShuttingDown => true,
            // Gravity computed from a lost encoder would be wrong.
            LossReason::EncoderLost(_) | LossReason::Motor(..) => false,
            // Neither the pose nor its torque can be relied on.
            LossReason::Overspeed(_)
            | LossReason::NotStopped(_)
            | LossReason::OverspeedInHold(_) => false,
        };
        SafeAction { gravity }
    }
}

impl From<GuardReason> for LossReason {
    fn from(reason: GuardReason) -> LossReason {
        match reason {
            GuardReason::Overspeed { joint, .. } => LossReason::Overspeed(joint),
            GuardReason::NotStopped { joint, .. } => LossReason::NotStopped(joint),
            GuardReason::NotInGravityHold => LossReason::ActivatedOutsideGravityHold,
        }
    }
}
