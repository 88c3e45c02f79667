//! The momentum observer on an exactly simulated arm: a first-order lag of the stated bandwidth.

use crate::support;
use supple_core::config::Role;
use supple_core::dynamics::{Terms, terms};
use supple_core::impedance::Task;
use supple_core::math::Vector3;
use supple_core::observer::MomentumObserver;
use supple_core::{Arm, Vector};

use crate::support::arms::{wam3, wam4};
use crate::support::configs::four;
use crate::support::plant::{Plant, push};

/// Runs the observer on an oscillating arm with the torque `external` on it. Returns the residual
/// and the arm's angles after each cycle, and the maximum rate of change of `C^T qd - G`, the
/// momentum rate without motor torque.
fn observe<const N: usize>(
    arm: Arm<N>,
    external: impl Fn(f64, &Arm<N>, &Vector<N>) -> Vector<N>,
    omega: f64,
    period_s: f64,
    duration_s: f64,
) -> Run<N> {
    let start = support::rig::bent::<N>();
    let mut plant = Plant::at_rest(arm, start);
    plant.qd = Vector::from_fn(|i, _| 0.6 - 0.3 * i as f64);
    let mut observer = MomentumObserver::default();
    let mut now = Terms::default();
    terms(&arm, &plant.q, &plant.qd, &mut now);
    observer.update(&now.momentum, &Vector::zeros(), period_s, omega);
    let mut run = Run {
        residuals: Vec::new(),
        angles: Vec::new(),
        passive_rate_change: 0.0,
    };
    let cycles = (duration_s / period_s).round() as u32;
    for k in 0..cycles {
        let time_s = f64::from(k) * period_s;
        let before = now.kinetic_gradient - now.gravity;
        // Gravity compensation, a soft spring to the start, and an oscillating torque: smooth
        // motion.
        let torque = now.gravity - (plant.q - start) * 10.0 - plant.qd * 2.0
            + Vector::from_fn(|i, _| 2.0 * (3.0 * time_s + i as f64).sin());
        plant.advance(&torque, |arm, q, _| external(time_s, arm, q), period_s, 20);
        terms(&arm, &plant.q, &plant.qd, &mut now);
        let passive_rate = now.kinetic_gradient - now.gravity;
        run.passive_rate_change = run
            .passive_rate_change
            .max(support::size(&(passive_rate - before)) / period_s);
        observer.update(&now.momentum, &(torque + passive_rate), period_s, omega);
        run.residuals.push(observer.external_torque_nm());
        run.angles.push(plant.q);
    }
    run
}

struct Run<const N: usize> {
    residuals: Vec<Vector<N>>,
    angles: Vec<Vector<N>>,
    passive_rate_change: f64,
}

fn nothing<const N: usize>(_: f64, _: &Arm<N>, _: &Vector<N>) -> Vector<N> {
    Vector::zeros()
}

/// `C^T qd - G` is sampled at the end of each cycle: the error is its change over half a period.
#[test]
fn without_external_torque_only_discretisation_error_remains() {
    let worst = |period_s: f64| {
        let run = observe(wam4(), nothing, 40.0, period_s, 2.0);
        let worst = run.residuals.iter().map(support::size).fold(0.0, f64::max);
        let bound = 0.5 * period_s * run.passive_rate_change;
        assert!(worst <= 1.2 * bound, "{worst} N m, {bound} expected");
        assert!(worst > 0.0);
        worst
    };
    let (coarse, fine) = (worst(1e-3), worst(2.5e-4));
    assert!(coarse < 0.05, "{coarse} N m at 1 kHz");
    let order = (coarse / fine).log2() / 2.0;
    assert!(
        (0.9..1.1).contains(&order),
        "first order in the period, {order}"
    );
}

/// A step of torque on any joint: `1 - exp(-omega t)` of it on that joint, nothing on the others.
#[test]
fn a_step_is_followed_as_a_first_order_lag() {
    for omega in [10.0, 40.0, 100.0] {
        for joint in 0..4 {
            let mut step = Vector::<4>::zeros();
            step[joint] = 3.0;
            let period_s = 2.5e-4;
            let run = observe(wam4(), |_, _, _| step, omega, period_s, 0.4);
            let quiet = observe(wam4(), nothing, omega, period_s, 0.4);
            // The observer samples this rate once a cycle, in both runs.
            let sampling_error =
                2.0 * period_s * (run.passive_rate_change + quiet.passive_rate_change);
            for (k, residual) in run.residuals.iter().enumerate() {
                let time_s = f64::from(k as u32 + 1) * period_s;
                let lag = 1.0 - (-omega * time_s).exp();
                // The step of 3 N m is seen up to a cycle late.
                let tolerance = 3.0 * omega * period_s + sampling_error;
                let error = support::size(&(residual - step * lag));
                assert!(
                    error < tolerance,
                    "{error} N m off at {time_s} s, {omega} rad/s"
                );
            }
        }
    }
}

/// A rotating force on the tip, computed from the residual by the transpose of the dynamically consistent
/// inverse `H^-1 J^T A^-1` of the Jacobian: amplitude and phase of a
/// first-order lag at that frequency.
#[test]
fn a_rotating_tip_force_is_observed_with_first_order_gain_and_lag() {
    let (omega, w, period_s) = (40.0, 12.0, 2.5e-4);
    let force = move |time_s: f64| {
        let (sin, cos) = (w * time_s).sin_cos();
        Vector3::new(4.0 * sin, 3.0 * cos, -2.0 * sin)
    };
    let roles = [Role::Active; 3];
    let run = observe(
        wam3(),
        |time_s, arm, q| push(arm, q, &force(time_s)),
        omega,
        period_s,
        2.0,
    );
    let (gain, lag_s) = (omega / f64::hypot(omega, w), (w / omega).atan() / w);
    let (mut worst, mut last): (f64, f64) = (0.0, 0.0);
    for (k, (residual, q)) in run.residuals.iter().zip(&run.angles).enumerate() {
        let time_s = f64::from(k as u32 + 1) * period_s;
        if time_s < 0.5 {
            continue;
        }
        let mut here = Terms::default();
        terms(&wam3(), q, &Vector::zeros(), &mut here);
        let task = Task::new(&here, &roles).expect("a task");
        if task.min_singular_value_m < supple_core::impedance::SINGULAR_BELOW_M {
            continue;
        }
        let seen = task.inverse.tr_mul(residual);
        let expected = force(time_s - lag_s) * gain;
        worst = worst.max((seen - expected).norm());
        last = time_s;
    }
    // The pose changes during the lag: 15 % of the largest force, 4.5 N.
    assert!(worst < 0.15 * 4.5, "{worst} N off");
    assert!(last > 1.5);
}

/// At rest under an external torque the residual equals that torque.
#[test]
fn a_constant_force_is_observed_completely() {
    let config = four();
    let arm = config.arm;
    let q = support::rig::bent::<4>();
    let mut here = Terms::default();
    terms(&arm, &q, &Vector::zeros(), &mut here);
    let force = Vector3::new(2.0, -1.0, 3.0);
    let external = push(&arm, &q, &force);
    let mut observer = MomentumObserver::default();
    for _ in 0..2000 {
        // The net torque of the motors balances the external one.
        let net_torque = -external;
        observer.update(&here.momentum, &net_torque, 1e-3, 40.0);
    }
    support::assert_close(&observer.external_torque_nm(), &external, 1e-9);
    observer.reset();
    assert_eq!(observer.external_torque_nm(), Vector::<4>::zeros());
    assert_eq!(observer, MomentumObserver::default());
}

/// The update is backward Euler in the residual: no bandwidth makes it unstable.
#[test]
fn any_bandwidth_is_stable() {
    for omega in [1.0, 1e3, 1e5, 1e9] {
        let mut observer = MomentumObserver::<1>::default();
        let mut momentum = 0.0;
        observer.update(&Vector::<1>::new(momentum), &Vector::zeros(), 1e-3, omega);
        for _ in 0..20_000 {
            momentum += 2.0 * 1e-3;
            observer.update(&Vector::<1>::new(momentum), &Vector::zeros(), 1e-3, omega);
            let residual = observer.external_torque_nm()[0];
            assert!(
                (0.0..=2.0 + 1e-6).contains(&residual),
                "{residual} at {omega}"
            );
        }
        let residual = observer.external_torque_nm()[0];
        assert!((residual - 2.0).abs() < 1e-3, "{residual} at {omega}");
    }
}

#[test]
fn a_residual_that_decays_never_becomes_subnormal() {
    let (omega, period_s) = (50.0, 1e-3);
    let mut observer = MomentumObserver::<2>::default();
    let rest = Vector::zeros();
    for k in 0..60_000 {
        let net_torque = if k < 100 {
            Vector::from([0.4, -3.0])
        } else {
            rest
        };
        observer.update(&rest, &net_torque, period_s, omega);
        for torque in &observer.external_torque_nm() {
            assert!(*torque == 0.0 || torque.abs() > 1e-13, "{torque} at {k}");
        }
    }
}
