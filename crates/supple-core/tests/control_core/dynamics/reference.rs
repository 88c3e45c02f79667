//! Every function compared with Pinocchio's values on the reference arms, 40 states each, to 1e-10.

use crate::common::numeric::{error_at_scale, mixed_error, scalar, size};
use crate::common::reference::{Sample, openarm, wam3, wam4, wam7, yam};
use supple_core::dynamics::{
    Terms, aba, coriolis, coriolis_matrix, crba, gravity, jacobian, jacobian_dot_qd,
    kinetic_energy, momentum, parameters, potential_energy, regressor, regressor_times, rnea,
    terms, tip_pose,
};
use supple_core::{Arm, Pose};

const TOLERANCE: f64 = 1e-10;

/// Error of a quantity in one state.
type Error<const N: usize> = fn(&Arm<N>, &Sample<N>) -> f64;

fn hold<const N: usize>(arm: &Arm<N>, samples: &[Sample<N>], error: Error<N>) {
    assert_eq!(samples.len(), 40);
    for (k, sample) in samples.iter().enumerate() {
        let error = error(arm, sample);
        assert!(error <= TOLERANCE, "state {k} of {N} joints: {error:.1e}");
    }
}

macro_rules! on_the_reference_arms {
    ($($name:ident: $error:expr;)*) => {$(
        #[test]
        fn $name() {
            let (three, four, seven) = (wam3(), wam4(), wam7());
            hold(&three.arm, &three.samples, $error);
            hold(&four.arm, &four.samples, $error);
            hold(&seven.arm, &seven.samples, $error);
            let (openarm, yam) = (openarm(), yam());
            hold(&openarm.arm, &openarm.samples, $error);
            hold(&yam.arm, &yam.samples, $error);
        }
    )*};
}

on_the_reference_arms! {
    rnea_agrees: |arm, s| mixed_error(&rnea(arm, &s.q, &s.qd, &s.qdd), &s.rnea);
    crba_agrees: |arm, s| mixed_error(&crba(arm, &s.q), &s.mass_matrix);
    gravity_agrees: |arm, s| mixed_error(&gravity(arm, &s.q), &s.gravity);
    coriolis_agrees: |arm, s| {
        mixed_error(&coriolis(arm, &s.q, &s.qd), &(s.coriolis_gravity - s.gravity))
    };
    coriolis_matrix_agrees: |arm, s| {
        mixed_error(&coriolis_matrix(arm, &s.q, &s.qd), &s.coriolis_matrix)
    };
    tip_pose_agrees: |arm, s| pose_error(&tip_pose(arm, &s.q), &s.base_from_tip);
    jacobian_agrees: |arm, s| mixed_error(&jacobian(arm, &s.q), &s.jacobian);
    jacobian_dot_qd_agrees: |arm, s| {
        mixed_error(&jacobian_dot_qd(arm, &s.q, &s.qd), &s.jacobian_dot_qd)
    };
    kinetic_energy_agrees: |arm, s| {
        mixed_error(&scalar(kinetic_energy(arm, &s.q, &s.qd)), &scalar(s.kinetic_energy))
    };
    potential_energy_agrees: |arm, s| {
        mixed_error(&scalar(potential_energy(arm, &s.q)), &scalar(s.potential_energy))
    };
    momentum_agrees: |arm, s| {
        let found = momentum(arm, &s.q, &s.qd);
        mixed_error(&found.momentum, &(s.mass_matrix * s.qd)).max(mixed_error(
            &found.kinetic_gradient,
            &(s.coriolis_matrix.transpose() * s.qd),
        ))
    };
    // Random torques on the light wrist give accelerations of 1e5 rad/s^2, so the error is relative
    // to their norm.
    aba_agrees: |arm, s| {
        size(&(aba(arm, &s.q, &s.qd, &s.tau) - s.aba)) / size(&s.aba).max(1.0)
    };
    regressor_agrees: |arm, s| {
        let Some(expected) = &s.regressor else { return 0.0 };
        let found = regressor(arm, &s.q, &s.qd, &s.qdd);
        let rows = found.as_flattened().iter().zip(expected.as_flattened());
        rows.map(|(f, e)| mixed_error(f, e)).fold(0.0, f64::max)
    };
    regressor_of_pinocchio_times_parameters_agrees: |arm, s| {
        let Some(expected) = &s.regressor else { return 0.0 };
        mixed_error(&regressor_times(expected, &parameters(arm)), &s.rnea)
    };
    terms_agree: |arm, s| {
        let mut found = Terms::default();
        terms(arm, &s.q, &s.qd, &mut found);
        [
            mixed_error(&found.mass_matrix, &s.mass_matrix),
            mixed_error(&found.coriolis_gravity, &s.coriolis_gravity),
            mixed_error(&found.gravity, &s.gravity),
            pose_error(&found.base_from_tip, &s.base_from_tip),
            mixed_error(&found.jacobian, &s.jacobian),
            mixed_error(&found.jacobian_dot_qd, &s.jacobian_dot_qd),
            mixed_error(&found.momentum, &(s.mass_matrix * s.qd)),
            mixed_error(&found.kinetic_gradient, &(s.coriolis_matrix.transpose() * s.qd)),
        ]
        .into_iter()
        .fold(0.0, f64::max)
    };
}

fn pose_error(found: &Pose, expected: &Pose) -> f64 {
    mixed_error(&found.rotation, &expected.rotation)
        .max(mixed_error(&found.translation, &expected.translation))
}

#[test]
fn recorded_regressors_are_present() {
    let recorded = |has: Vec<bool>| has.iter().filter(|h| **h).count();
    assert_eq!(
        recorded(
            wam3()
                .samples
                .iter()
                .map(|s| s.regressor.is_some())
                .collect()
        ),
        6
    );
    assert_eq!(
        recorded(
            wam4()
                .samples
                .iter()
                .map(|s| s.regressor.is_some())
                .collect()
        ),
        6
    );
    assert_eq!(
        recorded(
            wam7()
                .samples
                .iter()
                .map(|s| s.regressor.is_some())
                .collect()
        ),
        6
    );
}

#[test]
fn the_comparison_rejects_nan() {
    let nan = scalar(f64::NAN);
    assert_eq!(mixed_error(&nan, &scalar(1.0)), f64::INFINITY);
    assert_eq!(error_at_scale(&scalar(1.0), &nan, 1.0), f64::INFINITY);
}
