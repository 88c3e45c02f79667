//! Fuzz target of tables of measurements and of the motion in a design file.

use crate::bytes::with_file;
use supple_core::trajectory::Fourier;
use supple_ident::{FourierCoefficients, read_csv};

/// Input that begins with a brace is a JSON motion of three joints; other input is a table for three joints.
pub fn csv(data: &[u8]) {
    if data.starts_with(b"{") {
        return series(data);
    }
    with_file("input.csv", data, |path| match read_csv(path, 3) {
        Err(error) => assert!(!error.to_string().is_empty()),
        Ok(log) => {
            assert_eq!(log.q_rad.shape(), (log.t_s.len(), 3));
            if let Err(error) = log.check(3, &[0, 1, 2]) {
                assert!(!error.to_string().is_empty());
            }
        }
    });
}

fn series(data: &[u8]) {
    let Ok(lists) = serde_json::from_slice::<FourierCoefficients>(data) else {
        return;
    };
    if let Ok(series) = lists.fourier::<3>() {
        assert_eq!(FourierCoefficients::from(&series), lists);
        if Fourier::validate(&series).is_ok() {
            let _ = series.at(0.5 * series.duration_s);
        }
    }
}
