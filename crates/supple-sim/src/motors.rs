//! What the motors' own side does with answers that come, and with those that do not.
//!
//! ```text
//! idle  --torque is wanted, in gravity hold-->  active  --no torque is wanted-->  idle
//! active  --no answer for 100 ms, or the guard's judgement-->  idle, until an answer says that no torque is wanted
//! ```
//!
//! While answers are missing, the fallback torque of the last one acts. In idle the motors are shorted and brake
//! ([`supple_plant::Drive`]). Nobody has to press a button here: where a real arm waits for its operator, this one is
//! active as soon as a controller in gravity hold wants torque, but after a loss only once a controller has been
//! idle. Every torque passes [`DriveGuard`]: limits, rates, and an end where the arm does not stop in a fault.

use supple_core::Vector;
use supple_core::controller::Mode;
use supple_core::drive_guard::{DriveCommand, DriveGuard, GuardReason};
use supple_ipc::message::{Drives, MessageError, TorqueCommand};

/// Longest time that the fallback torque acts \[s\].
const FALLBACK_S: f64 = 0.1;

/// The motors of an arm.
#[derive(Clone, Debug)]
pub struct Motors<const N: usize> {
    guard: DriveGuard<N>,
    fallback_cycles: u32,
    active: bool,
    /// Idle after a loss: only an idle controller undoes it.
    lost: bool,
    missed_in_a_row: u32,
    fallback_nm: Vector<N>,
    ended_by: Option<GuardReason>,
}

impl<const N: usize> Motors<N> {
    /// Idle.
    pub fn new(cycle_s: f64, guard: DriveGuard<N>) -> Self {
        Motors {
            guard,
            fallback_cycles: (FALLBACK_S / cycle_s).floor() as u32,
            active: false,
            lost: false,
            missed_in_a_row: 0,
            fallback_nm: Vector::zeros(),
            ended_by: None,
        }
    }

    /// What they do.
    pub fn drives(&self) -> Drives {
        if self.active {
            Drives::Active
        } else {
            Drives::Idle
        }
    }

    /// Somebody lowers them; they come back as from any rest, with a torque that is wanted in gravity hold.
    pub fn lower(&mut self) {
        self.active = false;
    }

    /// Why the guard last ended torque.
    pub fn ended_by(&self) -> Option<GuardReason> {
        self.ended_by
    }

    /// The torque of a cycle \[N m\] at the angles that were measured in it \[rad\]: that of its answer, or what is
    /// done without one; zero in idle. An answer that is not finite counts as none.
    ///
    /// # Errors
    /// [`MessageError::Dof`]: the answer is for another arm.
    pub fn torque(
        &mut self,
        position_rad: &[Option<f64>; N],
        answer: Option<&TorqueCommand>,
    ) -> Result<Vector<N>, MessageError> {
        self.guard.observe(position_rad);
        let command = answer.map(Command::<N>::read).transpose()?.flatten();
        if let Some(command) = &command {
            self.missed_in_a_row = 0;
            self.fallback_nm = command.fallback_nm;
            self.lost &= command.wanted;
            let resting = command.drive.mode == Some(Mode::GravityHold);
            let was_active = self.active;
            self.active = command.wanted && !self.lost && (was_active || resting);
            if !was_active {
                self.guard.rest(&command.drive.torque_nm);
            }
        } else if self.active {
            self.missed_in_a_row += 1;
            if self.missed_in_a_row > self.fallback_cycles {
                self.end();
            }
        }
        let drive = command.as_ref().map(|command| command.drive);
        if let Err(reason) = self.guard.judge(drive.as_ref(), self.active) {
            self.ended_by = Some(reason);
            self.end();
        }
        let wanted_nm = drive.map_or(self.fallback_nm, |drive| drive.torque_nm);
        if !self.active {
            // Torques that are sent to motors at rest: they begin with the one of their return.
            self.guard.rest(&wanted_nm);
            return Ok(Vector::zeros());
        }
        let stopping = drive.is_none_or(|drive| drive.fault);
        Ok(self.guard.limited_nm(&wanted_nm, stopping))
    }

    fn end(&mut self) {
        self.active = false;
        self.lost = true;
    }
}

/// What an answer says, as far as motors are concerned.
struct Command<const N: usize> {
    drive: DriveCommand<N>,
    fallback_nm: Vector<N>,
    wanted: bool,
}

impl<const N: usize> Command<N> {
    /// None where a torque is not a finite number.
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
