//! Travel of a joint in the resolution of its encoder.

/// Differences of measured angles are multiples of the encoder's step up to rounding.
const ROUNDING: f64 = 1.0 + 1e-6;

/// Follows an angle, and takes a change against the last direction of motion for motion only once it is greater than one step of
/// the encoder. From then on the whole change counts: a reversal is noticed late, but none of its travel is lost.
/// The direction in which the controller holds friction in contact follows the angle with a play of one step instead.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Travel {
    /// Angle up to which the travel has been counted, and the last measured angle \[rad\].
    counted_rad: f64,
    measured_rad: f64,
    /// Step of the encoder, the smallest change so far \[rad\].
    step_rad: f64,
    /// Sign of the last travel, 0 before any.
    sign: f64,
}

impl Travel {
    /// Creates the travel of a joint that has not moved.
    pub(crate) fn new() -> Travel {
        Travel {
            counted_rad: 0.0,
            measured_rad: 0.0,
            step_rad: f64::MAX,
            sign: 0.0,
        }
    }

    /// Begins at this angle \[rad\]; keeps the step of the encoder.
    pub(crate) fn begin_at(&mut self, angle_rad: f64) {
        self.counted_rad = angle_rad;
        self.measured_rad = angle_rad;
        self.sign = 0.0;
    }

    /// Returns the travel since the last call that had any \[rad\], 0 if it may be noise. `angle_rad` is the filtered angle. Until the
    /// encoder has shown its step, `unknown_step_rad` takes its place.
    pub(crate) fn to(&mut self, measured_rad: f64, angle_rad: f64, unknown_step_rad: f64) -> f64 {
        let change_rad = (measured_rad - self.measured_rad).abs();
        self.measured_rad = measured_rad;
        if change_rad > 0.0 {
            self.step_rad = self.step_rad.min(change_rad);
        }
        let travel_rad = angle_rad - self.counted_rad;
        let goes_on = travel_rad * self.sign > 0.0;
        let noise_rad = if self.step_rad < f64::MAX {
            self.step_rad * ROUNDING
        } else {
            unknown_step_rad
        };
        if !goes_on && travel_rad.abs() <= noise_rad {
            return 0.0;
        }
        self.counted_rad = angle_rad;
        self.sign = travel_rad.signum();
        travel_rad
    }
}

#[cfg(test)]
mod tests {
    use super::Travel;

    const STEP_RAD: f64 = 4e-4;
    /// Far from zero, so that angles are rounded.
    const START_RAD: f64 = 2.1;

    /// Moves to these angles, in steps of the encoder; returns the sum of the travel in each direction.
    fn travelled(travel: &mut Travel, steps: impl IntoIterator<Item = i32>) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for step in steps {
            let angle_rad = START_RAD + f64::from(step) * STEP_RAD;
            let travel_rad = travel.to(angle_rad, angle_rad, 1.0);
            sums[usize::from(travel_rad < 0.0)] += travel_rad;
        }
        sums.map(|sum| sum / STEP_RAD)
    }

    fn moved() -> Travel {
        let mut travel = Travel::new();
        travel.begin_at(START_RAD);
        let sums = travelled(&mut travel, 1..=100);
        assert!((sums[0] - 100.0).abs() < 1e-6, "{sums:?}");
        travel
    }

    #[test]
    fn noise_of_one_step_is_no_travel() {
        let mut travel = moved();
        assert_eq!(
            travelled(&mut travel, (0..1000).map(|k| 99 + k % 2)),
            [0.0; 2]
        );
    }

    #[test]
    fn no_travel_of_a_reversal_is_lost() {
        let mut travel = moved();
        let sums = travelled(&mut travel, (60..100).rev());
        assert!((sums[1] + 40.0).abs() < 1e-6 && sums[0] == 0.0, "{sums:?}");
    }

    #[test]
    fn before_the_step_is_known_a_given_one_counts() {
        let mut travel = Travel::new();
        travel.begin_at(START_RAD);
        assert_eq!(
            travel.to(START_RAD, START_RAD + 0.5 * STEP_RAD, STEP_RAD),
            0.0
        );
        let travel_rad = travel.to(START_RAD, START_RAD + 1.5 * STEP_RAD, STEP_RAD);
        assert!((travel_rad - 1.5 * STEP_RAD).abs() < 1e-12, "{travel_rad}");
    }
}
