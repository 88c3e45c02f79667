//! Identification of arms: simulated arms with known parameters, and logs of real ones.

#[path = "../../../../tests/support/property.rs"]
mod property;
mod support;

mod consistent;
mod describe;
mod effects;
mod extras;
mod filter;
mod paper;
mod recovery;
mod select;
mod tx40;
mod ur10e;
mod wrong_logs;
