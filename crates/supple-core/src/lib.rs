//! Minimum-impedance control of backdrivable arms: dynamics, friction, impedance law, supervisor.
//!
//! The heart is [`controller::step`]: one pure function from measurements to torques. It reads no
//! clock, allocates nothing, locks nothing and logs nothing, so the same function runs in realtime,
//! in virtual time, in replay and from Python.
//!
//! Equation numbers are those of Desai and Howe, "Towards the development of a humanoid arm by
//! minimizing interaction forces through minimum impedance control". SI units throughout; matrices
//! and vectors have their size in the type, `N` being the number of joints.
#![no_std]
#![forbid(unsafe_code)]

pub mod arm;
pub mod body;
pub mod codes;
pub mod config;
pub mod controller;
pub mod drive_guard;
pub mod dynamics;
pub mod estimator;
mod factors;
pub mod friction;
pub mod impedance;
mod lanes;
pub mod latch;
pub mod linalg;
mod link_rows;
pub mod math;
pub mod observer;
pub mod operational;
pub mod pose;
pub mod reach;
pub mod ripple;
pub mod sincos;
pub mod trajectory;
mod vec3;
pub mod workspace;

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
