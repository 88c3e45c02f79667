//! Filter, derivative and resampling compared with SciPy's numbers and with analytic results.

use std::f64::consts::TAU;
use supple_ident::filter::{LowPass, differentiate};
use supple_ident::{DMatrix, Log, Motion, Preparation, resample};

/// Printed by scripts/reference_filter.py.
const SOSFILTFILT: [f64; 40] = [
    0.2974680159499428,
    0.4266364920788397,
    0.5569798529040982,
    0.6888755492678061,
    0.8196500547125813,
    0.9434102373243524,
    1.0519417890981995,
    1.1362403268282701,
    1.1882112592053093,
    1.202126472029254,
    1.1755479983354193,
    1.1096401538039922,
    1.0089569601751707,
    0.8808308272961869,
    0.7345081594938807,
    0.5802208259352567,
    0.42834867210898986,
    0.28873077548203274,
    0.17015101685889256,
    0.08003551957600417,
    0.024347303667629397,
    0.007601881462757327,
    0.032949802177827434,
    0.10229648162189767,
    0.21638253406044436,
    0.3747328273147774,
    0.5754531106246591,
    0.814899920674437,
    1.0872518752312568,
    1.3840791352083834,
    1.6941179407271474,
    2.0034730356257895,
    2.296409662756816,
    2.5568446268695357,
    2.770529160792624,
    2.9276616836678913,
    3.02540633073993,
    3.069655757222321,
    3.075346531769702,
    3.0647691541852193,
];

fn signal() -> Vec<f64> {
    (0..40)
        .map(f64::from)
        .map(|n| (0.21 * n).sin() + 0.3 * (1.7 * n).cos() + 0.01 * n.powf(1.5))
        .collect()
}

#[test]
fn agrees_with_scipy() {
    let filter = LowPass::butterworth4(8.0, 100.0).unwrap();
    let filtered = filter.zero_phase(&signal()).unwrap();
    for (ours, theirs) in filtered.iter().zip(SOSFILTFILT) {
        assert!((ours - theirs).abs() < 1e-12, "{ours} {theirs}");
    }
}

#[test]
fn passes_a_slow_wave_unshifted_and_halves_the_amplitude_at_the_cutoff() {
    let filter = LowPass::butterworth4(8.0, 1000.0).unwrap();
    let wave = |hz: f64| -> Vec<f64> {
        (0..4000)
            .map(|n| (TAU * hz * f64::from(n) / 1000.0).sin())
            .collect()
    };
    let gain = |hz: f64| {
        let (x, y) = (wave(hz), filter.zero_phase(&wave(hz)).unwrap());
        let inner = 1000..3000;
        let product = |a: &[f64], b: &[f64]| -> f64 { inner.clone().map(|i| a[i] * b[i]).sum() };
        product(&x, &y) / product(&x, &x)
    };
    assert!((gain(0.5) - 1.0).abs() < 1e-8);
    assert!((gain(8.0) - 0.5).abs() < 1e-6);
    assert!(gain(80.0).abs() < 1e-6);
}

#[test]
fn rejects_signals_that_it_cannot_filter() {
    assert!(LowPass::butterworth4(50.0, 100.0).is_err());
    assert!(LowPass::butterworth4(-1.0, 100.0).is_err());
    let filter = LowPass::butterworth4(8.0, 100.0).unwrap();
    // The filter extends the signal by 15 samples at each end, and needs more than that.
    assert!(filter.zero_phase(&[0.0; 15]).is_err());
}

#[test]
fn differences_are_exact_for_parabolas() {
    let x = DMatrix::from_fn(9, 1, |i, _| {
        let t = i as f64 / 10.0;
        3.0 * t * t - t
    });
    let slope = differentiate(&x, 10.0).unwrap();
    for i in 0..9 {
        assert!((slope[(i, 0)] - (0.6 * i as f64 - 1.0)).abs() < 1e-12);
    }
}

#[test]
fn resampling_an_irregular_log_preserves_a_line() {
    let t: Vec<f64> = (0..100)
        .map(|i| f64::from(i) * 0.01 + 0.002 * f64::from(i).sin())
        .collect();
    let x = DMatrix::from_fn(100, 1, |i, _| 2.0 * t[i] - 1.0);
    let grid = resample(&t, &x, 100.0, 0.0);
    for i in 0..grid.nrows() {
        let at = t[0] + i as f64 / 100.0;
        assert!((grid[(i, 0)] - (2.0 * at.min(t[99]) - 1.0)).abs() < 1e-12);
    }
}

fn log(samples: usize) -> Log {
    let t = |i: usize| i as f64 / 100.0;
    Log {
        t_s: (0..samples).map(t).collect(),
        q_rad: DMatrix::from_fn(samples, 2, |i, j| (t(i) * (1.0 + j as f64)).sin()),
        qd_rad_per_s: None,
        tau_nm: DMatrix::from_fn(samples, 2, |i, _| t(i).cos()),
    }
}

#[test]
fn a_regular_log_keeps_its_samples() {
    let preparation = Preparation {
        cutoff_hz: None,
        ..Preparation::default()
    };
    let (motion, _) = Motion::prepare(&log(601), 2, &[0, 1], &preparation).unwrap();
    assert_eq!(motion.samples(), 601);
    assert!((motion.q - log(601).q_rad).amax() < 1e-12);
}

/// A log that starts and ends in full motion has no spurious acceleration at its ends.
#[test]
fn filter_transients_are_discarded() {
    let preparation = Preparation {
        decimation_factor: 2,
        ..Preparation::default()
    };
    let samples = 601;
    let (motion, _) = Motion::prepare(&log(samples), 2, &[0, 1], &preparation).unwrap();
    let first = (samples - 2 * motion.samples()).div_ceil(2);
    assert!(
        (10..40).contains(&first),
        "{first} samples cut off at each end"
    );
    for i in 0..motion.samples() {
        let t = (first + 2 * i) as f64 / 100.0;
        for j in 0..2 {
            let w = 1.0 + j as f64;
            let exact = -w * w * (w * t).sin();
            let error = motion.qdd[(i, j)] - exact;
            assert!(error.abs() < 0.03 * w * w, "sample {i}, joint {j}: {error}");
        }
    }
    let error = Motion::prepare(&log(50), 2, &[0, 1], &preparation).unwrap_err();
    assert!(error.to_string().contains("transient"), "{error}");
}

#[test]
fn invalid_logs_are_rejected_with_column_and_remedy() {
    let refused = |change: fn(&mut Log), column: &str| {
        let mut bad = log(600);
        change(&mut bad);
        let text = bad.check(2, &[0, 1]).unwrap_err().to_string();
        assert!(text.contains(column), "{text}");
        assert!(text.contains("; "), "{text} names no remedy");
    };
    refused(|l| l.q_rad[(7, 1)] = f64::NAN, "q[1]");
    refused(|l| l.tau_nm[(7, 0)] = f64::INFINITY, "tau[0]");
    refused(|l| l.t_s[9] = l.t_s[8], "t:");
    refused(
        |l| l.t_s.iter_mut().skip(300).for_each(|t| *t += 1.0),
        "gap",
    );
    refused(|l| l.q_rad *= 57.3, "degrees");
    refused(|l| l.q_rad.column_mut(1).fill(0.3), "q[1]");
    refused(|l| l.tau_nm.column_mut(1).fill(0.3), "tau[1]");
    refused(
        |l| {
            l.qd_rad_per_s = Some(DMatrix::from_fn(600, 2, |i, j| {
                let w = 1.0 + j as f64;
                57.3 * w * (i as f64 / 100.0 * w).cos()
            }))
        },
        "qd[0]",
    );
    assert!(log(600).check(3, &[0]).is_err());
    assert!(log(600).check(2, &[2]).is_err());
    assert!(log(600).check(2, &[1, 0]).is_err());
    assert!(log(600).check(2, &[0, 1]).unwrap().is_empty());
    // A log of 2 s causes a warning.
    assert_eq!(log(200).check(2, &[0, 1]).unwrap().len(), 1);
}

#[test]
fn a_joint_at_rest_is_accepted_if_it_is_not_identified() {
    let mut one_at_rest = log(600);
    one_at_rest.q_rad.column_mut(1).fill(0.3);
    assert!(one_at_rest.check(2, &[0]).unwrap().is_empty());
}
