//! The impedance law: what the arm does under it, by its own forward dynamics, and what each term is.
#![allow(
    clippy::disallowed_methods,
    reason = "references take their mathematics elsewhere"
)]

#[path = "../support/mod.rs"]
mod support;

mod closed_loop;
mod friction;
mod inverse;
mod redundancy;
mod singular;
mod terms;
