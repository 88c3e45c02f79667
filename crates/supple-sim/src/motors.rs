//! What the motors' own side does with answers that come, and with those that do not.
//!
//! ```text
//! idle  --torque is wanted-->  active  --no torque is wanted-->  idle
//! active  --no answer for 100 ms-->  idle, until an answer says that no torque is wanted
//! ```
//!
//! While answers are missing, the fallback torque of the last one acts. In idle the motors brake. Nobody has
//! to press a button here: where a real arm waits for its operator, this one is active as soon as a
//! controller wants torque, but after a loss only once a controller has been idle.

use supple_core::Vector;
use supple_ipc::message::{Drives, MessageError, TorqueCommand};

/// Longest time that the fallback torque acts \[s\].
const FALLBACK_S: f64 = 0.1;
/// Time in which a braking motor would stop its own rotor, were nothing else there \[s\]. Chosen: the arm
/// sinks at a few tenths of a radian a second, as one with shorted motors does.
const BRAKING_S: f64 = 0.005;

/// The motors of an arm.
#[derive(Clone, Debug)]
pub struct Motors<const N: usize> {
    brake_nm_s_per_rad: Vector<N>,
    fallback_cycles: u32,
    active: bool,
    /// Idle after a loss: only an idle controller undoes it.
    lost: bool,
    missed_in_a_row: u32,
    fallback_nm: Vector<N>,
}

impl<const N: usize> Motors<N> {
    /// Idle. `armature_kg_m2` are the rotors' inertias at their joints.
    pub fn new(armature_kg_m2: &Vector<N>, cycle_s: f64) -> Self {
        Motors {
            brake_nm_s_per_rad: armature_kg_m2 / BRAKING_S,
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

    /// The torque of a cycle \[N m\]: that of its answer, or what is done without one.
    ///
    /// # Errors
    /// [`MessageError::Dof`]: the answer is for another arm.
    pub fn torque(
        &mut self,
        answer: Option<&TorqueCommand>,
        velocity_rad_per_s: &Vector<N>,
    ) -> Result<Vector<N>, MessageError> {
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
        Ok(-self.brake_nm_s_per_rad.component_mul(velocity_rad_per_s))
    }
}
