//! Minimum-impedance control of backdrivable arms: dynamics, friction, impedance law, supervisor.
//!
//! The central function is [`controller::step`]: a pure function from measurements to torques. It
//! reads no clock, allocates nothing, locks nothing and logs nothing, so the same function runs in
//! realtime, in virtual time, in replay and from Python.
//!
//! Equation numbers are those of Desai and Howe, "Towards the development of a humanoid arm by
//! minimizing interaction forces through minimum impedance control". SI units throughout; matrices
//! and vectors have their size in the type, `N` being the number of joints.
#![no_std]
#![forbid(unsafe_code)]

pub mod config;
pub mod controller;
pub mod dynamics;
mod law;
pub mod math;
mod model;
pub mod record;
#[cfg(debug_assertions)]
#[doc(hidden)]
pub mod sizes;
pub mod trajectory;

#[cfg(test)]
#[path = "../../../tests/support/property.rs"]
mod property;

pub use controller::{codes, drive_guard, estimator, latch, observer, residual};
pub use dynamics::inverse_kinematics;
pub use law::{impedance, impedance_torque, learned as learned_torque, target, task, torques};
pub use math::{linalg, sincos};
pub use model::{arm, body, friction, learned, pose, ripple, workspace};

pub use arm::{Arm, ArmError, Joint, Link};
pub use body::{Body, BodyError};
pub use config::Config;
pub use controller::{Controller, Input, Output, State, step};
pub use friction::Friction;
pub use math::{Matrix, Vector};
pub use pose::Pose;
pub use ripple::RippleTable;
pub use trajectory::{Reference, Trajectory};

pub use nalgebra;
