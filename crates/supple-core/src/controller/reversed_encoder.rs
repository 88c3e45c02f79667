//! Detection of an encoder whose sign changes in motion: from one cycle to the next the measured velocity reverses, which no
//! torque explains, and then equals the reference velocity with the opposite sign.
//!
//! An impact reverses a joint as suddenly, but reduces its speed; a hand that reverses a joint causes a collision fault.

use crate::math::abs;

/// Cycles for which the velocity must equal the reversed reference velocity until the fault is reported.
const CONFIRMING_CYCLES: u32 = 8;
/// Maximum difference between velocity and reversed reference velocity, as a fraction of the reference velocity.
const DIFFERENCE_SHARE: f64 = 0.25;

/// A joint whose measured velocity reversed from one cycle to the next.
#[derive(Clone, Copy, Debug)]
pub(super) struct SuddenReversal {
    pub joint: usize,
    /// Torque that the model needs for the reversal \[N m\].
    pub torque_nm: f64,
    /// Cycles since the reversal.
    cycles: u32,
}

/// Verdict on the motion since a sudden reversal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum ReversalVerdict {
    /// Too few cycles for a verdict.
    Pending,
    /// The joint does not follow the reversed reference.
    NotReversed,
    /// The joint follows the reversed reference: the sign of its encoder is wrong.
    EncoderReversed,
}

impl SuddenReversal {
    pub fn new(joint: usize, torque_nm: f64) -> SuddenReversal {
        SuddenReversal {
            joint,
            torque_nm,
            cycles: 0,
        }
    }

    /// Adds the velocities of joint and reference in one cycle \[rad/s\]. The velocity estimate settles within
    /// `settling_cycles` of the reversal.
    pub fn add_cycle(
        &mut self,
        velocity_rad_per_s: f64,
        reference_rad_per_s: f64,
        settling_cycles: u32,
    ) -> ReversalVerdict {
        self.cycles += 1;
        let difference = abs(velocity_rad_per_s + reference_rad_per_s);
        // False for a reference at rest, which allows no verdict, and for values that are not finite.
        let mirrors_reference = difference < DIFFERENCE_SHARE * abs(reference_rad_per_s);
        if self.cycles <= settling_cycles {
            ReversalVerdict::Pending
        } else if !mirrors_reference {
            ReversalVerdict::NotReversed
        } else if self.cycles < settling_cycles + CONFIRMING_CYCLES {
            ReversalVerdict::Pending
        } else {
            ReversalVerdict::EncoderReversed
        }
    }
}
