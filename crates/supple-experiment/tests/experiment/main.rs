//! Experiments and their evaluation, without a system of processes.

mod hold_check;
mod mismatch;
mod moves;
mod teaching;
mod verdict;
