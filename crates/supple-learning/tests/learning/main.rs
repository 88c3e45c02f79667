//! Tests of the learner against arms whose deviations are known, with the controller in the loop.

mod convergence;
mod freezing;
mod world;

#[path = "../../../supple-core/tests/support/mod.rs"]
mod support;
