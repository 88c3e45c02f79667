//! Numbers on the command line, each within the range in which it makes sense: `1e300` would fill the memory
//! or never end.

/// A parser of finite numbers from `least` to `greatest`, both included.
pub fn between(
    least: f64,
    greatest: f64,
) -> impl Fn(&str) -> Result<f64, String> + Clone + Send + Sync + 'static {
    move |text| match text.trim().parse::<f64>() {
        Ok(value) if (least..=greatest).contains(&value) => Ok(value),
        _ => Err(format!("give a number from {least} to {greatest}")),
    }
}

#[cfg(test)]
mod tests {
    use super::between;

    #[test]
    fn only_what_is_within_passes() {
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
