//! Platform-independent part of the freestanding program.
//!
//! [`report`] runs the core's dynamics and its controller on arms of 4 and of 7 joints and prints
//! every number as its bit pattern. A hosted build of the same function must print the same text: the
//! arithmetic of the core must not depend on the standard library, nor on the nalgebra features
//! that other crates enable, which may select another implementation of the sine.
#![no_std]
#![forbid(unsafe_code)]

mod arm;
mod control;
mod digest;
mod motion;
mod print;

use core::fmt::{self, Write};

/// Prints, for an arm of 4 and one of 7 joints: torques, the final state of a simulated motion, the final torque, mode, fault and
/// tracking error of a closed-loop run, and a digest of all intermediate numbers. Numbers are printed as bit patterns and in
/// decimal.
///
/// # Errors
/// The error of `out`, or [`fmt::Error`] if an arm or a configuration is rejected, after printing
/// the reason.
pub fn report(out: &mut impl Write) -> fmt::Result {
    motion::report::<4>(out)?;
    control::report::<4>(out)?;
    motion::report::<7>(out)?;
    control::report::<7>(out)
}
