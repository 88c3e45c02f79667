//! What the programs of the periodic processes (`supple-rt`, `supple-sim`, `supple-can`, `supple-emu`) share: the options of
//! each of them, and the way from the arguments to the exit code.

#![forbid(unsafe_code)]

mod failure;
mod options;
mod program;

pub use failure::Failure;
pub use options::{ProcessOptions, RateOption};
pub use program::{Program, main};
