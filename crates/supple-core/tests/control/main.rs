//! The control step as a whole: modes, faults, limits, and what never happens whatever comes in.
#![allow(
    clippy::disallowed_methods,
    reason = "references take their mathematics elsewhere"
)]

#[path = "../support/mod.rs"]
mod support;

mod arrivals;
mod bumpless;
mod closed_loop;
mod contact;
mod determinism;
mod exciting;
mod faults;
mod gains;
mod garbage;
mod holding;
mod limits;
mod messages;
mod modes;
mod motion;
mod moving;
mod observing;
mod protecting;
mod refusals;
mod settings;
mod stiffness;
mod stopping;
