//! The controller's process and its parts. `control_loop.rs` counts allocations in a program of its own.

#[path = "../support/mod.rs"]
mod support;

mod earlier_idle;
mod fault_files;
mod heartbeat;
mod idle_requests;
mod operator_requests;
mod process;
mod scripted;
mod standard_error;
