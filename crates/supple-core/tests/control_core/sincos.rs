//! Sines and cosines of all joints compared with `libm`, and with their series in double-double
//! arithmetic.

use crate::support::settings::config;
use proptest::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI};
use supple_core::sincos::{MAX_ANGLE_RAD, sin_cos_all};

fn sin_cos(angle: f64) -> (f64, f64) {
    let ([sine], [cosine]) = sin_cos_all(&[angle]);
    (sine, cosine)
}

/// Double-double number: a sum of two numbers that do not overlap.
#[derive(Clone, Copy)]
struct Double(f64, f64);

impl Double {
    fn plus(self, other: Double) -> Double {
        let sum = self.0 + other.0;
        let part = sum - self.0;
        let error = (self.0 - (sum - part)) + (other.0 - part);
        let low = error + self.1 + other.1;
        Double(sum + low, low - ((sum + low) - sum))
    }

    fn times(self, other: Double) -> Double {
        let product = self.0 * other.0;
        let error = self.0.mul_add(other.0, -product);
        let low = error + self.0 * other.1 + self.1 * other.0;
        Double(product + low, low - ((product + low) - product))
    }

    fn over(self, divisor: f64) -> Double {
        let quotient = self.0 / divisor;
        let rest = (-quotient).mul_add(divisor, self.0) + self.1;
        Double(quotient, 0.0).plus(Double(rest / divisor, 0.0))
    }
}

/// Power series about zero, for `|x| <= 10`: accurate to about 1e-28 there.
fn series(x: f64) -> (Double, Double) {
    let x = Double(x, 0.0);
    let (mut sine, mut cosine) = (Double(0.0, 0.0), Double(0.0, 0.0));
    let mut term = Double(1.0, 0.0);
    for n in 0..80_u32 {
        let signed = if n % 4 < 2 {
            term
        } else {
            Double(-term.0, -term.1)
        };
        if n % 2 == 0 {
            cosine = cosine.plus(signed);
        } else {
            sine = sine.plus(signed);
        }
        term = term.times(x).over(f64::from(n + 1));
    }
    (sine, cosine)
}

/// Error in units in the last place of the reference.
fn ulps(found: f64, expected: Double) -> f64 {
    let exact = expected.0 + expected.1;
    let unit = f64::from_bits(exact.abs().to_bits() + 1) - exact.abs();
    (((found - expected.0) - expected.1) / unit).abs()
}

proptest! {
    #![proptest_config(config(20_000, 20_261_121))]

    #[test]
    fn within_one_unit_on_the_range_of_joints(x in -10.0..10.0_f64) {
        let (sine, cosine) = sin_cos(x);
        let (expected_sine, expected_cosine) = series(x);
        prop_assert!(ulps(sine, expected_sine) < 1.0, "sin({x:e})");
        prop_assert!(ulps(cosine, expected_cosine) < 1.0, "cos({x:e})");
    }

    #[test]
    fn within_one_unit_beside_the_multiples_of_a_quarter_turn(n in -6..7_i32, e in -50..0_i32, back in any::<bool>()) {
        let off = f64::from(e).exp2() * if back { -1.0 } else { 1.0 };
        let x = f64::from(n) * FRAC_PI_2 + off;
        let (sine, cosine) = sin_cos(x);
        let (expected_sine, expected_cosine) = series(x);
        // The series itself is accurate to 1e-28.
        prop_assert!(ulps(sine, expected_sine) < 1.0 || expected_sine.0.abs() < 1e-11, "sin({x:e})");
        prop_assert!(ulps(cosine, expected_cosine) < 1.0 || expected_cosine.0.abs() < 1e-11, "cos({x:e})");
    }

    #[test]
    fn within_two_units_of_libm_beyond_the_range_of_joints(x in -2.0 * MAX_ANGLE_RAD..2.0 * MAX_ANGLE_RAD) {
        let (sine, cosine) = sin_cos(x);
        let (s, c) = libm::sincos(x);
        prop_assert!(ulps(sine, Double(s, 0.0)) <= 2.0, "sin({x:e})");
        prop_assert!(ulps(cosine, Double(c, 0.0)) <= 2.0, "cos({x:e})");
    }

    #[test]
    fn each_result_depends_on_its_own_angle_alone(x in -4.0..4.0_f64, others in [-1e9..1e9_f64, -4.0..4.0, -4.0..4.0]) {
        let [a, b, c] = others;
        let (sines, cosines) = sin_cos_all(&[a, b, x, c]);
        prop_assert_eq!((sines[2], cosines[2]), sin_cos(x));
    }
}

#[test]
fn large_and_nonfinite_angles_use_libm() {
    for x in [1e6_f64.next_up(), -1e7, 1e22, f64::MAX] {
        assert_eq!(sin_cos(x), libm::sincos(x));
    }
    for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let (sine, cosine) = sin_cos(x);
        assert!(sine.is_nan() && cosine.is_nan());
    }
}

#[test]
fn quarter_turns_and_small_angles() {
    assert_eq!(sin_cos(0.0), (0.0, 1.0));
    assert_eq!(sin_cos(1e-300), (1e-300, 1.0));
    assert_eq!(
        sin_cos(f64::MIN_POSITIVE / 8.0),
        (f64::MIN_POSITIVE / 8.0, 1.0)
    );
    let (sine, cosine) = sin_cos(FRAC_PI_2);
    assert_eq!(sine, 1.0);
    // Difference of pi/2 and its nearest double.
    assert!((cosine - 6.123_233_995_736_766e-17).abs() < 1e-32);
    let (sine, cosine) = sin_cos(-PI);
    assert!((sine + 1.224_646_799_147_353_2e-16).abs() < 1e-31);
    assert_eq!(cosine, -1.0);
}
