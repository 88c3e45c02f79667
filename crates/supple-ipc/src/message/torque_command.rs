//! From the controller to the plant, the answer to one arm state.

use super::{Drives, MAX_DOF, MessageError, expect_dof, narrowed, widened};
use iceoryx2::prelude::ZeroCopySend;
use supple_core::codes;
use supple_core::controller::Mode;
use supple_core::{Output, Vector};

/// Torques of a cycle, and those to fall back on if the next answer does not come.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("supple.TorqueCommand.v3")]
pub struct TorqueCommand {
    /// Who wrote it, as in an arm state.
    pub writer: u64,
    /// Cycle of the arm state that this answers. An answer to another cycle is not to be used.
    pub cycle: u64,
    /// Joint torques \[N m\].
    pub torque_nm: [f64; MAX_DOF],
    /// Joint torques to send while no answer comes, for at most 100 ms \[N m\]: gravity at the last
    /// trusted pose.
    pub fallback_torque_nm: [f64; MAX_DOF],
    /// Joints of the arm.
    pub dof: u8,
    /// Mode, a number of [`codes::MODES`].
    pub mode: u8,
    /// Kind of the latched fault, see [`codes::FaultCode`]; 0 for none.
    pub fault: u8,
    /// Its safe action, see [`codes::safe_action`]; 0 for none.
    pub safe_action: u8,
    /// [`Drives::Active`]: the torques are meant. [`Drives::Idle`]: the controller wants no torque, or is
    /// about to leave; the motors are to be lowered to idle, in which they brake, with the fallback torque
    /// on until they are there. A plant lowers its drives at this word, and never raises them at any.
    pub drives: u8,
    /// Zero.
    pub reserved: [u8; 3],
}

impl TorqueCommand {
    /// The answer that is the output of a step. `leaving` where the controller is about to end.
    pub fn new<const N: usize>(output: &Output<N>, leaving: bool) -> TorqueCommand {
        let drives = if output.limp || leaving {
            Drives::Idle
        } else {
            Drives::Active
        };
        TorqueCommand {
            writer: 0,
            cycle: output.cycle,
            torque_nm: widened::<N>(output.torque_nm.as_slice()),
            fallback_torque_nm: widened::<N>(output.fallback_torque_nm.as_slice()),
            dof: N as u8,
            mode: output.mode as u8,
            fault: codes::FaultCode::new(output.fault.as_ref()).kind,
            safe_action: codes::safe_action(output.safe_action),
            drives: drives as u8,
            reserved: [0; 3],
        }
    }

    /// It is for an arm with `N` joints, and every torque of it is finite. A command that is not counts as no answer.
    pub fn is_usable<const N: usize>(&self) -> bool {
        let finite = |torque: Result<Vector<N>, MessageError>| {
            torque.is_ok_and(|torque| torque.iter().all(|t| t.is_finite()))
        };
        finite(self.torque::<N>()) && finite(self.fallback_torque::<N>())
    }

    /// Joint torques \[N m\].
    ///
    /// # Errors
    /// [`MessageError::Dof`] where the arm has not `N` joints.
    pub fn torque<const N: usize>(&self) -> Result<Vector<N>, MessageError> {
        expect_dof("the torque command", self.dof, N)?;
        Ok(Vector::from(narrowed::<N>(&self.torque_nm)))
    }

    /// Joint torques while no answer comes \[N m\].
    ///
    /// # Errors
    /// [`MessageError::Dof`] where the arm has not `N` joints.
    pub fn fallback_torque<const N: usize>(&self) -> Result<Vector<N>, MessageError> {
        expect_dof("the torque command", self.dof, N)?;
        Ok(Vector::from(narrowed::<N>(&self.fallback_torque_nm)))
    }

    /// Mode of the controller, if this version knows it.
    pub fn mode(&self) -> Option<Mode> {
        codes::mode(self.mode)
    }

    /// The controller wants torque; otherwise the drives are to be lowered to idle.
    pub fn wants_torque(&self) -> bool {
        self.drives == Drives::Active as u8
    }
}
