//! What the two command-line programs share: the arguments of commands that need no running system, exit codes,
//! terminal output, interrupts, arms by name, logs, folders of results.
//!
//! `supple-report` is the program of the commands that draw; `supple` is the operator's. This crate draws nothing and
//! reaches no running system, so that neither program links what only the other one needs.

#![forbid(unsafe_code)]

pub mod arguments;
pub mod arms;
pub mod console;
pub mod exit;
pub mod interrupt;
pub mod log;
pub mod out;
pub mod parse;
pub mod range;
pub mod sibling;
