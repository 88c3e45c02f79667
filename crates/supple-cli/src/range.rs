//! Range checks for numeric arguments: a value such as `1e300` would exhaust memory or never terminate.

/// Returns a parser for finite numbers from `min` to `max`, both included.
pub fn between(
    min: f64,
    max: f64,
) -> impl Fn(&str) -> Result<f64, String> + Clone + Send + Sync + 'static {
    move |text| match text.trim().parse::<f64>() {
        Ok(value) if (min..=max).contains(&value) => Ok(value),
        _ => Err(format!("give a number from {min} to {max}")),
    }
}

#[cfg(test)]
mod tests {
    use super::between;

    #[test]
    fn only_numbers_within_the_range_are_accepted() {
        let parse = between(-1.0, 1e3);
        for (text, value) in [("-1", -1.0), ("0.5", 0.5), ("1e3", 1e3)] {
            assert_eq!(parse(text), Ok(value));
        }
        for text in ["-1.01", "1e300", "inf", "nan", "", "ten", "1e400"] {
            let error = parse(text).expect_err(text);
            assert!(error.contains("from -1 to 1000"), "{error}");
        }
    }
}
