//! The dynamics compared with independent libraries, with point masses, and with the identities of
//! mechanics on random arms.

#[path = "../common/mod.rs"]
mod common;

mod derivatives;
mod energy;
mod first_principles;
mod frames;
mod identities;
mod reference;
