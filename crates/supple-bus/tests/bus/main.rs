//! Tests of injected faults, sockets and frames. Tests that need a CAN interface or count allocations are separate
//! programs.

#[path = "../../../../tests/support/property.rs"]
mod property;

mod injector;
mod sockets;
mod wire;
