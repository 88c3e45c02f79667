//! Trajectories: what each one promises, and that its velocity and acceleration are derivatives.
#![allow(
    clippy::disallowed_methods,
    reason = "references take their mathematics elsewhere"
)]

#[path = "../support/mod.rs"]
mod support;

mod derivatives;
mod fourier;
mod paths;
mod probe;
mod quadrant;
mod refusals;
