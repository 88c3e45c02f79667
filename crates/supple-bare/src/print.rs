//! Output of numbers, bit for bit, and of what was rejected.

use core::fmt::{self, Write};
use supple_core::Vector;

/// Period of every step \[s\].
pub(super) const PERIOD_S: f64 = 1e-3;

pub(super) fn print<const N: usize>(
    out: &mut impl Write,
    name: &str,
    values: &Vector<N>,
) -> fmt::Result {
    write!(out, "{name}")?;
    for value in values.iter() {
        write!(out, " {:016x} ({value:.6})", value.to_bits())?;
    }
    writeln!(out)
}

/// Prints why something was rejected.
pub(super) fn refused<T>(
    result: Result<T, impl fmt::Display>,
    out: &mut impl Write,
) -> Result<T, fmt::Error> {
    result.or_else(|error| {
        writeln!(out, "refused: {error}")?;
        Err(fmt::Error)
    })
}
