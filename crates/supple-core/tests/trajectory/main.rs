//! Trajectories: documented properties, and consistency of position, velocity and acceleration.
#![allow(
    clippy::disallowed_methods,
    reason = "reference values use other mathematical functions"
)]

#[path = "../support/mod.rs"]
mod support;

mod derivatives;
mod fourier;
mod paths;
mod probe;
mod quadrant;
mod refusals;
