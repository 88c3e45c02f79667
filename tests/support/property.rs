//! Settings of the property tests of all crates.

use proptest::test_runner::{Config, RngSeed, contextualize_config};

/// `cases` random cases, the same in every run; a failing case is printed, not saved.
///
/// `PROPTEST_CASES` and `PROPTEST_RNG_SEED` override number and seed.
pub fn config(cases: u32, seed: u64) -> Config {
    contextualize_config(Config {
        cases,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(seed),
        ..Config::default()
    })
}
