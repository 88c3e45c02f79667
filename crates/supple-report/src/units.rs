//! Formats numbers for display: three significant figures, a unit, a typographic minus sign.

/// Text in place of a value of a run that was left out.
pub const LEFT_OUT: &str = "left out";

/// Formats a number with three significant figures.
pub fn figures(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return plain(value, 0);
    }
    let magnitude = value.abs().log10().floor() as i32;
    plain(value, usize::try_from(2 - magnitude).unwrap_or(0))
}

/// Formats a number with a fixed number of decimals; a value that is not a number is of a run that was left out.
pub fn plain(value: f64, decimals: usize) -> String {
    if value.is_nan() {
        return LEFT_OUT.to_owned();
    }
    format!("{value:.decimals$}").replace('-', "\u{2212}")
}

/// Formats metres as millimetres.
pub fn mm(metres: f64) -> String {
    if metres.is_nan() {
        return LEFT_OUT.to_owned();
    }
    format!("{} mm", plain(1e3 * metres, 1))
}

/// Formats newtons.
pub fn newtons(value: f64) -> String {
    format!("{} N", figures(value))
}

/// Formats newton seconds.
pub fn newton_seconds(value: f64) -> String {
    format!("{} N s", figures(value))
}

/// Formats newton metres.
pub fn newton_metres(value: f64) -> String {
    format!("{} N m", figures(value))
}

/// Formats a fraction as percent.
pub fn percent(fraction: f64) -> String {
    format!("{} %", figures(100.0 * fraction))
}

/// Formats seconds.
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
