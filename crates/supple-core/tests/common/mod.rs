//! What the tests of the dynamics share: reference arms, random arms, comparisons, derivatives.
#![allow(dead_code, reason = "each test binary takes its own part of this")]
#![allow(
    clippy::disallowed_methods,
    reason = "references take their mathematics elsewhere"
)]

pub mod cloud;
pub mod numeric;
pub mod random;
pub mod reference;
