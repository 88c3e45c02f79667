//! Tests of the program that owns the arm's bus.

mod command_line;
