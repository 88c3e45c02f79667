//! Tests with several processes of one system. A child process inherits file locks until it has started; the tests of the
//! locks are therefore in another program.

#[path = "../support/mod.rs"]
mod support;

mod crash;
mod shared_memory;
