//! Statistics of a run.

use serde::Serialize;

/// Running root mean square and maximum absolute value.
#[derive(Clone, Copy, Debug, Default)]
pub struct Rms {
    sum_of_squares: f64,
    count: u64,
    max_abs: f64,
}

impl Rms {
    /// Adds a value.
    pub fn add(&mut self, value: f64) {
        self.sum_of_squares += value * value;
        self.count += 1;
        self.max_abs = self.max_abs.max(value.abs());
    }

    /// Returns whether there are no values.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Returns the root mean square; zero without values.
    pub fn rms(&self) -> f64 {
        if self.count == 0 {
            return 0.0;
        }
        (self.sum_of_squares / self.count as f64).sqrt()
    }

    /// Returns the maximum absolute value; zero without values.
    pub fn max_abs(&self) -> f64 {
        self.max_abs
    }
}

/// Running mean.
#[derive(Clone, Copy, Debug, Default)]
pub struct Mean {
    sum: f64,
    count: u64,
}

impl Mean {
    /// Adds a value.
    pub fn add(&mut self, value: f64) {
        self.sum += value;
        self.count += 1;
    }

    /// Returns the mean; zero without values.
    pub fn mean(&self) -> f64 {
        if self.count == 0 {
            return 0.0;
        }
        self.sum / self.count as f64
    }
}

/// Straight line through points by least squares.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LineFit {
    /// Change of y per x.
    pub slope: f64,
    /// y at x = 0.
    pub intercept: f64,
    /// Coefficient of determination: fraction of the variance of y that the line explains.
    pub r2: f64,
}

impl LineFit {
    /// Fits a line; `None` if the points do not determine one.
    pub fn new(points: &[(f64, f64)]) -> Option<LineFit> {
        let n = points.len() as f64;
        let mean_x = points.iter().map(|p| p.0).sum::<f64>() / n;
        let mean_y = points.iter().map(|p| p.1).sum::<f64>() / n;
        let sum = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
            points.iter().map(|p| f(p.0 - mean_x, p.1 - mean_y)).sum()
        };
        let (xx, xy, yy) = (sum(&|x, _| x * x), sum(&|x, y| x * y), sum(&|_, y| y * y));
        if points.len() < 2 || xx <= 0.0 {
            return None;
        }
        let slope = xy / xx;
        Some(LineFit {
            slope,
            intercept: mean_y - slope * mean_x,
            r2: if yy > 0.0 { xy * xy / (xx * yy) } else { 1.0 },
        })
    }
}

/// Returns the median; `None` without values.
pub fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    match n {
        0 => None,
        _ if n % 2 == 1 => Some(sorted[n / 2]),
        _ => Some(0.5 * (sorted[n / 2 - 1] + sorted[n / 2])),
    }
}

/// Returns the range relative to the median, (max - min) / median; `None` without values.
pub fn spread(values: &[f64]) -> Option<f64> {
    let median = median(values)?;
    let (min, max) = values.iter().fold((f64::MAX, f64::MIN), |(min, max), v| {
        (min.min(*v), max.max(*v))
    });
    Some((max - min) / median)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_fit_recovers_the_line() {
        let points: Vec<_> = (0..7)
            .map(|k| (f64::from(k), 2.0 - 0.5 * f64::from(k)))
            .collect();
        let fit = LineFit::new(&points).expect("points determine a line");
        assert!((fit.slope + 0.5).abs() < 1e-12 && (fit.intercept - 2.0).abs() < 1e-12);
        assert!((fit.r2 - 1.0).abs() < 1e-12);
        assert!(LineFit::new(&[(1.0, 1.0), (1.0, 2.0)]).is_none());
    }

    #[test]
    fn the_median_and_the_spread_of_known_values_are_exact() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(median(&[]), None);
        assert_eq!(spread(&[1.0, 2.0, 3.0]), Some(1.0));
    }

    #[test]
    fn the_root_mean_square_of_known_values_is_exact() {
        let mut rms = Rms::default();
        [3.0, -4.0].into_iter().for_each(|x| rms.add(x));
        assert!((rms.rms() - 12.5_f64.sqrt()).abs() < 1e-15);
        assert_eq!(rms.max_abs(), 4.0);
        assert_eq!(Rms::default().rms(), 0.0);
    }
}
