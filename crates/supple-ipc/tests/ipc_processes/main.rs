//! Several processes of one system. They start processes, which inherit file locks until they have started: the
//! tests of the locks are another program.

#[path = "../support/mod.rs"]
mod support;

mod crash;
mod shared_memory;
