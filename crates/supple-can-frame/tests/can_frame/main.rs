//! Tests of frames, their numbers of bits and their durations.

#[path = "../../../../tests/support/property.rs"]
mod property;

mod durations;
mod frames;
