//! Recordings of the simulated arm as logs for identification, and how they are prepared.

use crate::request_sequence::Recording;
use supple_ident::{Log, Preparation};

/// Cutoff of the filters for the model and for the faster ripple \[Hz\].
pub(crate) const CUTOFF_HZ: (f64, f64) = (8.0, 40.0);

/// Converts a recording to a log for identification.
pub fn log_of(recording: &Recording) -> Log {
    Log {
        t_s: recording.t_s.clone(),
        q_rad: recording.q_rad.clone(),
        qd_rad_per_s: None,
        tau_nm: recording.tau_nm.clone(),
    }
}

/// Returns the preparation of the project's own logs: a command acts during the following cycle.
pub fn preparation(period_s: f64, cutoff_hz: f64) -> Preparation {
    let kept_hz = 12.5 * cutoff_hz;
    let decimation_factor = ((1.0 / period_s) / kept_hz).round().max(1.0) as usize;
    Preparation {
        rate_hz: Some(1.0 / period_s),
        cutoff_hz: Some(cutoff_hz),
        decimation_factor,
        torque_delay_s: 1.5 * period_s,
    }
}
