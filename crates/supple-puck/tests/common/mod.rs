//! Configuration of the property tests.

use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// Fixed number of cases, the same in every run.
pub fn config(seed: u64) -> ProptestConfig {
    ProptestConfig {
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(seed),
        cases: 1000,
        ..ProptestConfig::default()
    }
}
