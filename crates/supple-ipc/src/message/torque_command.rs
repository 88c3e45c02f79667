//! Torque command: message from the controller to the plant, the answer to one arm state.

use super::common::{Drives, MAX_DOF, MessageError, expect_dof, first_values, padded};
use iceoryx2::prelude::ZeroCopySend;
use supple_core::codes;
use supple_core::controller::Mode;
use supple_core::{Output, Vector};

/// Torques of a cycle, and the fallback torques for cycles without an answer.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("supple.TorqueCommand.v3")]
pub struct TorqueCommand {
    /// Writer id, as in an arm state.
    pub writer: u64,
    /// Cycle of the arm state that this answers. The plant discards an answer to another cycle.
    pub cycle: u64,
    /// Joint torques \[N m\].
    pub torque_nm: [f64; MAX_DOF],
    /// Joint torques that the plant applies while answers are missing, for at most 100 ms \[N m\]: gravity torques at
    /// the last trusted pose.
    pub fallback_torque_nm: [f64; MAX_DOF],
    /// Number of joints of the arm.
    pub dof: u8,
    /// Mode, a code of [`codes::MODES`].
    pub mode: u8,
    /// Kind of the latched fault, see [`codes::FaultCode`]; 0 for none.
    pub fault: u8,
    /// Safe action of the latched fault, see [`codes::safe_action`]; 0 for none.
    pub safe_action: u8,
    /// Requested drive state. [`Drives::Active`]: apply the torques. [`Drives::Idle`]: the controller requests no
    /// torque, or is about to exit; the plant switches the drives to idle, in which the motors brake, and applies the
    /// fallback torque until they are idle. A plant switches its drives to idle on this request, and never to active.
    pub drives: u8,
    /// Zero.
    pub reserved: [u8; 3],
}

impl TorqueCommand {
    /// Creates the command from the output of a step; `shutting_down` means that the controller is about to exit.
    pub fn new<const N: usize>(output: &Output<N>, shutting_down: bool) -> TorqueCommand {
        let drives = if output.torque_off || shutting_down {
            Drives::Idle
        } else {
            Drives::Active
        };
        TorqueCommand {
            writer: 0,
            cycle: output.cycle,
            torque_nm: padded::<N>(output.torque_nm.as_slice()),
            fallback_torque_nm: padded::<N>(output.fallback_torque_nm.as_slice()),
            dof: N as u8,
            mode: output.mode as u8,
            fault: codes::FaultCode::new(output.fault.as_ref()).kind,
            safe_action: codes::safe_action(output.safe_action),
            drives: drives as u8,
            reserved: [0; 3],
        }
    }

    /// Whether the command is for an arm with `N` joints and all torques are finite. The plant treats any other command
    /// as a missing answer.
    pub fn is_usable<const N: usize>(&self) -> bool {
        let finite = |torque: Result<Vector<N>, MessageError>| {
            torque.is_ok_and(|torque| torque.iter().all(|t| t.is_finite()))
        };
        finite(self.torque::<N>()) && finite(self.fallback_torque::<N>())
    }

    /// Joint torques \[N m\].
    ///
    /// # Errors
    /// [`MessageError::Dof`] if the arm does not have `N` joints.
    pub fn torque<const N: usize>(&self) -> Result<Vector<N>, MessageError> {
        expect_dof("the torque command", self.dof, N)?;
        Ok(Vector::from(first_values::<N>(&self.torque_nm)))
    }

    /// Joint torques while answers are missing \[N m\].
    ///
    /// # Errors
    /// [`MessageError::Dof`] if the arm does not have `N` joints.
    pub fn fallback_torque<const N: usize>(&self) -> Result<Vector<N>, MessageError> {
        expect_dof("the torque command", self.dof, N)?;
        Ok(Vector::from(first_values::<N>(&self.fallback_torque_nm)))
    }

    /// Returns the mode of the controller; `None` if this version does not know its code.
    pub fn mode(&self) -> Option<Mode> {
        codes::mode(self.mode)
    }

    /// Whether the controller requests torque; if not, the plant switches the drives to idle.
    pub fn wants_torque(&self) -> bool {
        self.drives == Drives::Active as u8
    }
}
