//! A derived setting and its rounding.

use core::fmt;

/// A setting that was derived, not given.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Derived {
    /// The key, with its section.
    pub key: String,
    /// Its value, as in TOML.
    pub value: String,
    /// Where it comes from.
    pub why: String,
}

impl fmt::Display for Derived {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} = {} ({})", self.key, self.value, self.why)
    }
}

/// Rounds to two significant digits, so that a reader can distinguish chosen from exact values, and that a different rounding in
/// another build has no effect.
pub(super) fn rounded(value: f64) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return value;
    }
    // The shortest decimal of two digits is exact in text and reads back as the same number everywhere.
    format!("{value:.1e}").parse().unwrap_or(value)
}
