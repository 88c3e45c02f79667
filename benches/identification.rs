//! Time of one physically consistent solve of a 7-joint arm, after the QR reduction of its rows:
//! `cargo bench --bench identification`.

use std::hint::black_box;
use std::time::Instant;
use supple_core::dynamics::rnea;
use supple_core::{Friction, Vector};
use supple_ident::constrained_least_squares::{Constraints, solve};
use supple_ident::qr_reduction::ReducedSystem;
use supple_ident::regressor::joint_rows;
use supple_ident::{Columns, DMatrix, FrictionColumns, Motion, model};
use supple_model::Description;

const JOINTS: [usize; 7] = [0, 1, 2, 3, 4, 5, 6];
const SAMPLES: usize = 6000;
const RATE_HZ: f64 = 100.0;
const ROUNDS: usize = 15;

fn main() {
    let arm = Description::asset("wam7")
        .and_then(|description| description.arm::<7>())
        .expect("a built-in arm");
    let wave = |i: usize, j: usize, derivative: i32| -> f64 {
        let t = i as f64 / RATE_HZ;
        (1..=5)
            .map(|k| {
                let w = 0.4 * f64::from(k) + 0.07 * j as f64;
                let turn = f64::from(derivative) * std::f64::consts::FRAC_PI_2;
                0.4 / f64::from(k) * w.powi(derivative) * (w * t + f64::from(k) + turn).sin()
            })
            .sum()
    };
    let columns = |derivative| DMatrix::from_fn(SAMPLES, 7, |i, j| wave(i, j, derivative));
    let (q, qd, qdd) = (columns(0), columns(1), columns(2));
    let friction = Friction::coulomb(1.0, 0.5);
    let mut tau = DMatrix::zeros(SAMPLES, 7);
    for i in 0..SAMPLES {
        let at = |m: &DMatrix<f64>| Vector::<7>::from_fn(|j, _| m[(i, j)]);
        let torque = rnea(&arm, &at(&q), &at(&qd), &at(&qdd));
        for j in 0..7 {
            let noise = 0.1 * (12.9898 * (i * 7 + j) as f64).sin();
            tau[(i, j)] = torque[j] + friction.torque_nm(qd[(i, j)]) + noise;
        }
    }
    let motion = Motion {
        rate_hz: RATE_HZ,
        q,
        qd,
        qdd,
        tau,
        independent_fraction: 1.0,
        cutoff_hz: None,
        start_s: 0.0,
        torque_delay_s: 0.0,
        excluded_intervals: Vec::new(),
    };
    let columns =
        Columns::new(7, &JOINTS, true, FrictionColumns::COULOMB_AND_OFFSET, &[]).expect("columns");
    let before = Instant::now();
    let mut block = ReducedSystem::empty(columns.len());
    for joint in joint_rows(&arm, &columns, &motion).expect("rows") {
        block.add(&joint.reduced(0.0, None), 10.0);
    }
    let reduced_s = before.elapsed().as_secs_f64();
    let constraints = Constraints {
        links: model::link_parameters::<7>(&model::prior(&arm, &columns)).to_vec(),
        not_negative: columns.not_negative(),
        prior_weight: 1.0,
        tolerance: 1e-9,
    };
    let mut times: Vec<f64> = (0..ROUNDS)
        .map(|_| {
            let before = Instant::now();
            black_box(solve(black_box(&block), black_box(&constraints)).expect("a solution"));
            before.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    println!(
        "{SAMPLES} samples of 7 joints, {} columns: rows and reduction {:.0} ms; consistent solve \
         {:.1} ms, median of {ROUNDS}",
        columns.len(),
        1e3 * reduced_s,
        1e3 * times[ROUNDS / 2]
    );
}
