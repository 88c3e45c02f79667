//! Tests of the controller's process and its parts. `control_loop.rs` counts allocations and is a separate program.

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
