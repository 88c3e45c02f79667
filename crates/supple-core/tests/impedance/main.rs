//! The impedance law: the motion of the arm under it, by forward dynamics, and each of its terms.
#![allow(
    clippy::disallowed_methods,
    reason = "reference values use other mathematical functions"
)]

#[path = "../support/mod.rs"]
mod support;

mod closed_loop;
mod friction;
mod inverse;
mod redundancy;
mod singular;
mod terms;
