//! The paper's estimator recovers exactly the ten determined combinations of the published set.

use supple_core::Vector;
use supple_ident::paper_estimator::{estimate, with_psi};
use supple_ident::{DMatrix, Motion};
use supple_model::paper::Parameters;
use supple_random::Random;

/// Sums of sinusoids with their exact derivatives, and the torques of `truth`.
fn motion(truth: &Parameters, samples: usize) -> Motion {
    let rate_hz = 100.0;
    let wave = |i: usize, j: usize, derivative: i32| -> f64 {
        let t = i as f64 / rate_hz;
        (1..=4)
            .map(|k| {
                let w = 0.9 * f64::from(k) + 0.13 * j as f64;
                let phase = 0.7 * f64::from(k * k) + j as f64;
                let turn = f64::from(derivative) * std::f64::consts::FRAC_PI_2;
                w.powi(derivative) * 0.5 / f64::from(k) * (w * t + phase + turn).sin()
            })
            .sum()
    };
    let columns = |derivative| DMatrix::from_fn(samples, 3, |i, j| wave(i, j, derivative));
    let (q, qd, qdd) = (columns(0), columns(1), columns(2));
    let friction = truth.friction();
    let mut tau = DMatrix::zeros(samples, 3);
    for i in 0..samples {
        let at = |m: &DMatrix<f64>| Vector::<3>::from_fn(|j, _| m[(i, j)]);
        let torque = truth.inverse_dynamics(&at(&q), &at(&qd), &at(&qdd));
        for j in 0..3 {
            tau[(i, j)] = torque[j] + friction[j].torque_nm(qd[(i, j)]);
        }
    }
    Motion {
        rate_hz,
        q,
        qd,
        qdd,
        tau,
        independent_fraction: 1.0,
        cutoff_hz: None,
        start_s: 0.0,
        torque_delay_s: 0.0,
        excluded_intervals: Vec::new(),
    }
}

#[test]
fn recovers_the_ten_published_combinations_from_noise_free_data() {
    let truth = Parameters::PUBLISHED;
    let found = estimate(&truth, &motion(&truth, 1600)).unwrap();
    assert_eq!(found.columns.rank(), 10);
    for (ours, published) in found.base.iter().zip(truth.base()) {
        assert!((ours - published).abs() < 1e-9, "{ours} {published}");
    }
    assert!(found.residual_nm < 1e-12);
    assert!(found.columns.condition > 1.0 && found.columns.condition < 1e3);
}

#[test]
fn the_null_space_couples_the_inertias_and_the_solution_has_minimum_norm() {
    let truth = Parameters::PUBLISHED;
    let found = estimate(&truth, &motion(&truth, 1600)).unwrap();
    let names = Parameters::PSI_NAMES.map(str::to_owned);
    let directions = found.columns.null_space_text(&names);
    assert_eq!(directions.len(), 2);
    for text in &directions {
        assert!(text.contains("I"), "{text}");
        assert!(!text.contains("V") && !text.contains("m2r2"), "{text}");
    }
    let norm = |psi: &[f64; 12]| psi.iter().map(|p| p * p).sum::<f64>();
    // Because sin^2 + cos^2 = 1, an amount can move from Iz1 to Ix and Iy' of one link.
    for (ix, iy) in [(1, 3), (6, 7)] {
        for step in [0.01, -0.01] {
            let mut moved = found.psi;
            moved[0] -= step;
            moved[ix] += step;
            moved[iy] += step;
            let same = with_psi(&truth, &moved).base();
            assert!((0..10).all(|i| (same[i] - found.base[i]).abs() < 1e-12));
            assert!(norm(&moved) > norm(&found.psi));
        }
    }
}

#[test]
fn standard_deviations_cover_the_errors_of_noisy_data() {
    let truth = Parameters::PUBLISHED;
    let mut noisy = motion(&truth, 3000);
    let mut noise = Random::new(7);
    noisy
        .tau
        .iter_mut()
        .for_each(|t| *t += 0.5 * noise.signed());
    let found = estimate(&truth, &noisy).unwrap();
    assert!((found.residual_nm - (1.0_f64 / 12.0).sqrt()).abs() < 0.01);
    let scores = (0..10).map(|i| (found.base[i] - truth.base()[i]) / found.base_std[i]);
    let square = scores.map(|s| s * s).sum::<f64>() / 10.0;
    assert!((0.2..2.5).contains(&square), "{square}");
}

#[test]
fn rejects_too_few_samples_and_resting_joints() {
    let truth = Parameters::PUBLISHED;
    let short = estimate(&truth, &motion(&truth, 1599)).unwrap_err();
    assert!(short.to_string().contains("1600"));
    let mut resting = motion(&truth, 1600);
    for m in [&mut resting.qd, &mut resting.qdd] {
        m.fill(0.0);
    }
    let refused = estimate(&truth, &resting).unwrap_err().to_string();
    assert!(refused.contains("of 10"), "{refused}");
}
