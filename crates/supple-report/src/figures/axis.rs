//! An axis for the drawing library: quantity with unit, range and round ticks.

use super::ticks::{Ticks, number};
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use std::ops::Range;

/// One axis.
#[derive(Clone, Debug)]
pub struct Axis<'a> {
    /// Quantity and unit.
    pub label: &'a str,
    /// Tick positions and range.
    pub scale: Scale,
}

impl<'a> Axis<'a> {
    /// Creates an axis from the first tick to the last.
    pub fn new(label: &'a str, ticks: Ticks) -> Axis<'a> {
        let range = ticks.range();
        Axis::bounded(label, ticks, range)
    }

    /// Creates an axis over a given range; ticks outside the range are omitted.
    pub fn bounded(label: &'a str, ticks: Ticks, range: Range<f64>) -> Axis<'a> {
        let inside = |at: &f64| range.start <= *at && *at <= range.end;
        let ticks = Ticks {
            at: ticks.at.into_iter().filter(inside).collect(),
            ..ticks
        };
        Axis {
            label,
            scale: Scale {
                ticks,
                range,
                logarithmic: false,
            },
        }
    }

    /// Creates a logarithmic axis over a range above zero, with ticks at 1, 2 and 5 of each decade. Of a range from zero it shows the last
    /// three decades; smaller values are drawn at the start of the axis.
    pub fn logarithmic(label: &'a str, range: Range<f64>) -> Axis<'a> {
        let end = if range.end > 0.0 { range.end } else { 1.0 };
        let start = if range.start > 0.0 {
            range.start
        } else {
            1e-3 * end
        };
        let range = start..end;
        let first = range.start.log10().floor() as i32;
        let last = range.end.log10().ceil() as i32;
        let ticks_at = (first..=last)
            .flat_map(|d| [1.0, 2.0, 5.0].map(|mantissa| mantissa * 10.0_f64.powi(d)));
        let ticks = Ticks {
            at: ticks_at.collect(),
            decimals: 0,
        };
        let mut axis = Axis::bounded(label, ticks, range);
        axis.scale.logarithmic = true;
        axis
    }
}

/// Mapping from values to positions along an axis, linear or logarithmic, with its ticks.
#[derive(Clone, Debug)]
pub struct Scale {
    ticks: Ticks,
    range: Range<f64>,
    logarithmic: bool,
}

impl Scale {
    fn coordinate(&self, value: f64) -> f64 {
        if self.logarithmic {
            value.max(self.range.start).log10()
        } else {
            value
        }
    }
}

impl Ranged for Scale {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        let (from, to) = (
            self.coordinate(self.range.start),
            self.coordinate(self.range.end),
        );
        let share = (self.coordinate(*value) - from) / (to - from);
        limit.0 + (share * f64::from(limit.1 - limit.0)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        // The axis has no minor grid lines.
        if hint.weight().allow_light_points() {
            return Vec::new();
        }
        self.ticks.at.clone()
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}

impl ValueFormatter<f64> for Scale {
    fn format(value: &f64) -> String {
        value.to_string()
    }

    fn format_ext(&self, value: &f64) -> String {
        if self.logarithmic {
            let decimals = (-value.log10().floor()).max(0.0);
            return number(*value, decimals as usize);
        }
        self.ticks.label(*value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A force that is never above zero gave a range from zero: the decades of its ticks began at the smallest integer.
    #[test]
    fn a_logarithmic_axis_from_zero_has_few_ticks() {
        for (range, expected) in [
            (0.0..5.0, 5e-3),
            (-1.0..5.0, 5e-3),
            (0.0..0.0, 1e-3),
            (0.1..5.0, 0.1),
        ] {
            let scale = Axis::logarithmic("force [N]", range).scale;
            assert!(scale.ticks.at.len() < 20, "{:?}", scale.ticks);
            assert!(
                (scale.range.start - expected).abs() < 1e-12,
                "{:?}",
                scale.range
            );
            assert!(scale.coordinate(0.0).is_finite());
        }
    }
}
