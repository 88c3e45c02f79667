//! Modules shared by the two command-line programs: arguments of commands that need no running system, exit codes,
//! terminal output, interrupts, arms by name, logs, folders of results.
//!
//! `supple-report` has the commands that draw figures; `supple` is the program of the operator. This crate draws no figures
//! and accesses no running system, so that neither program links libraries that only the other one needs.

#![forbid(unsafe_code)]

pub mod arguments;
pub mod arms;
pub mod console;
pub mod excitation_design;
pub mod exit;
pub mod interrupt;
pub mod log;
pub mod out;
pub mod parse;
pub mod range;
pub mod sibling;
