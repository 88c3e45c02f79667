//! Shared by the dynamics tests: reference arms, random arms, comparisons, derivatives.

pub mod cloud;
pub mod numeric;
pub mod random;
pub mod reference;
