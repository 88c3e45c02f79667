//! Excitation in joint space: a Fourier series a joint, all of one base frequency.
//!
//! ```text
//! q(s) = centre + sum_k sine_k sin(k omega s) + cosine_k cos(k omega s),   k = 1..5
//! ```
//!
//! `s` is time at a pace that is ramped from rest at the start and back to rest at the end
//! (Swevers et al. 1997, "Optimal robot excitation and identification", for the series). After its end it
//! stays where it is.

use super::{TrajectoryError, positive, ramped};
use crate::config::Limits;
use crate::math::{Vector, abs, all_finite, sin_cos};
use core::f64::consts::TAU;

/// Terms of the series.
pub const HARMONICS: usize = 5;
/// Points a period of the highest harmonic at which a series is held against limits.
const POINTS: usize = 32;

/// Series of all joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fourier<const N: usize> {
    /// Constant term \[rad\].
    pub centre_rad: Vector<N>,
    /// Amplitudes of the sines, one column of joints a harmonic \[rad\].
    pub sine_rad: [Vector<N>; HARMONICS],
    /// Amplitudes of the cosines \[rad\].
    pub cosine_rad: [Vector<N>; HARMONICS],
    /// `omega` \[rad/s\], positive.
    pub angular_frequency_rad_per_s: f64,
    /// Time from rest to rest \[s\], at least twice `ramp_s`.
    pub duration_s: f64,
    /// Time over which the pace grows and falls \[s\], positive.
    pub ramp_s: f64,
}

/// Where every joint should be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointReference<const N: usize> {
    /// Angles \[rad\].
    pub position_rad: Vector<N>,
    /// Velocities \[rad/s\].
    pub velocity_rad_per_s: Vector<N>,
    /// Accelerations \[rad/s^2\].
    pub acceleration_rad_per_s2: Vector<N>,
}

/// Which limit of a joint a series breaks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Beyond {
    /// Beyond a stop: joint and angle \[rad\].
    Position(usize, f64),
    /// Too fast: joint, speed and limit \[rad/s\].
    Speed(usize, f64, f64),
}

impl<const N: usize> Fourier<N> {
    /// At rest at `centre_rad` for `duration_s`, to be filled with amplitudes.
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

    /// One period at full pace \[s\].
    pub fn period_s(&self) -> f64 {
        TAU / self.angular_frequency_rad_per_s
    }

    /// Reference at `time_s` since the start.
    pub fn at(&self, time_s: f64) -> JointReference<N> {
        let left_s = self.duration_s - time_s.max(0.0);
        let (s, pace, pace_rate) = if time_s <= 0.5 * self.duration_s {
            ramped(time_s.max(0.0), self.ramp_s)
        } else {
            let (to_go, pace, rate) = ramped(left_s.max(0.0), self.ramp_s);
            (self.duration_s - self.ramp_s - to_go, pace, -rate)
        };
        let (position_rad, slope, curve) = self.series(s);
        JointReference {
            position_rad,
            velocity_rad_per_s: slope * pace,
            acceleration_rad_per_s2: curve * (pace * pace) + slope * pace_rate,
        }
    }

    /// The series and its two derivatives at `s`.
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

    /// Refuses what cannot be followed.
    ///
    /// # Errors
    /// The first entry that is wrong.
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

    /// Holds the series against the stops, without their soft zones, and the joint speeds, at points
    /// over a period. Between them it can be beyond by a two-hundredth of an amplitude: the supervisor
    /// watches the arm itself.
    ///
    /// # Errors
    /// The first limit that it breaks.
    pub fn within(&self, limits: &Limits<N>) -> Result<(), Beyond> {
        let points = POINTS * HARMONICS;
        for i in 0..points {
            let s = self.period_s() * i as f64 / points as f64;
            let (q, qd, _) = self.series(s);
            for joint in 0..N {
                let lower = limits.position_lower_rad[joint] + limits.soft_zone_rad;
                let upper = limits.position_upper_rad[joint] - limits.soft_zone_rad;
                if !(lower..=upper).contains(&q[joint]) {
                    return Err(Beyond::Position(joint, q[joint]));
                }
                let speed = abs(qd[joint]);
                let limit = limits.joint_speed_rad_per_s[joint];
                if speed > limit || speed.is_nan() {
                    return Err(Beyond::Speed(joint, speed, limit));
                }
            }
        }
        Ok(())
    }
}
