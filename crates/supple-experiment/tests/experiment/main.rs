//! Experiments and their evaluation, without a system of processes.

mod moves;
mod teaching;
mod verdict;
