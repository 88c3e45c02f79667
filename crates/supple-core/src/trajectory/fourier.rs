//! Excitation in joint space: one Fourier series per joint, all with the same fundamental
//! frequency.
//!
//! ```text
//! q(s) = centre + sum_k sine_k sin(k omega s) + cosine_k cos(k omega s),   k = 1..5
//! ```
//!
//! `s` is the scaled time, whose rate is ramped from 0 to 1 at the start and back to 0 at the end
//! (series from Swevers et al. 1997, "Optimal robot excitation and identification"). After the end
//! the reference is constant.

use super::reference::{TrajectoryError, positive, time_scaling};
use crate::config::Limits;
use crate::math::{Vector, abs, all_finite, sin_cos};
use core::f64::consts::TAU;

/// Number of terms of the series.
pub const HARMONICS: usize = 5;
/// Sample points per period of the highest harmonic at which a series is checked against limits.
const POINTS: usize = 32;

/// Series of all joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fourier<const N: usize> {
    /// Constant term \[rad\].
    pub centre_rad: Vector<N>,
    /// Amplitudes of the sines, one vector of joints per harmonic \[rad\].
    pub sine_rad: [Vector<N>; HARMONICS],
    /// Amplitudes of the cosines \[rad\].
    pub cosine_rad: [Vector<N>; HARMONICS],
    /// `omega` \[rad/s\], positive.
    pub angular_frequency_rad_per_s: f64,
    /// Time from rest to rest \[s\], at least twice `ramp_s`.
    pub duration_s: f64,
    /// Ramp time of the time scaling, at the start and at the end \[s\], positive.
    pub ramp_s: f64,
}

/// Reference of all joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointReference<const N: usize> {
    /// Angles \[rad\].
    pub position_rad: Vector<N>,
    /// Velocities \[rad/s\].
    pub velocity_rad_per_s: Vector<N>,
    /// Accelerations \[rad/s^2\].
    pub acceleration_rad_per_s2: Vector<N>,
}

/// Limit of a joint that a series violates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LimitViolation {
    /// Beyond a stop: joint and angle \[rad\].
    Position(usize, f64),
    /// Too fast: joint, speed and limit \[rad/s\].
    Speed(usize, f64, f64),
}

impl<const N: usize> Fourier<N> {
    /// Returns a series with zero amplitudes: rest at `centre_rad` for `duration_s`.
    pub fn at_rest(centre_rad: Vector<N>, angular_frequency_rad_per_s: f64) -> Fourier<N> {
        let period_s = TAU / angular_frequency_rad_per_s;
        Fourier {
            centre_rad,
            sine_rad: [Vector::zeros(); HARMONICS],
            cosine_rad: [Vector::zeros(); HARMONICS],
            angular_frequency_rad_per_s,
            duration_s: period_s,
            ramp_s: 0.1 * period_s,
        }
    }

    /// Returns the period at full speed \[s\].
    pub fn period_s(&self) -> f64 {
        TAU / self.angular_frequency_rad_per_s
    }

    /// Returns the reference at `time_s` since the start.
    pub fn at(&self, time_s: f64) -> JointReference<N> {
        let left_s = self.duration_s - time_s.max(0.0);
        let (s, time_scale, time_scale_rate) = if time_s <= 0.5 * self.duration_s {
            time_scaling(time_s.max(0.0), self.ramp_s)
        } else {
            let (to_go, time_scale, rate) = time_scaling(left_s.max(0.0), self.ramp_s);
            (self.duration_s - self.ramp_s - to_go, time_scale, -rate)
        };
        let (position_rad, slope, curve) = self.series(s);
        JointReference {
            position_rad,
            velocity_rad_per_s: slope * time_scale,
            acceleration_rad_per_s2: curve * (time_scale * time_scale) + slope * time_scale_rate,
        }
    }

    /// Returns the series and its two derivatives at `s`.
    fn series(&self, s: f64) -> (Vector<N>, Vector<N>, Vector<N>) {
        let omega = self.angular_frequency_rad_per_s;
        let (sin1, cos1) = sin_cos(omega * s);
        let (mut sin, mut cos) = (0.0, 1.0);
        let (mut value, mut slope, mut curve) = (self.centre_rad, Vector::zeros(), Vector::zeros());
        for (k, (a, b)) in self.sine_rad.iter().zip(&self.cosine_rad).enumerate() {
            (sin, cos) = (sin * cos1 + cos * sin1, cos * cos1 - sin * sin1);
            let w = (k + 1) as f64 * omega;
            value += a * sin + b * cos;
            slope += a * (w * cos) - b * (w * sin);
            curve -= a * (w * w * sin) + b * (w * w * cos);
        }
        (value, slope, curve)
    }

    /// Rejects a series that cannot be followed.
    ///
    /// # Errors
    /// The first invalid entry.
    pub fn validate(&self) -> Result<(), TrajectoryError> {
        let columns = self.sine_rad.iter().chain(&self.cosine_rad);
        for column in columns.chain([&self.centre_rad]) {
            if !all_finite(column) {
                return Err(TrajectoryError {
                    entry: "amplitude of the excitation",
                    value: f64::NAN,
                    must: "finite",
                });
            }
        }
        positive(
            "angular_frequency_rad_per_s",
            self.angular_frequency_rad_per_s,
        )?;
        positive("ramp_s", self.ramp_s)?;
        positive("duration_s", self.duration_s)?;
        if self.duration_s < 2.0 * self.ramp_s {
            return Err(TrajectoryError {
                entry: "duration_s",
                value: self.duration_s,
                must: "at least twice ramp_s",
            });
        }
        Ok(())
    }

    /// Checks the series against the joint limits (without the soft zones) and the speed limits at
    /// sample points over one period. Between the points it may exceed a limit by 0.5 % of an
    /// amplitude; the supervisor checks the arm itself.
    ///
    /// # Errors
    /// The first violated limit.
    pub fn within(&self, limits: &Limits<N>) -> Result<(), LimitViolation> {
        let points = POINTS * HARMONICS;
        for i in 0..points {
            let s = self.period_s() * i as f64 / points as f64;
            let (q, qd, _) = self.series(s);
            for joint in 0..N {
                let lower = limits.position_lower_rad[joint] + limits.soft_zone_rad;
                let upper = limits.position_upper_rad[joint] - limits.soft_zone_rad;
                if !(lower..=upper).contains(&q[joint]) {
                    return Err(LimitViolation::Position(joint, q[joint]));
                }
                let speed = abs(qd[joint]);
                let limit = limits.joint_speed_rad_per_s[joint];
                if speed > limit || speed.is_nan() {
                    return Err(LimitViolation::Speed(joint, speed, limit));
                }
            }
        }
        Ok(())
    }
}
