//! The protocol of the arm's bus.

#[path = "../../../../tests/support/property.rs"]
mod property;

mod codecs;
mod tables;
mod units;
mod vectors;
