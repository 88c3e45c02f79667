//! The asset `paper3` is the physical arm closest to the published parameters, recomputed here.
//!
//! Nearest: minimum mean square torque error over the workspace (the asset's joint ranges, uniform) with
//! joint speeds of 0.5 rad/s and accelerations of 1 rad/s^2 (standard deviations, independent), in the
//! seven inertial base parameters, `m3` as published. Physical: each link's mass has a standard
//! deviation of at least 1 cm along its own axis. Only the published link 3 violates this, so the nearest arm
//! lies on the bound: a quadratic program with one quadratic constraint.

use nalgebra::{SMatrix, SVector};
use supple_core::Vector;
use supple_model::Description;
use supple_model::paper::Parameters;

const SPEED_RAD_PER_S: f64 = 0.5;
const ACCELERATION_RAD_PER_S2: f64 = 1.0;
const MIN_EXTENT_M: f64 = 0.01;
/// Masses that the published set does not determine \[kg\].
const M1_KG: f64 = 10.7677;
const M2_KG: f64 = 5.6772;

type Base = SVector<f64, 7>;

const ZERO: Parameters = Parameters {
    iz1_kg_m2: 0.0,
    ix2_kg_m2: 0.0,
    iy2_kg_m2: 0.0,
    iz2_kg_m2: 0.0,
    m2r2_kg_m: 0.0,
    ix3_kg_m2: 0.0,
    iy3_kg_m2: 0.0,
    iz3_kg_m2: 0.0,
    m3r3_kg_m: 0.0,
    m3_kg: 0.0,
    ..Parameters::PUBLISHED
};

/// The set with these base parameters that keeps `Iz1` and `Ix2` as published.
fn with_base(base: &Base) -> Parameters {
    let published = Parameters::PUBLISHED;
    let ix3_kg_m2 = base[0] - published.iz1_kg_m2 - published.ix2_kg_m2;
    Parameters {
        iy2_kg_m2: base[1] + published.ix2_kg_m2,
        ix3_kg_m2,
        iy3_kg_m2: base[2] + ix3_kg_m2,
        iz2_kg_m2: base[3],
        iz3_kg_m2: base[4],
        m2r2_kg_m: base[5],
        m3r3_kg_m: base[6],
        ..published
    }
}

fn inertial_base(parameters: &Parameters) -> Base {
    Base::from_column_slice(&parameters.base()[..7])
}

/// Mean of `Y^T Y` over the states, `Y` the torque's regressor in the base parameters.
fn torque_metric(description: &Description) -> SMatrix<f64, 7, 7> {
    let columns: [Parameters; 7] = [
        Parameters {
            iz1_kg_m2: 1.0,
            ..ZERO
        },
        Parameters {
            iy2_kg_m2: 1.0,
            ..ZERO
        },
        Parameters {
            iy3_kg_m2: 1.0,
            ..ZERO
        },
        Parameters {
            iz2_kg_m2: 1.0,
            ..ZERO
        },
        Parameters {
            iz3_kg_m2: 1.0,
            ..ZERO
        },
        Parameters {
            m2r2_kg_m: 1.0,
            ..ZERO
        },
        Parameters {
            m3r3_kg_m: 1.0,
            ..ZERO
        },
    ];
    let limits = description.config::<3>().unwrap().limits;
    let (lower, upper) = (limits.position_lower_rad, limits.position_upper_rad);
    // Three-point Gauss-Hermite nodes, exact for the fourth moments that speeds enter with.
    let node = 3.0_f64.sqrt();
    let speeds = [(-node, 1.0 / 6.0), (0.0, 2.0 / 3.0), (node, 1.0 / 6.0)];
    let cells = 24;
    let mut metric = SMatrix::<f64, 7, 7>::zeros();
    for cell in 0..cells * cells {
        let at = |joint: usize, i: usize| {
            let share = (i as f64 + 0.5) / f64::from(cells as u32);
            lower[joint] + share * (upper[joint] - lower[joint])
        };
        let q = Vector::<3>::new(0.0, at(1, cell % cells), at(2, cell / cells));
        for nodes in 0..27 {
            let pick = [speeds[nodes % 3], speeds[nodes / 3 % 3], speeds[nodes / 9]];
            let qd = Vector::<3>::from_fn(|i, _| SPEED_RAD_PER_S * pick[i].0);
            let weight: f64 = pick.iter().map(|(_, weight)| weight).product();
            // Accelerations enter linearly: two nodes each.
            for signs in 0..8 {
                let qdd = Vector::<3>::from_fn(|i, _| {
                    ACCELERATION_RAD_PER_S2 * if signs >> i & 1 == 1 { 1.0 } else { -1.0 }
                });
                let torques = columns.map(|column| column.inverse_dynamics(&q, &qd, &qdd));
                let regressor = SMatrix::<f64, 3, 7>::from_columns(&torques);
                metric += regressor.transpose() * regressor * (weight / 8.0);
            }
        }
    }
    metric / (cells * cells) as f64
}

/// Mean square extent of link 3 along its axis, less the bound, times its mass \[kg m^2\].
fn slack(base: &Base) -> f64 {
    let m3 = Parameters::PUBLISHED.m3_kg;
    0.5 * (base[2] + base[4]) - base[6] * base[6] / m3 - m3 * MIN_EXTENT_M * MIN_EXTENT_M
}

fn slack_gradient(base: &Base) -> Base {
    let by_moment = -2.0 * base[6] / Parameters::PUBLISHED.m3_kg;
    Base::from_column_slice(&[0.0, 0.0, 0.5, 0.0, 0.5, 0.0, by_moment])
}

/// Minimises `(b - b0)^T metric (b - b0)` on `slack(b) = 0`, by repeated linearisation of the constraint.
fn nearest(metric: &SMatrix<f64, 7, 7>, published: &Base) -> Base {
    let inverse = metric
        .try_inverse()
        .expect("base parameters are independent");
    let mut base = *published;
    for _ in 0..200 {
        let gradient = slack_gradient(&base);
        // Linearised at `base`: slack + gradient . (b - base) = 0, b = b0 + inverse gradient lambda.
        let from_published = slack(&base) + gradient.dot(&(published - base));
        let lambda = -from_published / gradient.dot(&(inverse * gradient));
        base = published + inverse * gradient * lambda;
    }
    base
}

#[test]
fn asset_is_the_physical_arm_closest_to_the_published_one() {
    let description = Description::asset("paper3").unwrap();
    let metric = torque_metric(&description);
    let published = inertial_base(&Parameters::PUBLISHED);
    assert!(
        slack(&published) < 0.0,
        "link 3 as published is inconsistent"
    );
    let found = nearest(&metric, &published);
    assert!(slack(&found).abs() < 1e-12);
    let expected = with_base(&found);
    let error = found - published;
    let rms = (error.dot(&(metric * error))).sqrt();
    println!("{expected:#?}\nresidual {error:.4}torque error {rms:.4} N m rms");
    let parts = description.parts::<3>().unwrap();
    let joints = expected.joints(M1_KG, M2_KG);
    for (asset, joint) in parts.joints.iter().zip(&joints) {
        assert!((asset.body.mass_kg - joint.body.mass_kg).abs() < 1e-9);
        assert!((asset.body.com_m - joint.body.com_m).amax() < 1e-6);
        assert!(
            (asset.body.inertia_kg_m2 - joint.body.inertia_kg_m2).amax() < 1e-6,
            "asset {} expected {}",
            asset.body.inertia_kg_m2,
            joint.body.inertia_kg_m2
        );
    }
}
