//! Tests of complete systems with the programs: `supple up` with its processes, and the operator commands.

#[path = "../support/mod.rs"]
mod support;
#[path = "../support/table.rs"]
mod table;

mod calibration;
mod drill;
mod ends;
mod falling;
mod idle_requests;
mod learning;
mod motors;
mod operator;
mod regressions;
mod running;
mod start_up;
mod teaching;
mod up;
