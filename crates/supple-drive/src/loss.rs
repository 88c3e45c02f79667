//! Losses that end normal operation, and the one table of what follows.
//!
//! | loss | motors that brake without torque | arm that falls without torque |
//! |---|---|---|
//! | no answer, no torque wanted, transmission, bus-off, safety module, leaving, activated by mistake | gravity at the last pose until they brake | held, laid down, disabled |
//! | a lost encoder, a faulty motor | no torque | the other motors: held, laid down, disabled |
//! | overspeed, no stop in a fault of the controller | no torque | the same |
//! | the torque of holding drives the arm | - | the motors damp without torque, then are disabled |

use core::fmt;
use supple_core::controller::{JointLabel, NamesJoints};
use supple_core::drive_guard::GuardReason;
use supple_core::record::Text;

/// What a motor reports about itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MotorFault {
    /// It is disabled although it was enabled and nobody disabled it.
    Disabled,
    /// Its supply voltage is too high.
    OverVoltage,
    /// Its supply voltage is too low.
    UnderVoltage,
    /// Its current is too high.
    OverCurrent,
    /// Its driver is too hot.
    HotDriver,
    /// Its winding is too hot.
    HotWinding,
    /// It is hotter than the arm allows.
    Hot,
    /// It received no command in time.
    CommunicationLost,
    /// It is overloaded.
    Overload,
    /// Its position jumped farther than it can turn.
    PositionJump,
    /// Two motors answer with its id.
    TwoMotors,
    /// A code that its protocol does not define.
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
            MotorFault::TwoMotors => "has an id that two motors answer to",
            MotorFault::Unknown(code) => return write!(f, "reports unknown code {code:#x}"),
        })
    }
}

/// Reason for which normal operation ended.
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
    /// A joint exceeds its speed limit while the plant loop holds the arm or lays it down; its index.
    HoldDrives(usize),
    /// The motors were activated while the controller was not in gravity hold.
    Activated,
    /// A motor did not reply; its index.
    Encoder(usize),
    /// A motor reports a fault; its index.
    Motor(usize, MotorFault),
    /// Frames were not sent.
    Transmit,
    /// The controller of the CAN interface is bus-off.
    BusOff,
    /// The safety module did not answer.
    Module,
    /// This program is about to end.
    Leaving,
}

impl NamesJoints for LossReason {
    fn write(&self, f: &mut fmt::Formatter<'_>, names: &[Text]) -> fmt::Result {
        let label = |joint: usize| JointLabel::new(joint, names);
        match *self {
            LossReason::Answer => f.write_str("the controller did not answer"),
            LossReason::TorqueNotWanted => f.write_str("the controller requests no torque"),
            LossReason::Overspeed(joint) => {
                write!(f, "{} moves at twice its speed limit", label(joint))
            }
            LossReason::NotStopped(joint) => write!(
                f,
                "{} does not stop although the controller is in a fault",
                label(joint)
            ),
            LossReason::HoldDrives(joint) => write!(
                f,
                "{} exceeds its speed limit while the arm is held: an angle is wrong",
                label(joint)
            ),
            LossReason::Activated => f.write_str(
                "the motors were activated while the controller was not in gravity hold",
            ),
            LossReason::Encoder(index) => {
                write!(f, "motor {} did not reply in two cycles", index + 1)
            }
            LossReason::Motor(index, fault) => write!(f, "motor {} {fault}", index + 1),
            LossReason::Transmit => f.write_str("the CAN interface does not send its frames"),
            LossReason::BusOff => f.write_str("the CAN interface is bus-off"),
            LossReason::Module => f.write_str("the safety module does not answer"),
            LossReason::Leaving => f.write_str("the program is shutting down"),
        }
    }
}

impl fmt::Display for LossReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write(f, &[])
    }
}

/// What the drives do after a loss: a row of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SafeAction {
    /// Gravity compensation continues until the motors brake. On an arm that falls without torque it continues in
    /// any case, with damping, as far as the motors can.
    pub gravity: bool,
}

impl LossReason {
    /// Whether a motor has no torque any more, so that its joint moves as it likes.
    pub const fn ends_a_motor(self) -> bool {
        match self {
            LossReason::Encoder(_) => true,
            LossReason::Motor(_, fault) => !matches!(
                fault,
                MotorFault::Hot | MotorFault::PositionJump | MotorFault::TwoMotors
            ),
            _ => false,
        }
    }

    /// The table of safe actions, for every drive.
    pub const fn safe_action(self) -> SafeAction {
        let gravity = match self {
            LossReason::Answer
            | LossReason::TorqueNotWanted
            | LossReason::Activated
            | LossReason::Transmit
            | LossReason::BusOff
            | LossReason::Module
            | LossReason::Leaving => true,
            // Gravity computed from a lost encoder would be wrong.
            LossReason::Encoder(_) | LossReason::Motor(..) => false,
            // Neither the pose nor its torque can be relied on.
            LossReason::Overspeed(_) | LossReason::NotStopped(_) | LossReason::HoldDrives(_) => {
                false
            }
        };
        SafeAction { gravity }
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
