//! Tests of Barrett's puck protocol.

#[path = "../../../../tests/support/property.rs"]
mod property;

mod codecs;
mod tables;
mod units;
mod vectors;
