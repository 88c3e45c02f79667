//! Experiments and their evaluation, without a system of processes.

mod teaching;
mod verdict;
