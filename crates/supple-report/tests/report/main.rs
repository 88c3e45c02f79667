//! Tests of the program `supple-report`: arguments, results, errors and exit codes.

#[path = "../../../supple/tests/cli/support/mod.rs"]
mod support;

mod bad_input;
mod command_line;
mod demo;
mod faults;
mod hostile;
mod identification;
mod new;
