//! Travel of a joint in the resolution of its encoder.

/// Follows an angle, and takes a change against the last direction of motion for motion only once it is greater than one step of
/// the encoder. From then on the whole change counts: a reversal is noticed late, but none of its travel is lost.
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

    /// Returns the sign of the last travel, 0 before any.
    pub(crate) fn sign(&self) -> f64 {
        self.sign
    }

    /// Returns the travel since the last call that had any \[rad\], 0 if it may be noise. `angle_rad` is the filtered angle; a change
    /// against the last direction of motion that is greater than `at_most_rad` is no noise, however coarse the encoder is.
    pub(crate) fn to(&mut self, measured_rad: f64, angle_rad: f64, at_most_rad: f64) -> f64 {
        let change_rad = (measured_rad - self.measured_rad).abs();
        self.measured_rad = measured_rad;
        if change_rad > 0.0 {
            self.step_rad = self.step_rad.min(change_rad);
        }
        let travel_rad = angle_rad - self.counted_rad;
        let goes_on = travel_rad * self.sign > 0.0;
        if !goes_on && travel_rad.abs() <= self.step_rad.min(at_most_rad) {
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

    /// Moves to these angles, in steps of the encoder; returns the sum of the travel in each direction.
    fn travelled(travel: &mut Travel, steps: impl IntoIterator<Item = i32>) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for step in steps {
            let angle_rad = f64::from(step) * STEP_RAD;
            let travel_rad = travel.to(angle_rad, angle_rad, 1.0);
            sums[usize::from(travel_rad < 0.0)] += travel_rad;
        }
        sums.map(|sum| sum / STEP_RAD)
    }

    fn moved() -> Travel {
        let mut travel = Travel::new();
        travel.begin_at(0.0);
        let sums = travelled(&mut travel, 1..=100);
        assert!((sums[0] - 100.0).abs() < 1e-9, "{sums:?}");
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
        assert!((sums[1] + 40.0).abs() < 1e-9 && sums[0] == 0.0, "{sums:?}");
    }

    #[test]
    fn an_encoder_coarser_than_the_presliding_hides_no_reversal() {
        let mut travel = moved();
        let angle_rad = 99.5 * STEP_RAD;
        assert_eq!(travel.to(99.0 * STEP_RAD, angle_rad, STEP_RAD), 0.0);
        let back_rad = travel.to(99.0 * STEP_RAD, angle_rad, 0.1 * STEP_RAD);
        assert!((back_rad + 0.5 * STEP_RAD).abs() < 1e-12, "{back_rad}");
    }
}
