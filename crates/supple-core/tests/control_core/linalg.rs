//! The small linear algebra compared with nalgebra and with its definitions.

use crate::common::numeric::{error_at_scale, mixed_error, size};
use crate::common::random::pose;
use crate::support::settings::config;
use proptest::collection::vec;
use proptest::prelude::*;
use supple_core::linalg::{
    Cholesky, min_singular_value, singular_values_exceed, symmetric_eigenvalues,
};
use supple_core::math::{Matrix3, Vector3, all_finite, smooth_step};
use supple_core::{Matrix, Vector};

fn matrix<const R: usize, const C: usize>() -> impl Strategy<Value = Matrix<R, C>> {
    vec(-2.0..2.0, R * C).prop_map(|v| Matrix::from_column_slice(&v))
}

/// Zero, or any magnitude between rounding and one.
fn gap() -> impl Strategy<Value = f64> {
    prop_oneof![Just(0.0), (-14.0..0.5).prop_map(|e| 10.0_f64.powf(e))]
}

/// A symmetric matrix in rotated axes, and its eigenvalues in ascending order, often close
/// together.
fn symmetric() -> impl Strategy<Value = (Matrix3<f64>, [f64; 3])> {
    let min = prop_oneof![Just(0.0), -2.0..2.0];
    (min, gap(), gap(), pose()).prop_map(|(min, first, second, frame)| {
        let values = [min, min + first, min + first + second];
        let r = frame.rotation;
        let a = r * Matrix3::from_diagonal(&Vector3::from(values)) * r.transpose();
        ((a + a.transpose()) * 0.5, values)
    })
}

/// `A = B B^T + I / 100` is positive definite, with a condition below 1e4 or so.
fn cholesky_solves<const N: usize>(b: &Matrix<N, N>, x: &Vector<N>) -> Result<(), TestCaseError> {
    let identity = Matrix::<N, N>::identity();
    let a = b * b.transpose() + identity * 0.01;
    let factor = Cholesky::new(&a).expect("positive definite");
    prop_assert!(mixed_error(&factor.solve(&(a * x)), x) < 1e-10);
    prop_assert!(mixed_error(&factor.solve(&a), &identity) < 1e-10);
    // Only the lower triangle is read.
    let mut lower_only = a;
    lower_only.fill_upper_triangle(f64::NAN, 1);
    let same = Cholesky::new(&lower_only).expect("positive definite");
    prop_assert_eq!(same.solve(x), factor.solve(x));
    Ok(())
}

proptest! {
    #![proptest_config(config(1000, 20_260_104))]

    #[test]
    fn cholesky_3(b in matrix::<3, 3>(), x in matrix::<3, 1>()) {
        cholesky_solves(&b, &x)?;
    }

    #[test]
    fn cholesky_4(b in matrix::<4, 4>(), x in matrix::<4, 1>()) {
        cholesky_solves(&b, &x)?;
    }

    #[test]
    fn cholesky_7(b in matrix::<7, 7>(), x in matrix::<7, 1>()) {
        cholesky_solves(&b, &x)?;
    }

    /// Matrices that are not positive definite by nalgebra's eigenvalues are rejected.
    #[test]
    fn cholesky_rejects_matrices_that_are_not_positive_definite(b in matrix::<4, 4>()) {
        let a = b + b.transpose() + Matrix::<4, 4>::identity() * 3.0;
        let min = a.symmetric_eigenvalues().min();
        prop_assume!(min.abs() > 1e-9);
        prop_assert_eq!(Cholesky::new(&a).is_some(), min > 0.0);
    }

    /// Accurate to rounding for distinct eigenvalues, to its square root if two coincide.
    #[test]
    fn eigenvalues_match_the_constructed_ones((a, expected) in symmetric()) {
        let found = symmetric_eigenvalues(&a);
        let [min, middle, max] = expected;
        let spread = max - min;
        let gap = (middle - min).min(max - middle).max(f64::MIN_POSITIVE);
        let rounding = 1e-15 * size(&a);
        let allowed = rounding + (rounding * spread / gap).min(3.0 * (rounding * spread).sqrt());
        for (f, e) in found.iter().zip(expected) {
            let error = (f - e).abs();
            prop_assert!(error <= allowed, "{found:?}, not {expected:?}: {error:e} > {allowed:e}");
        }
        prop_assert!(found[0] <= found[1] + allowed && found[1] <= found[2] + allowed);
    }

    #[test]
    fn eigenvalues_match_trace_and_determinant(b in matrix::<3, 3>()) {
        let a = b + b.transpose();
        let [x, y, z] = symmetric_eigenvalues(&a);
        prop_assert!((x + y + z - a.trace()).abs() < 1e-13);
        prop_assert!((x * y * z - a.determinant()).abs() < 1e-11);
        let mut expected = a.symmetric_eigenvalues();
        expected.as_mut_slice().sort_by(f64::total_cmp);
        prop_assert!(error_at_scale(&Vector3::new(x, y, z), &expected, size(&a)) < 1e-11);
    }

    #[test]
    fn min_singular_value_matches_nalgebra(
        three in matrix::<3, 3>(),
        four in matrix::<3, 4>(),
        seven in matrix::<3, 7>(),
    ) {
        prop_assert!((min_singular_value(&three) - three.singular_values().min()).abs() < 1e-7);
        prop_assert!((min_singular_value(&four) - four.singular_values().min()).abs() < 1e-7);
        prop_assert!((min_singular_value(&seven) - seven.singular_values().min()).abs() < 1e-7);
    }

    #[test]
    fn singular_values_exceed_agrees_with_the_minimum(
        three in matrix::<3, 3>(),
        seven in matrix::<3, 7>(),
        bound in 0.01..2.0_f64,
    ) {
        let min = three.singular_values().min();
        prop_assume!((min - bound).abs() > 1e-9);
        prop_assert_eq!(singular_values_exceed(&three.data.0, bound), min > bound);
        let min = seven.singular_values().min();
        prop_assume!((min - bound).abs() > 1e-9);
        prop_assert_eq!(singular_values_exceed(&seven.data.0, bound), min > bound);
    }

    /// Columns in a plane, then along a line.
    #[test]
    fn min_singular_value_vanishes_with_the_rank(b in matrix::<3, 4>(), a in matrix::<2, 4>()) {
        let plane = Matrix::<3, 4>::from_rows(&[
            a.row(0).into_owned(),
            a.row(1).into_owned(),
            a.row(0) - a.row(1) * 2.0,
        ]);
        prop_assert!(min_singular_value(&plane) <= 3e-4 * plane.norm());
        let line = b.column(0) * a.row(0);
        prop_assert!(min_singular_value(&line) <= 3e-4 * line.norm());
    }

    #[test]
    fn smooth_step_gives_its_own_derivatives(x in 0.01..0.99_f64) {
        let h = 1e-4;
        let (value, slope, curvature) = smooth_step(x);
        let (ahead, behind) = (smooth_step(x + h), smooth_step(x - h));
        prop_assert!(((ahead.0 - behind.0) / (2.0 * h) - slope).abs() < 1e-6);
        prop_assert!(((ahead.1 - behind.1) / (2.0 * h) - curvature).abs() < 1e-5);
        prop_assert!((value + smooth_step(1.0 - x).0 - 1.0).abs() < 1e-14);
    }
}

#[test]
fn cholesky_rejects_semidefinite_and_nan() {
    assert!(Cholesky::new(&Matrix3::zeros()).is_none());
    assert!(Cholesky::new(&Matrix3::repeat(1.0)).is_none());
    assert!(Cholesky::new(&-Matrix3::<f64>::identity()).is_none());
    for bad in [f64::NAN, f64::INFINITY] {
        for at in [(0, 0), (2, 0), (2, 1), (2, 2)] {
            let mut a = Matrix3::identity() * 2.0;
            a[at] = bad;
            assert!(Cholesky::new(&a).is_none(), "{bad} at {at:?}");
        }
    }
}

#[test]
fn eigenvalues_of_a_multiple_of_the_identity_are_equal() {
    assert_eq!(
        symmetric_eigenvalues(&(Matrix3::identity() * 0.3)),
        [0.3; 3]
    );
    assert_eq!(symmetric_eigenvalues(&Matrix3::zeros()), [0.0; 3]);
    assert_eq!(min_singular_value(&Matrix::<3, 7>::zeros()), 0.0);
}

#[test]
fn smooth_step_rests_at_both_ends() {
    for x in [-1.0, 0.0] {
        assert_eq!(smooth_step(x), (0.0, 0.0, 0.0));
    }
    for x in [1.0, 2.0] {
        assert_eq!(smooth_step(x), (1.0, 0.0, 0.0));
    }
    let (value, slope, curvature) = smooth_step(1e-6);
    assert!(value < 1e-16 && slope < 1e-10 && curvature < 1e-4);
}

#[test]
fn all_finite_checks_each_entry() {
    let mut m = Matrix::<2, 3>::zeros();
    assert!(all_finite(&m));
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        m[(1, 2)] = bad;
        assert!(!all_finite(&m));
    }
}
