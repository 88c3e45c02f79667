//! What the motors' own side does with answers that come, and with those that do not.
//!
//! ```text
//! idle  --torque is wanted-->  active  --no torque is wanted-->  idle
//! active  --no answer for 100 ms-->  idle, until an answer says that no torque is wanted
//! ```
//!
//! While answers are missing, the fallback torque of the last one acts. In idle the motors are shorted and brake
//! ([`supple_plant::Drive`]). Nobody has
//! to press a button here: where a real arm waits for its operator, this one is active as soon as a
//! controller wants torque, but after a loss only once a controller has been idle.

use supple_core::Vector;
use supple_ipc::message::{Drives, MessageError, TorqueCommand};

/// Longest time that the fallback torque acts \[s\].
const FALLBACK_S: f64 = 0.1;

/// The motors of an arm.
#[derive(Clone, Debug)]
pub struct Motors<const N: usize> {
    fallback_cycles: u32,
    active: bool,
    /// Idle after a loss: only an idle controller undoes it.
    lost: bool,
    missed_in_a_row: u32,
    fallback_nm: Vector<N>,
}

impl<const N: usize> Motors<N> {
    /// Idle.
    pub fn new(cycle_s: f64) -> Self {
        Motors {
            fallback_cycles: (FALLBACK_S / cycle_s).floor() as u32,
            active: false,
            lost: false,
            missed_in_a_row: 0,
            fallback_nm: Vector::zeros(),
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

    /// The torque of a cycle \[N m\]: that of its answer, or what is done without one; zero in idle.
    ///
    /// # Errors
    /// [`MessageError::Dof`]: the answer is for another arm.
    pub fn torque(&mut self, answer: Option<&TorqueCommand>) -> Result<Vector<N>, MessageError> {
        match answer {
            Some(command) => {
                let torque_nm = command.torque::<N>()?;
                self.fallback_nm = command.fallback_torque::<N>()?;
                self.missed_in_a_row = 0;
                let wanted = command.wants_torque();
                self.lost &= wanted;
                self.active = wanted && !self.lost;
                if self.active {
                    return Ok(torque_nm);
                }
            }
            None if self.active => {
                self.missed_in_a_row += 1;
                if self.missed_in_a_row <= self.fallback_cycles {
                    return Ok(self.fallback_nm);
                }
                self.active = false;
                self.lost = true;
            }
            None => {}
        }
        Ok(Vector::zeros())
    }
}
