//! Position, velocity and acceleration of a sampled motion, by fitting a parabola to the samples around each time.

use super::RecordedMotion;
use nalgebra::{Matrix3, Matrix3x1};
use supple_core::Reference;
use supple_core::math::Vector3;

/// Returns the motion at a time \[s\], from the samples within `half_s` before and after; the tip rests before the first and
/// after the last sample.
pub fn reference_at(recorded: &RecordedMotion, time_s: f64, half_s: f64) -> Reference {
    let (Some(first_s), Some(last_s)) = (recorded.time_s.first(), recorded.time_s.last()) else {
        return Reference::at_rest(Vector3::zeros());
    };
    // The motion of the file and the rest before and after it are sampled on an even grid.
    const SAMPLES: i32 = 40;
    let mut normal = Matrix3::<f64>::zeros();
    let mut right = [Matrix3x1::<f64>::zeros(); 3];
    let mut add = |at_s: f64, tip_m: &Vector3<f64>| {
        let x = (at_s - time_s) / half_s;
        let row = Matrix3x1::new(1.0, x, x * x);
        normal += row * row.transpose();
        for axis in 0..3 {
            right[axis] += row * tip_m[axis];
        }
    };
    for k in -SAMPLES..=SAMPLES {
        let at_s = time_s + half_s * f64::from(k) / f64::from(SAMPLES);
        add(at_s, &recorded.tip_at(at_s.clamp(*first_s, *last_s)));
    }
    // The matrix is regular, because the times of the grid differ.
    let inverse = normal.try_inverse().unwrap_or_else(Matrix3::zeros);
    let fits = right.map(|right| inverse * right);
    let part = |k: usize, factor: f64| Vector3::new(fits[0][k], fits[1][k], fits[2][k]) * factor;
    Reference {
        position: part(0, 1.0),
        velocity: part(1, 1.0 / half_s),
        acceleration: part(2, 2.0 / (half_s * half_s)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_reproduced_exactly_and_the_motion_rests_beyond_its_ends() {
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
            (at.velocity - Vector3::new(0.2, 0.2, 0.0)).norm() < 1e-6,
            "{at:?}"
        );
        assert!(
            (at.acceleration - Vector3::new(0.2, 0.0, 0.0)).norm() < 1e-2,
            "{at:?}"
        );
        for (time_s, tip_m) in [(-0.2, recorded.tip_m[0]), (2.2, recorded.tip_m[400])] {
            let at = reference_at(&recorded, time_s, 0.1);
            assert!((at.position - tip_m).norm() < 1e-9 && at.velocity.norm() < 1e-9);
        }
    }
}
