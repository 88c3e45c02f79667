//! Behaviour of the drives with and without answers from the controller.
//!
//! ```text
//! idle  --torque is wanted, in gravity hold-->  active  --no torque is wanted-->  idle
//! active  --no answer for 100 ms, or the guard's judgement-->  idle, until an answer says that no torque is wanted
//! ```
//!
//! While answers are missing, the fallback torque of the last answer acts. In idle the motors are shorted and brake
//! ([`supple_plant::ActuatorModel`]). No operator is needed: the simulated drives become active as soon as a controller
//! in gravity hold requests torque; after a loss of answers only once a controller has been idle. Every torque passes
//! [`DriveGuard`], which limits torques and rates, and removes torque if the arm does not stop in a fault.

use supple_core::Vector;
use supple_core::controller::Mode;
use supple_core::drive_guard::{DriveCommand, DriveGuard, GuardReason};
use supple_ipc::message::{Drives, MessageError, TorqueCommand};

/// Maximum time for which the fallback torque acts \[s\].
const FALLBACK_S: f64 = 0.1;

/// The simulated drives of an arm.
#[derive(Clone, Debug)]
pub struct Motors<const N: usize> {
    guard: DriveGuard<N>,
    fallback_cycles: u32,
    active: bool,
    /// Idle after a loss of answers or by the guard; latched until the controller requests no torque.
    latched_idle: bool,
    missed_in_a_row: u32,
    fallback_nm: Vector<N>,
    last_guard_reason: Option<GuardReason>,
}

impl<const N: usize> Motors<N> {
    /// Creates idle drives.
    pub fn new(cycle_s: f64, guard: DriveGuard<N>) -> Self {
        Motors {
            guard,
            fallback_cycles: (FALLBACK_S / cycle_s).floor() as u32,
            active: false,
            latched_idle: false,
            missed_in_a_row: 0,
            fallback_nm: Vector::zeros(),
            last_guard_reason: None,
        }
    }

    /// Drive state.
    pub fn drives(&self) -> Drives {
        if self.active {
            Drives::Active
        } else {
            Drives::Idle
        }
    }

    /// Switches the drives to idle from outside. They become active again when a controller in gravity hold requests
    /// torque.
    pub fn switch_to_idle(&mut self) {
        self.active = false;
    }

    /// Reason for which the guard last removed torque.
    pub fn last_guard_reason(&self) -> Option<GuardReason> {
        self.last_guard_reason
    }

    /// Returns the torque of a cycle \[N m\] for the angles measured in it \[rad\]: the torque of its answer, or the
    /// fallback without one; zero in idle. An answer that is not finite counts as missing.
    ///
    /// # Errors
    /// [`MessageError::Dof`]: the answer is for another arm.
    pub fn torque(
        &mut self,
        position_rad: &[Option<f64>; N],
        answer: Option<&TorqueCommand>,
    ) -> Result<Vector<N>, MessageError> {
        self.guard.observe(position_rad, 1);
        let command = answer.map(Command::<N>::read).transpose()?.flatten();
        if let Some(command) = &command {
            self.missed_in_a_row = 0;
            self.fallback_nm = command.fallback_nm;
            self.latched_idle &= command.wanted;
            let resting = command.drive.mode == Some(Mode::GravityHold);
            let was_active = self.active;
            self.active = command.wanted && !self.latched_idle && (was_active || resting);
            if !was_active {
                self.guard.reset_rate_limit(&command.drive.torque_nm);
            }
        } else if self.active {
            self.missed_in_a_row += 1;
            if self.missed_in_a_row > self.fallback_cycles {
                self.end();
            }
        }
        let drive = command.as_ref().map(|command| command.drive);
        if let Err(reason) = self.guard.check_command(drive.as_ref(), self.active) {
            self.last_guard_reason = Some(reason);
            self.end();
        }
        let wanted_nm = drive.map_or(self.fallback_nm, |drive| drive.torque_nm);
        if !self.active {
            // While the drives are idle, the rate limiter follows the command, so that no rate limit applies when they
            // become active.
            self.guard.reset_rate_limit(&wanted_nm);
            return Ok(Vector::zeros());
        }
        let stopping = drive.is_none_or(|drive| drive.fault);
        Ok(self.guard.limited_nm(&wanted_nm, stopping))
    }

    fn end(&mut self) {
        self.active = false;
        self.latched_idle = true;
    }
}

/// The part of an answer that concerns the motors.
struct Command<const N: usize> {
    drive: DriveCommand<N>,
    fallback_nm: Vector<N>,
    wanted: bool,
}

impl<const N: usize> Command<N> {
    /// Reads an answer; `None` if a torque is not finite.
    fn read(answer: &TorqueCommand) -> Result<Option<Self>, MessageError> {
        let command = Command {
            drive: DriveCommand {
                torque_nm: answer.torque::<N>()?,
                mode: answer.mode(),
                fault: answer.fault != 0,
            },
            fallback_nm: answer.fallback_torque::<N>()?,
            wanted: answer.wants_torque(),
        };
        let torques = command.drive.torque_nm.iter().chain(&command.fallback_nm);
        let finite = torques.fold(true, |finite, torque| finite & torque.is_finite());
        Ok(finite.then_some(command))
    }
}
