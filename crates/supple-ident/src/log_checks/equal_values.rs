//! Runs of equal values of a column.

/// A run: first sample and one past the last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Run {
    pub first: usize,
    pub end: usize,
}

impl Run {
    pub fn len(&self) -> usize {
        self.end - self.first
    }
}

/// Returns all runs of equal values, also those of one sample.
pub(super) fn runs(values: &[f64]) -> Vec<Run> {
    let mut found = Vec::new();
    let mut first = 0;
    for i in 1..=values.len() {
        if i == values.len() || values[i] != values[first] {
            found.push(Run { first, end: i });
            first = i;
        }
    }
    found
}

/// Returns the smallest change between successive values that is not zero: the quantum of a quantised column.
pub(super) fn quantum(values: &[f64]) -> f64 {
    let range = values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
        - values.iter().copied().fold(f64::INFINITY, f64::min);
    let changes = values.windows(2).map(|w| (w[1] - w[0]).abs());
    // Ignore differences due to rounding.
    let changes = changes.filter(|change| *change > 1e-9 * range);
    changes.fold(f64::INFINITY, f64::min)
}

/// Returns the median of a list that is not empty.
pub(super) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}
