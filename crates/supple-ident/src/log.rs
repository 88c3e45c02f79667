//! A log as plain columns, with checks of its data.
//!
//! [`Log`] is independent of file formats; [`crate::read_logs`] reads files.

use crate::error::{IdentError, Warning, log_error, shape_error};
use nalgebra::DMatrix;

/// Angles larger than this are assumed to be in degrees \[rad\].
pub(crate) const MAX_ANGLE_RAD: f64 = 25.0;
/// Minimum range of motion for identifying a joint \[rad\].
const MIN_RANGE_RAD: f64 = 0.02;
/// A time step longer than this multiple of the median is a gap.
const GAP_MEDIANS: f64 = 5.0;
/// Maximum gap that linear interpolation bridges, in periods of the filter's cutoff: the maximum error for a sinusoid at the
/// cutoff is `(2 pi 0.1)^2 / 8`, 5 % of its amplitude.
const GAP_PERIODS: f64 = 0.1;
/// Logs shorter than this cause a warning \[s\].
const SHORT_S: f64 = 5.0;

/// Measurements of one run. Matrices are (samples, joints), all joints of the arm.
#[derive(Clone, Debug, PartialEq)]
pub struct Log {
    /// Time \[s\], strictly increasing; steps may vary.
    pub t_s: Vec<f64>,
    /// Joint angles \[rad\].
    pub q_rad: DMatrix<f64>,
    /// Measured joint velocities \[rad/s\]; `None`: the angles are differentiated.
    pub qd_rad_per_s: Option<DMatrix<f64>>,
    /// Motor torques, commanded or measured, as joint torques \[N m\].
    pub tau_nm: DMatrix<f64>,
}

impl Log {
    /// Checks shapes, values, sample times, units and motion. `identified_joints` must move; the other joints
    /// may be at rest.
    ///
    /// # Errors
    /// [`IdentError`] with column, sample, value and remedy.
    pub fn check(
        &self,
        dof: usize,
        identified_joints: &[usize],
    ) -> Result<Vec<Warning>, IdentError> {
        self.check_with_cutoff(dof, identified_joints, None)
    }

    /// Does the same as [`Log::check`], but accepts gaps that are short relative to the period of the filter's cutoff \[Hz\],
    /// because interpolation over them is accurate enough.
    ///
    /// # Errors
    /// As [`Log::check`].
    pub fn check_with_cutoff(
        &self,
        dof: usize,
        identified_joints: &[usize],
        cutoff_hz: Option<f64>,
    ) -> Result<Vec<Warning>, IdentError> {
        let warnings = self.check_without_units(dof, identified_joints, cutoff_hz)?;
        self.check_units(identified_joints)?;
        Ok(warnings)
    }

    /// Does the same as [`Log::check_with_cutoff`], but does not check the units of angles and velocities.
    pub(crate) fn check_without_units(
        &self,
        dof: usize,
        identified_joints: &[usize],
        cutoff_hz: Option<f64>,
    ) -> Result<Vec<Warning>, IdentError> {
        self.check_table(dof, identified_joints)?;
        self.check_gaps(cutoff_hz)?;
        let mut warnings = self.check_motion(identified_joints)?;
        let duration = self.t_s[self.t_s.len() - 1] - self.t_s[0];
        if duration < SHORT_S {
            warnings.push(Warning {
                column: "t".to_owned(),
                problem: format!("the log lasts {duration:.3} s"),
                remedy: "record 30 s or more of excitation".to_owned(),
            });
        }
        Ok(warnings)
    }

    /// Checks shapes and values, and that the times increase.
    pub(crate) fn check_table(
        &self,
        dof: usize,
        identified_joints: &[usize],
    ) -> Result<(), IdentError> {
        self.check_shapes(dof)?;
        check_joint_list(dof, identified_joints)?;
        self.check_values()?;
        self.check_times()
    }

    fn check_shapes(&self, dof: usize) -> Result<(), IdentError> {
        let samples = self.t_s.len();
        if samples < 3 {
            return Err(shape_error("t", "at least 3 samples", format!("{samples}")));
        }
        for (name, matrix) in self.matrices() {
            if matrix.shape() != (samples, dof) {
                let (rows, columns) = matrix.shape();
                return Err(shape_error(
                    name,
                    format!("({samples}, {dof}): one row per sample, one column per joint"),
                    format!("({rows}, {columns})"),
                ));
            }
        }
        Ok(())
    }

    fn check_values(&self) -> Result<(), IdentError> {
        let remedy = "remove these rows, or interpolate the missing samples";
        if let Some(i) = self.t_s.iter().position(|t| !t.is_finite()) {
            return Err(log_error("t", format!("not finite at sample {i}"), remedy));
        }
        for (name, matrix) in self.matrices() {
            for (joint, column) in matrix.column_iter().enumerate() {
                if let Some(i) = column.iter().position(|x| !x.is_finite()) {
                    let problem = format!("{} at sample {i}", column[i]);
                    return Err(log_error(format!("{name}[{joint}]"), problem, remedy));
                }
            }
        }
        Ok(())
    }

    fn steps_s(&self) -> Vec<f64> {
        self.t_s.windows(2).map(|w| w[1] - w[0]).collect()
    }

    fn check_times(&self) -> Result<(), IdentError> {
        let steps = self.steps_s();
        if let Some(i) = steps.iter().position(|dt| *dt <= 0.0) {
            let problem = format!(
                "goes from {} to {} s at sample {i}",
                self.t_s[i],
                self.t_s[i + 1]
            );
            return Err(log_error(
                "t",
                problem,
                "sort the rows and drop repeated ones",
            ));
        }
        Ok(())
    }

    fn check_gaps(&self, cutoff_hz: Option<f64>) -> Result<(), IdentError> {
        let mut steps = self.steps_s();
        let largest = steps.iter().copied().fold(0.0, f64::max);
        let at = steps.iter().position(|dt| *dt == largest).unwrap_or(0);
        steps.sort_by(f64::total_cmp);
        let median = steps[steps.len() / 2];
        let max_bridged_s = cutoff_hz.map_or(0.0, |hz| GAP_PERIODS / hz);
        if largest > (GAP_MEDIANS * median).max(max_bridged_s) {
            let problem = format!(
                "a gap of {largest:.4} s after sample {at}, steps are {median:.4} s otherwise"
            );
            return Err(log_error(
                "t",
                problem,
                "split the log there and give both parts",
            ));
        }
        Ok(())
    }

    fn check_motion(&self, identified_joints: &[usize]) -> Result<Vec<Warning>, IdentError> {
        let mut warnings = Vec::new();
        for (joint, column) in self.q_rad.column_iter().enumerate() {
            let (min, max) = (column.min(), column.max());
            if !identified_joints.contains(&joint) {
                continue;
            }
            let range = max - min;
            if range < MIN_RANGE_RAD {
                return Err(log_error(
                    format!("q[{joint}]"),
                    format!("moves by {range:.5} rad only: the joint is not excited"),
                    "leave it out of the moving joints, or record a log that moves it",
                ));
            }
            if range < 10.0 * MIN_RANGE_RAD {
                warnings.push(Warning {
                    column: format!("q[{joint}]"),
                    problem: format!("moves by {range:.3} rad only"),
                    remedy: "excite it over a larger part of its range".to_owned(),
                });
            }
            let torque = self.tau_nm.column(joint);
            if torque.max() == torque.min() {
                return Err(log_error(
                    format!("tau[{joint}]"),
                    format!("is {} throughout", torque[0]),
                    "check that the right column was read, or leave the joint out of the moving ones",
                ));
            }
        }
        Ok(warnings)
    }

    fn check_units(&self, identified_joints: &[usize]) -> Result<(), IdentError> {
        for (joint, column) in self.q_rad.column_iter().enumerate() {
            let max_angle = column.amax();
            if max_angle > MAX_ANGLE_RAD {
                return Err(log_error(
                    format!("q[{joint}]"),
                    format!("reaches {max_angle:.1}, which looks like degrees"),
                    "give radians: multiply by pi / 180",
                ));
            }
        }
        identified_joints
            .iter()
            .try_for_each(|j| self.check_velocity_unit(*j))
    }

    /// Compares the velocity with the slope of the angle; a velocity of 57 times the slope is in degrees per second.
    fn check_velocity_unit(&self, joint: usize) -> Result<(), IdentError> {
        let Some(qd) = &self.qd_rad_per_s else {
            return Ok(());
        };
        let samples = self.t_s.len();
        let (mut product, mut square) = (0.0, 0.0);
        for i in 1..samples {
            let dt = self.t_s[i] - self.t_s[i - 1];
            let slope = (self.q_rad[(i, joint)] - self.q_rad[(i - 1, joint)]) / dt;
            let mean = 0.5 * (qd[(i, joint)] + qd[(i - 1, joint)]);
            product += slope * mean;
            square += slope * slope;
        }
        let ratio = product / square;
        if (0.5..2.0).contains(&ratio) {
            return Ok(());
        }
        Err(log_error(
            format!("qd[{joint}]"),
            format!("is {ratio:.3} times the slope of q[{joint}]"),
            "give rad/s and rad, and the same order of joints; or leave the velocities out",
        ))
    }

    fn matrices(&self) -> impl Iterator<Item = (&'static str, &DMatrix<f64>)> {
        [
            ("q", Some(&self.q_rad)),
            ("qd", self.qd_rad_per_s.as_ref()),
            ("tau", Some(&self.tau_nm)),
        ]
        .into_iter()
        .filter_map(|(name, matrix)| matrix.map(|matrix| (name, matrix)))
    }
}

/// Rejects an empty list of joints, joints that do not exist, and joints that are not in increasing order.
pub(crate) fn check_joint_list(dof: usize, identified_joints: &[usize]) -> Result<(), IdentError> {
    let increasing = identified_joints.windows(2).all(|w| w[0] < w[1]);
    if !identified_joints.is_empty()
        && increasing
        && identified_joints.iter().all(|joint| *joint < dof)
    {
        return Ok(());
    }
    Err(shape_error(
        "moving",
        format!("joint numbers below {dof}, increasing, at least one"),
        format!("{identified_joints:?}"),
    ))
}
