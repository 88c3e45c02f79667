//! Experiments and their evaluation, without a system of processes.

mod mismatch;
mod moves;
mod teaching;
mod verdict;
