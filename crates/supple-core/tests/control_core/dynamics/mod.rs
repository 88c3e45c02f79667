//! The dynamics compared with independent libraries, with point masses, and with the identities of
//! mechanics on random arms.

mod derivatives;
mod energy;
mod first_principles;
mod frames;
mod identities;
mod reference;
