//! Dynamics, impedance law, trajectories and controller.
#![allow(
    clippy::disallowed_methods,
    reason = "reference values use other mathematical functions"
)]

mod common;
#[path = "../support/mod.rs"]
mod support;

mod bodies;
mod construction;
mod control;
mod dynamics;
mod estimator;
mod friction;
mod impedance;
mod latch;
mod linalg;
mod observer;
mod operational;
mod request_codes;
mod residual;
mod sincos;
mod trajectory;
