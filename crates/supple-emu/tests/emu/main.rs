//! Tests of the emulated arm, as the host observes it on the bus.

mod support;

mod bus_time;
mod command_line;
mod damiao;
mod injection;
mod pendant;
mod pucks;
mod safety;
mod sensor;
