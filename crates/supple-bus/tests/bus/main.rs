//! Injected faults, sockets and frames. What needs a CAN interface or counts allocations is a program of its own.

#[path = "../../../../tests/support/property.rs"]
mod property;

mod injector;
mod sockets;
mod wire;
