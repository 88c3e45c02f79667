//! Shared by the dynamics tests: reference arms, random arms, comparisons, derivatives.
#![allow(dead_code, reason = "each test binary takes its own part of this")]
#![allow(
    clippy::disallowed_methods,
    reason = "reference values use other mathematical functions"
)]

pub mod cloud;
pub mod numeric;
pub mod random;
pub mod reference;
