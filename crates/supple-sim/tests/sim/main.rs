//! The simulated arm's process and its drives.

mod motors;
mod process;
