//! Coefficients of a Fourier series ([`Fourier`]) as plain lists with a run-time number of joints, for files and other
//! languages.

use crate::error::{IdentError, shape_error};
use crate::excitation_design::MAX_DURATION_S;
use serde::{Deserialize, Serialize};
use supple_core::Vector;
use supple_core::trajectory::{Fourier, HARMONICS};

/// The fields of [`Fourier`]: one list for each harmonic, one number for each joint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FourierCoefficients {
    /// Constant term of each joint \[rad\].
    pub centre_rad: Vec<f64>,
    /// Amplitudes of the sines, (harmonics, joints) \[rad\].
    pub sine_rad: Vec<Vec<f64>>,
    /// Amplitudes of the cosines, (harmonics, joints) \[rad\].
    pub cosine_rad: Vec<Vec<f64>>,
    /// Base frequency \[rad/s\].
    pub angular_frequency_rad_per_s: f64,
    /// Time from rest to rest \[s\].
    pub duration_s: f64,
    /// Time over which the speed ramps up and down \[s\].
    pub ramp_s: f64,
}

impl<const N: usize> From<&Fourier<N>> for FourierCoefficients {
    fn from(series: &Fourier<N>) -> FourierCoefficients {
        let lists = |all: &[Vector<N>; HARMONICS]| {
            let list = |column: &Vector<N>| column.as_slice().to_vec();
            all.iter().map(list).collect()
        };
        FourierCoefficients {
            centre_rad: series.centre_rad.as_slice().to_vec(),
            sine_rad: lists(&series.sine_rad),
            cosine_rad: lists(&series.cosine_rad),
            angular_frequency_rad_per_s: series.angular_frequency_rad_per_s,
            duration_s: series.duration_s,
            ramp_s: series.ramp_s,
        }
    }
}

impl FourierCoefficients {
    /// Converts the coefficients to the series of an arm with `N` joints.
    ///
    /// # Errors
    /// [`IdentError::Shape`] for lists of other lengths, or a duration out of range.
    pub fn fourier<const N: usize>(&self) -> Result<Fourier<N>, IdentError> {
        let column = |name: &str, values: &[f64]| {
            if values.len() == N {
                return Ok(Vector::<N>::from_column_slice(values));
            }
            Err(shape_error(
                name,
                format!("{N} joints, as the arm has"),
                format!("{}", values.len()),
            ))
        };
        let columns = |name: &str, all: &[Vec<f64>]| {
            if all.len() != HARMONICS {
                let expected = format!("{HARMONICS} harmonics");
                return Err(shape_error(name, expected, format!("{}", all.len())));
            }
            let mut found = [Vector::<N>::zeros(); HARMONICS];
            for (place, values) in found.iter_mut().zip(all) {
                *place = column(name, values)?;
            }
            Ok(found)
        };
        for (name, value) in [("duration_s", self.duration_s), ("ramp_s", self.ramp_s)] {
            if !(0.0..=MAX_DURATION_S).contains(&value) {
                let expected = format!("0 to {MAX_DURATION_S} s");
                return Err(shape_error(name, expected, format!("{value} s")));
            }
        }
        Ok(Fourier {
            centre_rad: column("centre_rad", &self.centre_rad)?,
            sine_rad: columns("sine_rad", &self.sine_rad)?,
            cosine_rad: columns("cosine_rad", &self.cosine_rad)?,
            angular_frequency_rad_per_s: self.angular_frequency_rad_per_s,
            duration_s: self.duration_s,
            ramp_s: self.ramp_s,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::FourierCoefficients;
    use supple_core::Vector;
    use supple_core::trajectory::Fourier;

    #[test]
    fn lists_convert_back_to_the_series_and_invalid_ones_are_rejected() {
        let mut series = Fourier::<3>::at_rest(Vector::repeat(0.2), 0.5);
        series.sine_rad[1][2] = 0.7;
        series.cosine_rad[4][0] = -0.1;
        let lists = FourierCoefficients::from(&series);
        assert_eq!(lists.fourier::<3>().unwrap(), series);
        let error = lists.fourier::<4>().unwrap_err().to_string();
        assert!(
            error.contains("centre_rad") && error.contains("4 joints"),
            "{error}"
        );
        let mut short = lists;
        short.sine_rad.pop();
        let error = short.fourier::<3>().unwrap_err().to_string();
        assert!(
            error.contains("sine_rad") && error.contains("5 harmonics"),
            "{error}"
        );
    }
}
