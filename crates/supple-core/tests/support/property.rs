//! Properties over random cases with a fixed seed.

use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed, TestCaseError, TestRunner};
use supple_core::Vector;
use supple_core::math::Vector3;

pub type Outcome = Result<(), TestCaseError>;

/// Runs `property` on `cases` cases; `PROPTEST_CASES` and `PROPTEST_RNG_SEED` override number and
/// seed.
#[track_caller]
pub fn check<S: Strategy>(cases: u32, strategy: S, property: impl Fn(S::Value) -> Outcome) {
    let mut config = Config {
        failure_persistence: None,
        ..Config::default()
    };
    if std::env::var_os("PROPTEST_CASES").is_none() {
        config.cases = cases;
    }
    if config.rng_seed == RngSeed::Random {
        config.rng_seed = RngSeed::Fixed(20_260_102);
    }
    if let Err(failure) = TestRunner::new(config).run(&strategy, property) {
        panic!("{failure}");
    }
}

pub fn vector3(reach: f64) -> impl Strategy<Value = Vector3<f64>> {
    [-reach..reach, -reach..reach, -reach..reach].prop_map(Vector3::from)
}

pub fn per_joint<const N: usize>(reach: f64) -> impl Strategy<Value = Vector<N>> {
    proptest::collection::vec(-reach..reach, N).prop_map(|v| Vector::from_column_slice(&v))
}
