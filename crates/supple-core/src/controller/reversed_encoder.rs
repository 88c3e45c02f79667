//! An encoder whose sign changes in motion: from one cycle to the next the joint seems to turn round, which no torque explains,
//! and then to move as its reference does with the opposite sign.
//!
//! An impact turns a joint round as suddenly, but takes some of its speed; a hand that does it is a collision.

use crate::math::abs;

/// Cycles for which the joint has moved so when the fault is reported.
const CONFIRMING_CYCLES: u32 = 8;
/// Greatest difference between the velocity and that of the reference with the opposite sign, as a fraction of it.
const DIFFERENCE_SHARE: f64 = 0.25;

/// A joint that seems to have turned round suddenly.
#[derive(Clone, Copy, Debug)]
pub(super) struct SuddenReversal {
    pub joint: usize,
    /// Torque that the model needs for it \[N m\].
    pub torque_nm: f64,
    /// Since it turned round.
    cycles: u32,
}

/// What the motion since a sudden reversal shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Evidence {
    /// Not enough yet.
    Open,
    /// Another motion than that of the reversed reference.
    Refuted,
    /// The motion of the reversed reference.
    Reversed,
}

impl SuddenReversal {
    pub fn new(joint: usize, torque_nm: f64) -> SuddenReversal {
        SuddenReversal {
            joint,
            torque_nm,
            cycles: 0,
        }
    }

    /// Adds the velocities of a cycle, of the joint and of its reference \[rad/s\]. The velocity estimate follows the reversal
    /// within `settling_cycles`.
    pub fn follow(
        &mut self,
        velocity_rad_per_s: f64,
        reference_rad_per_s: f64,
        settling_cycles: u32,
    ) -> Evidence {
        self.cycles += 1;
        let difference = abs(velocity_rad_per_s + reference_rad_per_s);
        // False for a reference at rest, which says nothing, and for values that are not finite.
        let mirrors_reference = difference < DIFFERENCE_SHARE * abs(reference_rad_per_s);
        if self.cycles <= settling_cycles {
            Evidence::Open
        } else if !mirrors_reference {
            Evidence::Refuted
        } else if self.cycles < settling_cycles + CONFIRMING_CYCLES {
            Evidence::Open
        } else {
            Evidence::Reversed
        }
    }
}
