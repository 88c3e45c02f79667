//! Frames, their bits and their durations.

#[path = "../../../../tests/support/property.rs"]
mod property;

mod durations;
mod frames;
