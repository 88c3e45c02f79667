//! What the processes say to each other: plain old data of fixed size and layout.
//!
//! Numbers are SI, arrays have room for [`MAX_DOF`] joints and are zero beyond the arm's own, flags are
//! bytes, kinds are the numbers of [`supple_core::codes`]. There is no padding, so every byte that is shared
//! was written. The name of a type carries its version: a change of meaning or layout is a new version, and
//! a peer of another version is refused.

mod arm_state;
mod operator;
mod plant_asleep;
mod telemetry;
mod text;
mod torque_command;

pub use arm_state::{ArmState, PlantReport};
pub use operator::{OperatorReply, OperatorRequest, Outcome};
pub use plant_asleep::PlantAsleep;
pub use telemetry::{CycleTiming, Telemetry, TermTorques};
pub use text::Text;
pub use torque_command::TorqueCommand;

/// Most joints of an arm.
pub const MAX_DOF: usize = 7;

/// What the motors do, as the safety module has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Drives {
    /// Emergency stop: no power.
    Off = 0,
    /// Motors brake, torques are ignored.
    Idle = 1,
    /// Motors make the torques they are told.
    Active = 2,
}

impl Drives {
    /// By its number.
    pub fn from_code(code: u8) -> Option<Drives> {
        [Drives::Off, Drives::Idle, Drives::Active]
            .into_iter()
            .find(|drives| *drives as u8 == code)
    }

    /// Short name for status lines.
    pub fn name(self) -> &'static str {
        match self {
            Drives::Off => "off",
            Drives::Idle => "idle",
            Drives::Active => "active",
        }
    }
}

/// A message that does not fit its reader.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum MessageError {
    /// Another number of joints.
    #[error(
        "{message} is of an arm with {found} joints, {expected} are expected: start every process with \
         the same --arm"
    )]
    Dof {
        /// Name of the message.
        message: &'static str,
        /// Joints of the message.
        found: u8,
        /// Joints of the reader.
        expected: usize,
    },
    /// Numbers that are no request.
    #[error("the request cannot be read: {0}")]
    Request(supple_core::codes::RequestCodeError),
}

/// Refuses a message of another arm.
fn expect_dof(message: &'static str, found: u8, expected: usize) -> Result<(), MessageError> {
    if usize::from(found) == expected {
        return Ok(());
    }
    Err(MessageError::Dof {
        message,
        found,
        expected,
    })
}

/// Values of `N` joints with zeros behind them.
fn widened<const N: usize>(values: &[f64]) -> [f64; MAX_DOF] {
    const { assert!(N <= MAX_DOF) };
    let mut wide = [0.0; MAX_DOF];
    wide[..N].copy_from_slice(values);
    wide
}

/// The first `N` of them.
fn narrowed<const N: usize>(wide: &[f64; MAX_DOF]) -> [f64; N] {
    const { assert!(N <= MAX_DOF) };
    core::array::from_fn(|i| wide[i])
}
