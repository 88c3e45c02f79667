//! The complete control step: modes, faults, limits, and invariants under arbitrary input.

mod arrivals;
mod bumpless;
mod closed_loop;
mod compliant;
mod contact;
mod determinism;
mod exciting;
mod faults;
mod gains;
mod garbage;
mod holding;
mod learning;
mod limits;
mod messages;
mod modes;
mod motion;
mod moving;
mod nullspace;
mod observing;
mod posing;
mod protecting;
mod refusals;
mod set_points;
mod settings;
mod stiffness;
mod stopping;
