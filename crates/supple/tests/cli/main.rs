//! Tests of the program `supple`: arguments, results, errors and exit codes.

mod support;

mod bad_input;
mod command_line;
