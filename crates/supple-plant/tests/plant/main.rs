//! The simulated arm and its environment.

#[path = "../common/mod.rs"]
mod common;

mod actuators;
mod braking;
mod contact;
mod description;
mod effects;
mod elasticity;
mod engine;
mod free_box;
mod free_motion;
mod friction;
mod injection;
mod options;
mod scene;
