//! Tests of emulated Damiao motors, as a host observes them on the bus.

mod host;
mod misbehaving;
mod regular;
