//! Formats numbers for people: three significant figures, a unit, a typographic minus sign.

/// In place of a value of a run that was left out.
pub const LEFT_OUT: &str = "left out";

/// Three significant figures.
pub fn figures(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return plain(value, 0);
    }
    let magnitude = value.abs().log10().floor() as i32;
    plain(value, usize::try_from(2 - magnitude).unwrap_or(0))
}

/// Fixed number of decimals; a value that a run left out gives is no number.
pub fn plain(value: f64, decimals: usize) -> String {
    if value.is_nan() {
        return LEFT_OUT.to_owned();
    }
    format!("{value:.decimals$}").replace('-', "\u{2212}")
}

/// Metres, in millimetres.
pub fn mm(metres: f64) -> String {
    if metres.is_nan() {
        return LEFT_OUT.to_owned();
    }
    format!("{} mm", plain(1e3 * metres, 1))
}

/// Newtons.
pub fn newtons(value: f64) -> String {
    format!("{} N", figures(value))
}

/// Newton seconds.
pub fn newton_seconds(value: f64) -> String {
    format!("{} N s", figures(value))
}

/// Newton metres.
pub fn newton_metres(value: f64) -> String {
    format!("{} N m", figures(value))
}

/// A fraction, in percent.
pub fn percent(fraction: f64) -> String {
    format!("{} %", figures(100.0 * fraction))
}

/// Seconds.
pub fn seconds(value: f64) -> String {
    format!("{} s", plain(value, 2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_figures() {
        assert_eq!(figures(0.041_234), "0.0412");
        assert_eq!(figures(-12.345), "\u{2212}12.3");
        assert_eq!(figures(1234.5), "1234");
        assert_eq!(figures(0.0), "0");
        assert_eq!(mm(0.004_35), "4.3 mm");
        assert_eq!(percent(0.353), "35.3 %");
    }
}
