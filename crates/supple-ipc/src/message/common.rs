//! Types shared by the messages: state of the drives, values for each joint, errors.

/// Maximum number of joints of an arm.
pub const MAX_DOF: usize = 7;

/// State of the drives: the safety module's states off, idle and active, or held by the plant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Drives {
    /// The motors have no power (emergency stop), or none of them replies.
    Off = 0,
    /// The motors ignore torques, and brake if they can.
    Idle = 1,
    /// The motors produce the commanded torques.
    Active = 2,
    /// The motors apply torques of the plant instead of the controller's: the plant holds an arm that falls without torque, or
    /// lays it down.
    Held = 3,
}

impl Drives {
    /// Converts a code.
    pub fn from_code(code: u8) -> Option<Drives> {
        [Drives::Off, Drives::Idle, Drives::Active, Drives::Held]
            .into_iter()
            .find(|drives| *drives as u8 == code)
    }

    /// Returns a warning for a person near the arm, if the name of the state does not express the hazard.
    pub fn caution(self) -> &'static str {
        match self {
            Drives::Held => {
                " (the motors have torque: the drives hold the arm and lay it down; keep out of reach)"
            }
            Drives::Off | Drives::Idle | Drives::Active => "",
        }
    }

    /// Short name for status lines.
    pub fn name(self) -> &'static str {
        match self {
            Drives::Off => "off",
            Drives::Idle => "idle",
            Drives::Active => "active",
            Drives::Held => "held",
        }
    }
}

/// Error: the reader cannot use a message.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum MessageError {
    /// The message is for another number of joints.
    #[error(
        "{message} is for an arm with {found} joints, expected {expected}: start every process with the same \
         --arm"
    )]
    Dof {
        /// Name of the message.
        message: &'static str,
        /// Number of joints in the message.
        found: u8,
        /// Number of joints that the reader expects.
        expected: usize,
    },
    /// The values do not form a valid request.
    #[error("the request cannot be read: {0}")]
    Request(supple_core::codes::RequestCodeError),
}

/// Checks that the message is for an arm with this number of joints.
pub(super) fn expect_dof(
    message: &'static str,
    found: u8,
    expected: usize,
) -> Result<(), MessageError> {
    if usize::from(found) == expected {
        return Ok(());
    }
    Err(MessageError::Dof {
        message,
        found,
        expected,
    })
}

/// Pads the values of `N` joints with zeros.
pub(super) fn padded<const N: usize>(values: &[f64]) -> [f64; MAX_DOF] {
    const { assert!(N <= MAX_DOF) };
    let mut all = [0.0; MAX_DOF];
    all[..N].copy_from_slice(values);
    all
}

/// Returns the first `N` values.
pub(super) fn first_values<const N: usize>(all: &[f64; MAX_DOF]) -> [f64; N] {
    const { assert!(N <= MAX_DOF) };
    core::array::from_fn(|i| all[i])
}
