//! Round numbers for axes.

use std::ops::Range;

/// Ticks of an axis, normally from one end of the axis to the other.
#[derive(Clone, Debug, PartialEq)]
pub struct Ticks {
    /// Tick positions: sorted, evenly spaced round numbers.
    pub at: Vec<f64>,
    /// Number of decimals of the labels.
    pub decimals: usize,
}

impl Ticks {
    /// Returns about `count` round ticks that enclose the values, at least two.
    pub fn around(range: Range<f64>, count: usize) -> Ticks {
        let size = range.start.abs().max(range.end.abs());
        let span = range.end - range.start;
        if span <= 1e-9 * size || span <= 0.0 {
            return Ticks::around(range.start..range.start + size.max(1.0), count);
        }
        Ticks::stepped(range, round_up(span / count as f64))
    }

    /// Returns multiples of `step` that enclose the values.
    pub fn stepped(range: Range<f64>, step: f64) -> Ticks {
        // A bound that differs from a tick only by rounding counts as the tick.
        const SLACK: f64 = 1e-9;
        let first = (range.start / step + SLACK).floor();
        let last = (range.end / step - SLACK).ceil().max(first + 1.0);
        let count = (last - first) as usize + 1;
        Ticks {
            at: (0..count).map(|k| (first + k as f64) * step).collect(),
            decimals: decimals(step),
        }
    }

    /// Range from the first tick to the last.
    pub fn range(&self) -> Range<f64> {
        let first = self.at.first().copied().unwrap_or(0.0);
        let last = self.at.last().copied().unwrap_or(1.0);
        first..last
    }

    /// Label of a tick.
    pub fn label(&self, value: f64) -> String {
        number(value, self.decimals)
    }
}

/// Formats a number with the given decimals and a typographic minus sign. A number that rounds to zero becomes "0".
pub fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let zero = text.chars().all(|c| matches!(c, '-' | '0' | '.'));
    if zero {
        "0".to_owned()
    } else {
        text.replace('-', "\u{2212}")
    }
}

/// Returns the smallest number of the form 1, 2, 2.5 or 5 times a power of ten that is not below `value`.
fn round_up(value: f64) -> f64 {
    let power = 10.0_f64.powf(value.log10().floor());
    let mantissa = value / power;
    let round = [1.0, 2.0, 2.5, 5.0, 10.0];
    power
        * round
            .into_iter()
            .find(|r| mantissa <= r * (1.0 + 1e-9))
            .unwrap_or(10.0)
}

fn decimals(step: f64) -> usize {
    (0..9)
        .find(|d| {
            let scaled = step * 10.0_f64.powi(*d as i32);
            (scaled - scaled.round()).abs() < 1e-6
        })
        .unwrap_or(9)
}

/// Returns minimum and maximum of the finite values, or 0..1 if there are none.
pub fn extent(values: impl IntoIterator<Item = f64>) -> Range<f64> {
    let mut range: Option<Range<f64>> = None;
    for value in values.into_iter().filter(|value| value.is_finite()) {
        range = Some(range.map_or(value..value, |r| r.start.min(value)..r.end.max(value)));
    }
    range.unwrap_or(0.0..1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_enclose() {
        let ticks = Ticks::around(-0.3..17.2, 5);
        assert_eq!(ticks.at, [-5.0, 0.0, 5.0, 10.0, 15.0, 20.0]);
        assert_eq!(ticks.decimals, 0);
        let ticks = Ticks::around(0.4..0.8, 4);
        assert_eq!(ticks.range(), 0.4..0.8);
        assert_eq!(ticks.label(0.5), "0.5");
        assert_eq!(Ticks::around(0.0..1.0, 4).decimals, 2);
        assert_eq!(Ticks::around(0.0..1.0, 4).label(-0.25), "\u{2212}0.25");
    }

    #[test]
    fn a_single_value_gives_an_axis_of_nonzero_length() {
        let ticks = Ticks::around(3.0..3.0, 5);
        assert!(
            ticks.at.len() >= 2 && ticks.range().contains(&3.0),
            "{ticks:?}"
        );
        assert_eq!(Ticks::around(0.0..0.0, 4).range(), 0.0..1.0);
        assert_eq!(extent([]), 0.0..1.0);
        assert_eq!(extent([f64::NAN, 2.0, f64::INFINITY]), 2.0..2.0);
    }

    #[test]
    fn a_number_that_rounds_to_zero_has_no_sign() {
        assert_eq!(Ticks::around(-1.0..1.0, 4).label(-0.0), "0");
    }
}
