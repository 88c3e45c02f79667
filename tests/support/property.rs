//! Settings of the property-based tests of all crates.

use proptest::test_runner::{Config, RngSeed, contextualize_config};

/// Returns the settings for `cases` random cases, which are the same in every run; a failing case is printed and not saved.
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
