//! Motions with exact derivatives, torques of a known arm, and noise with a seed.

use supple_core::dynamics::rnea;
use supple_core::math::{Matrix3, Vector3};
use supple_core::{Arm, Body, Friction, Joint, Pose, Vector};
use supple_ident::{DMatrix, Motion};
use supple_random::Random;

/// A physically consistent arm with random axes, offsets and rotors.
pub fn random_arm<const N: usize>(seed: u64) -> Arm<N> {
    let mut noise = Random::new(seed);
    let joints: [Joint; N] = std::array::from_fn(|_| {
        let mut three = |s: f64| [s * noise.signed(), s * noise.signed(), s * noise.signed()];
        let (xyz, rpy, axis) = (three(0.4), three(3.0), three(1.0));
        let com_m = Vector3::from(three(0.2));
        let spread = Matrix3::from_fn(|_, _| noise.signed());
        let covariance = spread * spread.transpose() * 0.01 + Matrix3::identity() * 0.005;
        let mass_kg = 2.5 + 2.0 * noise.signed();
        Joint {
            parent_from_link: Pose::from_xyz_rpy(xyz, rpy),
            axis: Vector3::from(axis).normalize(),
            body: Body {
                mass_kg,
                com_m,
                inertia_kg_m2: (Matrix3::identity() * covariance.trace() - covariance) * mass_kg,
            },
            armature_kg_m2: 0.05 + 0.04 * noise.signed(),
        }
    });
    let gravity = Vector3::new(0.0, 0.0, -9.81);
    Arm::new(&joints, Pose::IDENTITY, None, gravity).unwrap()
}

/// Sums of sinusoids for the `identified_joints`; the other joints rest at distinct angles.
pub fn motion<const N: usize>(
    truth: &Arm<N>,
    friction: &[Friction; N],
    moving: &[usize],
    samples: usize,
    seed: u64,
) -> Motion {
    motion_of_size(1.0, truth, friction, moving, samples, seed)
}

/// Does the same with amplitudes of this multiple.
pub fn motion_of_size<const N: usize>(
    size: f64,
    truth: &Arm<N>,
    friction: &[Friction; N],
    moving: &[usize],
    samples: usize,
    seed: u64,
) -> Motion {
    let rate_hz = 50.0;
    let mut noise = Random::new(seed);
    let waves: Vec<[f64; 3]> = (0..5 * N)
        .map(|_| {
            [
                0.4 * size * noise.signed(),
                2.0 + 1.7 * noise.signed(),
                3.0 * noise.signed(),
            ]
        })
        .collect();
    let wave = |i: usize, j: usize, derivative: i32| -> f64 {
        let t = i as f64 / rate_hz;
        let turn = f64::from(derivative) * std::f64::consts::FRAC_PI_2;
        if !moving.contains(&j) {
            return if derivative == 0 { 0.3 + j as f64 } else { 0.0 };
        }
        waves[5 * j..5 * j + 5]
            .iter()
            .map(|[a, w, phase]| a * w.powi(derivative) * (w * t + phase + turn).sin())
            .sum()
    };
    let columns = |derivative| DMatrix::from_fn(samples, N, |i, j| wave(i, j, derivative));
    let (q, qd, qdd) = (columns(0), columns(1), columns(2));
    let mut tau = DMatrix::zeros(samples, N);
    for i in 0..samples {
        let at = |m: &DMatrix<f64>| Vector::<N>::from_fn(|j, _| m[(i, j)]);
        let torque = rnea(truth, &at(&q), &at(&qd), &at(&qdd));
        for j in 0..N {
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
