//! Conversion of the contents of requests to numbers and back: each struct is listed once, for both directions.

use super::values::{CodeReader, RequestCode, RequestCodeError};
use crate::config::{Gains, JointGains, RotationalGains};
use crate::controller::{Breakaway, GainAxes, GainMatrices, GainPart, LearningSwitch, SetPoint};
use crate::math::{Matrix3, Vector};
use crate::model::learned::{JointMap, LearnedParameters};
use crate::trajectory::{Arc, Fourier, Line, Probe, Quadrant, Rotation, Sinusoid};

/// A value that is encoded as numbers and decoded bit for bit.
pub(super) trait Coded: Sized {
    /// Appends the numbers of the value.
    fn put(&self, to: &mut RequestCode);

    /// Decodes the value from the next numbers.
    fn take(from: &mut CodeReader<'_>) -> Result<Self, RequestCodeError>;
}

/// Structs whose fields are sent in this order; the number after the semicolon is zero if a log lacks it.
macro_rules! coded {
    ($($name:ident $(<const $size:ident>)? { $($field:ident),+ $(; $last:ident)? })+) => {$(
        impl $(<const $size: usize>)? Coded for $name $(<$size>)? {
            fn put(&self, to: &mut RequestCode) {
                $(self.$field.put(to);)+
                $(self.$last.put(to);)?
            }

            fn take(from: &mut CodeReader<'_>) -> Result<Self, RequestCodeError> {
                Ok($name {
                    $($field: Coded::take(from)?,)+
                    $($last: from.number_if_present(),)?
                })
            }
        }
    )+};
}

coded! {
    Gains { stiffness_n_per_m, damping_n_s_per_m }
    JointGains<const N> { stiffness_nm_per_rad, damping_nm_s_per_rad }
    RotationalGains { stiffness_nm_per_rad, damping_nm_s_per_rad }
    GainMatrices { stiffness, damping }
    Breakaway { joint, rate_nm_per_s, stop_rad, limit_nm }
    SetPoint { position_m, velocity_m_per_s, acceleration_m_per_s2, at_cycle }
    Rotation { axis, angle_rad, duration_s }
    JointMap { torque_nm, dry_nm }
    LearnedParameters<const N> {
        viscous_nm_s_per_rad, coulomb_nm, offset_nm, torque_scale, payload_kg, payload_moment_kg_m, tilt_rad
    }
    Fourier<const N> {
        centre_rad, sine_rad, cosine_rad, angular_frequency_rad_per_s, duration_s, ramp_s
    }
    Line { from_m, to_m, duration_s }
    Sinusoid { centre_m, amplitude_m, angular_frequency_rad_per_s, ramp_s }
    Arc { radius_m, height_m, centre_rad, amplitude_rad, angular_frequency_rad_per_s, ramp_s }
    Probe {
        radius_m, strokes, radial_step_m, top_m, stroke_m, azimuth_rad, azimuth_step_rad, speed_m_per_s, ramp_s; dwell_s
    }
}

impl Coded for Quadrant {
    fn put(&self, to: &mut RequestCode) {
        self.centre_m().put(to);
        self.first_m().put(to);
        self.second_m().put(to);
        to.numbers(&[self.speed_m_per_s(), self.ramp_s(), self.corner_ramp_s()]);
    }

    fn take(from: &mut CodeReader<'_>) -> Result<Self, RequestCodeError> {
        let [centre_m, first_m, second_m] = Coded::take(from)?;
        let (speed_m_per_s, ramp_s) = (from.number(), from.number());
        let quadrant = Quadrant::new(centre_m, first_m, second_m, speed_m_per_s, ramp_s);
        Ok(quadrant.with_corner_ramp(from.number_if_present()))
    }
}

impl Coded for f64 {
    fn put(&self, to: &mut RequestCode) {
        to.numbers(&[*self]);
    }

    fn take(from: &mut CodeReader<'_>) -> Result<Self, RequestCodeError> {
        Ok(from.number())
    }
}

impl<const R: usize> Coded for Vector<R> {
    fn put(&self, to: &mut RequestCode) {
        to.numbers(self.as_slice());
    }

    fn take(from: &mut CodeReader<'_>) -> Result<Self, RequestCodeError> {
        Ok(Vector::from_fn(|_, _| from.number()))
    }
}

impl<T: Coded + Copy, const K: usize> Coded for [T; K] {
    fn put(&self, to: &mut RequestCode) {
        for item in self {
            item.put(to);
        }
    }

    fn take(from: &mut CodeReader<'_>) -> Result<Self, RequestCodeError> {
        const { assert!(K > 0, "an array that carries nothing") };
        let mut all = [T::take(from)?; K];
        for item in &mut all[1..] {
            *item = T::take(from)?;
        }
        Ok(all)
    }
}

impl Coded for u32 {
    fn put(&self, to: &mut RequestCode) {
        to.numbers(&[f64::from(*self)]);
    }

    fn take(from: &mut CodeReader<'_>) -> Result<Self, RequestCodeError> {
        let number = from.number();
        let count = number as u32;
        if f64::from(count) == number {
            Ok(count)
        } else {
            Err(RequestCodeError::Whole(number))
        }
    }
}

/// Index of a joint.
impl Coded for usize {
    fn put(&self, to: &mut RequestCode) {
        to.numbers(&[*self as f64]);
    }

    fn take(from: &mut CodeReader<'_>) -> Result<Self, RequestCodeError> {
        Ok(u32::take(from)? as usize)
    }
}

/// A cycle number; a whole number below 2^53.
impl Coded for u64 {
    fn put(&self, to: &mut RequestCode) {
        to.numbers(&[*self as f64]);
    }

    fn take(from: &mut CodeReader<'_>) -> Result<Self, RequestCodeError> {
        let number = from.number();
        let cycle = number as u64;
        if cycle < 1 << 53 && cycle as f64 == number {
            Ok(cycle)
        } else {
            Err(RequestCodeError::Whole(number))
        }
    }
}

/// Enums without fields: each variant is sent as its place in this list.
macro_rules! coded_choices {
    ($($name:ident { $($variant:ident),+ })+) => {$(
        impl Coded for $name {
            fn put(&self, to: &mut RequestCode) {
                const ALL: &[$name] = &[$($name::$variant),+];
                let place = ALL.iter().position(|choice| choice == self);
                place.unwrap_or_default().put(to);
            }

            fn take(from: &mut CodeReader<'_>) -> Result<Self, RequestCodeError> {
                const ALL: &[$name] = &[$($name::$variant),+];
                let number = u32::take(from)?;
                let found = ALL.get(number as usize).copied();
                found.ok_or(RequestCodeError::Whole(f64::from(number)))
            }
        }
    )+};
}

coded_choices! {
    LearningSwitch { Off, On, Reset }
    GainPart { Linear, Rotational }
    GainAxes { Base, Tip }
}

/// A symmetric matrix: xx, yy, zz, yz, zx, xy.
impl Coded for Matrix3<f64> {
    fn put(&self, to: &mut RequestCode) {
        to.numbers(&[
            self[(0, 0)],
            self[(1, 1)],
            self[(2, 2)],
            self[(1, 2)],
            self[(2, 0)],
            self[(0, 1)],
        ]);
    }

    fn take(from: &mut CodeReader<'_>) -> Result<Self, RequestCodeError> {
        Coded::take(from).map(GainMatrices::symmetric)
    }
}
