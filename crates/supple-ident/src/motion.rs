//! Resamples and filters a log into angles, velocities, accelerations and torques on a regular grid.
//!
//! Steps: linear interpolation onto the grid, zero-phase filter, central differences, decimation. All signals
//! pass the same filter, so that none has extra lag or attenuation. Filter transients at both ends are
//! discarded.

use crate::error::{IdentError, Warning, positive, shape_error};
use crate::filter::{LowPass, differentiate};
use crate::log::Log;
use crate::spikes::without_spikes;
use nalgebra::DMatrix;

/// Length of the filter's transient at an end, in periods of its cutoff: its slowest pole pair decays to 1 %.
const TRANSIENT_PERIODS: f64 = 2.0;

/// Maximum number of samples of a grid: three hours at 1 kHz.
const MAX_SAMPLES: f64 = 1e7;

/// Options of the preparation of a log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Preparation {
    /// Rate of the grid \[Hz\]; `None` takes the log's own mean rate.
    pub rate_hz: Option<f64>,
    /// Cutoff of the zero-phase filter \[Hz\]; `None` leaves the signals as they are.
    pub cutoff_hz: Option<f64>,
    /// Decimation factor, at least 1.
    pub decimation_factor: usize,
    /// Time from a logged torque to its action on the logged angles \[s\], either sign: 1.5 periods if the log contains
    /// commands that act during the next cycle, negative if it contains measured torques that lag behind the angles.
    pub torque_delay_s: f64,
}

impl Default for Preparation {
    /// Returns default options: the log's own rate, cutoff at 8 Hz, every sample, no torque delay.
    fn default() -> Self {
        Self {
            rate_hz: None,
            cutoff_hz: Some(8.0),
            decimation_factor: 1,
            torque_delay_s: 0.0,
        }
    }
}

impl Preparation {
    /// Returns the indices of the kept samples of a grid of `samples` at `rate_hz`: decimated, without the filter
    /// transients at both ends.
    ///
    /// # Errors
    /// [`IdentError::Shape`] if the log is no longer than its transients.
    pub fn kept(&self, rate_hz: f64, samples: usize) -> Result<Vec<usize>, IdentError> {
        let ends = |cutoff_hz: f64| (TRANSIENT_PERIODS * rate_hz / cutoff_hz).ceil() as usize;
        let end = self.cutoff_hz.map_or(0, ends);
        if samples < 2 * end + 3 * self.decimation_factor {
            return Err(shape_error(
                "log",
                format!(
                    "more than {:.3} s: the filter's transient at both ends is cut off",
                    (2 * end + 3 * self.decimation_factor) as f64 / rate_hz
                ),
                format!("{:.3} s", samples as f64 / rate_hz),
            ));
        }
        Ok((end..samples - end)
            .step_by(self.decimation_factor)
            .collect())
    }
}

/// An interval whose samples are not used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExcludedInterval {
    /// Joint whose torque is not used; `None`: all joints.
    pub joint: Option<usize>,
    /// Start \[s\], on the log's clock.
    pub from_s: f64,
    /// End \[s\].
    pub to_s: f64,
}

/// Prepared measurements, (samples, joints), at a constant rate.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Samples per second \[Hz\].
    pub rate_hz: f64,
    /// Angles \[rad\].
    pub q: DMatrix<f64>,
    /// Velocities \[rad/s\].
    pub qd: DMatrix<f64>,
    /// Accelerations \[rad/s^2\].
    pub qdd: DMatrix<f64>,
    /// Torques \[N m\].
    pub tau: DMatrix<f64>,
    /// Effective number of independent samples per kept sample, at most 1 (filtered noise is correlated).
    pub independent_fraction: f64,
    /// Cutoff of the zero-phase filter applied to the torques \[Hz\]; columns that are discontinuous at a
    /// reversal are filtered likewise.
    pub cutoff_hz: Option<f64>,
    /// Time of the first sample \[s\], on the log's clock.
    pub start_s: f64,
    /// Delay by which the torques were shifted \[s\], see [`Preparation::torque_delay_s`].
    pub torque_delay_s: f64,
    /// Intervals that are not used.
    pub excluded_intervals: Vec<ExcludedInterval>,
}

impl Motion {
    /// Checks `log` for an arm of `dof` joints, of which `identified_joints` are identified, replaces its spikes, and prepares it.
    ///
    /// # Errors
    /// A log that [`Log::check`] rejects; an option out of range; too few samples to filter.
    pub fn prepare(
        log: &Log,
        dof: usize,
        identified_joints: &[usize],
        preparation: &Preparation,
    ) -> Result<(Motion, Vec<Warning>), IdentError> {
        let mut warnings = log.check_with_cutoff(dof, identified_joints, preparation.cutoff_hz)?;
        let Some((cleaned, spikes)) = without_spikes(log) else {
            return Ok((Self::from_checked_log(log, preparation)?, warnings));
        };
        warnings.extend(spikes);
        Ok((Self::from_checked_log(&cleaned, preparation)?, warnings))
    }

    /// Does the same as [`Motion::prepare`], from a log that has been checked already.
    pub(crate) fn from_checked_log(
        log: &Log,
        preparation: &Preparation,
    ) -> Result<Motion, IdentError> {
        if preparation.decimation_factor == 0 {
            return Err(IdentError::Option {
                option: "keep_every",
                value: 0.0,
                must: "1 or more",
            });
        }
        let steps = (log.t_s.len() - 1) as f64;
        let own_rate = steps / (log.t_s[log.t_s.len() - 1] - log.t_s[0]);
        let rate_hz = preparation.rate_hz.unwrap_or(own_rate);
        positive("rate_hz", rate_hz)?;
        let samples = (log.t_s[log.t_s.len() - 1] - log.t_s[0]) * rate_hz;
        if samples > MAX_SAMPLES {
            return Err(shape_error(
                "log",
                format!("at most {MAX_SAMPLES:e} samples at the rate of the grid, {rate_hz} Hz"),
                format!("{samples:e}: give a lower rate, or correct the column t (s)"),
            ));
        }
        let low_pass = preparation
            .cutoff_hz
            .map(|cutoff_hz| LowPass::butterworth4(cutoff_hz, rate_hz))
            .transpose()?;
        let delay_s = preparation.torque_delay_s;
        if !delay_s.is_finite() {
            return Err(IdentError::Option {
                option: "torque_delay_s",
                value: delay_s,
                must: "finite",
            });
        }
        let smooth = |column: &DMatrix<f64>, delay_s: f64| {
            let grid = resample(&log.t_s, column, rate_hz, delay_s);
            low_pass.map_or_else(|| Ok(grid.clone()), |f| f.zero_phase_columns(&grid))
        };
        let q = smooth(&log.q_rad, 0.0)?;
        let qd = match &log.qd_rad_per_s {
            Some(qd) => smooth(qd, 0.0)?,
            None => differentiate(&q, rate_hz)?,
        };
        let qdd = differentiate(&qd, rate_hz)?;
        let tau = smooth(&log.tau_nm, delay_s)?;
        let every = preparation.decimation_factor;
        let rows = preparation.kept(rate_hz, q.nrows())?;
        let kept_hz = rate_hz / every as f64;
        let independent = preparation.cutoff_hz.map_or(1.0, |hz| 2.0 * hz / kept_hz);
        let motion = Motion {
            rate_hz: kept_hz,
            q: q.select_rows(&rows),
            qd: qd.select_rows(&rows),
            qdd: qdd.select_rows(&rows),
            tau: tau.select_rows(&rows),
            independent_fraction: independent.min(1.0),
            cutoff_hz: preparation.cutoff_hz.filter(|hz| *hz < 0.45 * kept_hz),
            start_s: log.t_s[0] + rows[0] as f64 / rate_hz,
            torque_delay_s: preparation.torque_delay_s,
            excluded_intervals: Vec::new(),
        };
        Ok(motion)
    }

    /// Returns the time of a sample \[s\], on the log's clock.
    pub fn time_s(&self, sample: usize) -> f64 {
        self.start_s + sample as f64 / self.rate_hz
    }

    /// Returns whether the torque of a joint at a sample is used.
    pub fn used(&self, sample: usize, joint: usize) -> bool {
        let t_s = self.time_s(sample);
        let covers = |interval: &ExcludedInterval| {
            let of_joint = interval.joint.is_none_or(|j| j == joint);
            of_joint && (interval.from_s..=interval.to_s).contains(&t_s)
        };
        !self.excluded_intervals.iter().any(covers)
    }

    /// Returns the number of samples.
    pub fn samples(&self) -> usize {
        self.q.nrows()
    }

    /// Returns the samples `range`, at the same rate.
    pub fn part(&self, range: std::ops::Range<usize>) -> Motion {
        let cut = |m: &DMatrix<f64>| m.rows_range(range.clone()).into_owned();
        Motion {
            q: cut(&self.q),
            qd: cut(&self.qd),
            qdd: cut(&self.qdd),
            tau: cut(&self.tau),
            start_s: self.time_s(range.start),
            excluded_intervals: self.excluded_intervals.clone(),
            ..*self
        }
    }
}

/// Interpolates the columns, delayed by `delay_s`, linearly onto a grid that starts with the log and ends
/// within it; before the start of the log its first sample is used. Times must increase, see [`Log::check`].
pub fn resample(t_s: &[f64], columns: &DMatrix<f64>, rate_hz: f64, delay_s: f64) -> DMatrix<f64> {
    let (Some(&start), Some(&end)) = (t_s.first(), t_s.last()) else {
        return columns.clone();
    };
    // The tolerance keeps the last sample of a regular log on its own grid.
    let samples = ((end - start) * rate_hz + 1e-6).floor() as usize + 1;
    let mut resampled = DMatrix::zeros(samples, columns.ncols());
    let mut right = 1;
    for i in 0..samples {
        let t = (start + i as f64 / rate_hz - delay_s).clamp(start, end);
        while right + 1 < t_s.len() && t_s[right] < t {
            right += 1;
        }
        let fraction = (t - t_s[right - 1]) / (t_s[right] - t_s[right - 1]);
        for j in 0..columns.ncols() {
            let (a, b) = (columns[(right - 1, j)], columns[(right, j)]);
            resampled[(i, j)] = a + fraction * (b - a);
        }
    }
    resampled
}
