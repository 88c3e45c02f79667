//! Direction of dry friction that the measured motion of the joints implies: the bristles' state of Dahl's model.

use crate::math::Vector;
use crate::model::friction::Friction;

/// Direction of the dry friction of each joint whose presliding travel is known.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeasuredDirection<const N: usize> {
    /// The direction, -1 to 1.
    direction: Vector<N>,
    /// Angles that follow the measured ones with a play of one resolution step, so that noise at rest is no motion \[rad\].
    angle_rad: Vector<N>,
}

impl<const N: usize> MeasuredDirection<N> {
    /// Returns the direction of joints of unknown motion.
    pub fn unknown() -> Self {
        MeasuredDirection {
            direction: Vector::zeros(),
            angle_rad: Vector::zeros(),
        }
    }

    /// Returns the direction of the dry friction of a joint whose presliding travel is known, -1 to 1.
    pub fn of_joint(&self, joint: usize) -> f64 {
        self.direction[joint]
    }

    /// Updates the direction of each joint with its angle; `play_rad` is its resolution step.
    pub fn update(
        &mut self,
        friction: &[Friction; N],
        angle_rad: &Vector<N>,
        play_rad: &Vector<N>,
    ) {
        for (i, friction) in friction.iter().enumerate() {
            let away_rad = angle_rad[i] - self.angle_rad[i];
            let travel_rad = away_rad - away_rad.clamp(-play_rad[i], play_rad[i]);
            if friction.presliding_rad > 0.0 && travel_rad != 0.0 {
                self.angle_rad[i] += travel_rad;
                self.direction[i] = friction.direction_after(self.direction[i], travel_rad);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::MeasuredDirection;
    use crate::math::{Vector, exp};
    use crate::model::friction::Friction;

    const STEP_RAD: f64 = 5e-5;

    fn sliding() -> ([Friction; 1], MeasuredDirection<1>) {
        let friction = Friction {
            presliding_rad: 5e-4,
            ..Friction::coulomb(0.0, 1.0)
        };
        let mut measured = MeasuredDirection::unknown();
        for k in 1..=100 {
            move_to(&mut measured, &[friction], STEP_RAD * f64::from(k));
        }
        assert!(measured.of_joint(0) > 0.9999);
        ([friction], measured)
    }

    fn move_to(measured: &mut MeasuredDirection<1>, friction: &[Friction; 1], angle_rad: f64) {
        let play_rad = Vector::<1>::repeat(STEP_RAD);
        measured.update(friction, &Vector::<1>::repeat(angle_rad), &play_rad);
    }

    #[test]
    fn noise_of_one_step_is_no_motion() {
        let (friction, mut measured) = sliding();
        let before = measured.of_joint(0);
        for k in 0..1000 {
            move_to(&mut measured, &friction, STEP_RAD * f64::from(99 + k % 2));
        }
        assert_eq!(measured.of_joint(0), before);
    }

    #[test]
    fn a_rebound_reverses_the_direction_after_its_presliding() {
        let (friction, mut measured) = sliding();
        let before = measured.of_joint(0);
        for k in 1..=40 {
            move_to(&mut measured, &friction, STEP_RAD * f64::from(100 - k));
        }
        // 40 steps back, less the play of two: from one step before the angle to one after it.
        let expected = (1.0 + before) * exp(-38.0 * STEP_RAD / 5e-4) - 1.0;
        let direction = measured.of_joint(0);
        assert!(
            (direction - expected).abs() < 1e-9,
            "{direction}, {expected}"
        );
    }
}
