//! Properties over random cases with a fixed seed.

use super::settings::config;
use proptest::prelude::*;
use proptest::test_runner::{Config, TestCaseError, TestRunner};
use supple_core::Vector;
use supple_core::math::Vector3;

pub type Outcome = Result<(), TestCaseError>;

/// Runs `property` on `cases` cases; `PROPTEST_CASES` and `PROPTEST_RNG_SEED` override number and
/// seed.
#[track_caller]
pub fn check<S: Strategy + 'static>(
    cases: u32,
    strategy: S,
    property: impl Fn(S::Value) -> Outcome,
) {
    run(config(cases, 20_260_102), strategy, property);
}

#[track_caller]
pub fn run<S: Strategy + 'static>(
    config: Config,
    strategy: S,
    property: impl Fn(S::Value) -> Outcome,
) {
    run_boxed(config, &strategy.boxed(), &property);
}

/// Compiled for each kind of case, not for each property.
#[track_caller]
fn run_boxed<T: std::fmt::Debug + 'static>(
    config: Config,
    strategy: &BoxedStrategy<T>,
    property: &dyn Fn(T) -> Outcome,
) {
    if let Err(failure) = TestRunner::new(config).run(strategy, property) {
        panic!("{failure}");
    }
}

pub fn vector3(reach: f64) -> impl Strategy<Value = Vector3<f64>> {
    [-reach..reach, -reach..reach, -reach..reach].prop_map(Vector3::from)
}

pub fn per_joint<const N: usize>(reach: f64) -> impl Strategy<Value = Vector<N>> {
    proptest::collection::vec(-reach..reach, N).prop_map(|v| Vector::from_column_slice(&v))
}
