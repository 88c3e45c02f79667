//! Position, velocity and acceleration of a sampled motion, smoothed by a Gaussian kernel of fourth order.
//!
//! ```text
//! k(u) = g(u) (3 - u^2) / 2,   g(u) = exp(-u^2 / 2) / sqrt(2 pi),   u = (t - t') / sigma
//! ```
//!
//! The kernel keeps a cubic as it is. It removes the oscillation of an arm that sticks and slips under the hand, 8 to 10 Hz, while
//! the hand's own motion, below some 1 Hz, remains. Velocity and acceleration are the derivatives of the smoothed position.

use super::RecordedMotion;
use supple_core::Reference;
use supple_core::math::Vector3;

/// Number of samples in one `sigma` of the kernel.
const SAMPLES: i32 = 10;
/// Half-width of the kernel in `sigma`, beyond which it is negligible.
const WIDTH: i32 = 6;

/// Returns the motion at a time \[s\], smoothed with the kernel's `sigma` \[s\]; the tip rests before the first and after the last
/// sample.
pub fn reference_at(recorded: &RecordedMotion, time_s: f64, sigma_s: f64) -> Reference {
    let (Some(first_s), Some(last_s), Some(origin)) = (
        recorded.time_s.first(),
        recorded.time_s.last(),
        recorded.tip_m.first(),
    ) else {
        return Reference::at_rest(Vector3::zeros());
    };
    let mut weight = 0.0;
    let [mut position, mut velocity, mut acceleration] = [Vector3::zeros(); 3];
    for k in -SAMPLES * WIDTH..=SAMPLES * WIDTH {
        let u = f64::from(k) / f64::from(SAMPLES);
        let at_s = (time_s - sigma_s * u).clamp(*first_s, *last_s);
        let tip_m = recorded.tip_at(at_s) - origin;
        // The kernel and its derivatives in `u`, without the common factor.
        let (g, squared) = ((-0.5 * u * u).exp(), u * u);
        let kernel = g * (3.0 - squared);
        weight += kernel;
        position += tip_m * kernel;
        velocity += tip_m * (g * u * (squared - 5.0));
        acceleration += tip_m * (g * (-squared * squared + 8.0 * squared - 5.0));
    }
    Reference {
        position: origin + position / weight,
        velocity: velocity / (weight * sigma_s),
        acceleration: acceleration / (weight * sigma_s * sigma_s),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_reproduced_and_the_motion_rests_beyond_its_ends() {
        let mut recorded = RecordedMotion::default();
        for k in 0..=400 {
            let t = 0.005 * f64::from(k);
            recorded.push(t, Vector3::new(0.1 * t * t, 0.2 * t, 0.3), &[]);
        }
        let at = reference_at(&recorded, 1.0, 0.1);
        assert!(
            (at.position - Vector3::new(0.1, 0.2, 0.3)).norm() < 1e-6,
            "{at:?}"
        );
        assert!(
            (at.velocity - Vector3::new(0.2, 0.2, 0.0)).norm() < 1e-5,
            "{at:?}"
        );
        assert!(
            (at.acceleration - Vector3::new(0.2, 0.0, 0.0)).norm() < 1e-2,
            "{at:?}"
        );
        for (time_s, tip_m) in [(-0.6, recorded.tip_m[0]), (2.6, recorded.tip_m[400])] {
            let at = reference_at(&recorded, time_s, 0.1);
            assert!((at.position - tip_m).norm() < 1e-9 && at.velocity.norm() < 1e-9);
        }
    }

    /// Expected of the kernel: the factor (1 + x) exp(-x) with x = (2 pi f sigma)^2 / 2, 0.98 at 1 Hz and 2e-6 at 9 Hz.
    #[test]
    fn the_motion_of_a_hand_remains_and_an_oscillation_does_not() {
        for (frequency_hz, least, most) in [(1.0, 0.97, 0.99), (9.0, 0.0, 1e-3)] {
            let rate = core::f64::consts::TAU * frequency_hz;
            let mut recorded = RecordedMotion::default();
            for k in 0..=2000 {
                let t = 0.002 * f64::from(k);
                recorded.push(t, Vector3::new((rate * t).sin(), 0.0, 0.0), &[]);
            }
            // The velocity of the smoothed motion at a zero of the oscillation.
            let ratio = reference_at(&recorded, 2.0, 0.1).velocity.x / rate;
            assert!(
                (least..=most).contains(&ratio.abs()),
                "{frequency_hz} Hz: {ratio}"
            );
        }
    }
}
