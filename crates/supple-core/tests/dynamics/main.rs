//! The dynamics, held against independent libraries, against point masses, and against the
//! identities of mechanics on random arms.

#[path = "../common/mod.rs"]
mod common;

mod derivatives;
mod energy;
mod first_principles;
mod frames;
mod identities;
mod reference;
