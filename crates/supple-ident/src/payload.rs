//! A body in the hand: found from the torques it adds, or, known, used to calibrate the torque scale.
//!
//! Published torque constants of one arm differ by a fifth. A weight that is known tells: the torque it
//! must add at each joint against the torque that was logged more than without it.

use crate::compress::Block;
use crate::consistent::{Constraints, solve};
use crate::error::{IdentError, shape_error};
use crate::fit::Fit;
use crate::motion::Motion;
use crate::regressor::{JointRows, joint_rows};
use nalgebra::{DMatrix, SVector};
use supple_core::dynamics::regressor;
use supple_core::math::{Matrix3, Vector3};
use supple_core::{Body, Vector};

/// Ten parameters of `body`, given in the last link's frame, as [`supple_core::dynamics::parameters`]
/// orders them.
pub fn parameters_of(body: &Body) -> SVector<f64, 10> {
    let h = body.com_m * body.mass_kg;
    let c = &body.com_m;
    let about =
        body.inertia_kg_m2 + (Matrix3::identity() * c.dot(c) - c * c.transpose()) * body.mass_kg;
    SVector::from([
        body.mass_kg,
        h.x,
        h.y,
        h.z,
        about[(0, 0)],
        about[(0, 1)],
        about[(1, 1)],
        about[(0, 2)],
        about[(1, 2)],
        about[(2, 2)],
    ])
}

/// The body in the last link's frame that explains what `empty`, a fit of the arm without it, leaves of
/// `motions` with it. What they do not tell is drawn to `guess`.
///
/// # Errors
/// Shapes that do not agree; a guess that is no body.
pub fn payload<const N: usize>(
    empty: &Fit<N>,
    motions: &[Motion],
    guess: &Body,
) -> Result<Body, IdentError> {
    let mut all = Block::empty(10);
    for motion in motions {
        let loads = added(empty, motion)?;
        for (row, load) in loads.iter().enumerate() {
            let block = Block::of(load, 0.0, None);
            all.add(&block, 1.0 / empty.noise_nm[row].max(1e-9));
        }
    }
    let solution = solve(
        &all,
        &Constraints {
            links: vec![parameters_of(guess)],
            not_negative: Vec::new(),
            prior_weight: 1e-2,
            tolerance: 1e-9,
        },
    )?;
    let p = &solution.x;
    let com_m = Vector3::new(p[1], p[2], p[3]) / p[0];
    let about = Matrix3::new(p[4], p[5], p[7], p[5], p[6], p[8], p[7], p[8], p[9]);
    let centre = (Matrix3::identity() * com_m.dot(&com_m) - com_m * com_m.transpose()) * p[0];
    Ok(Body {
        mass_kg: p[0],
        com_m,
        inertia_kg_m2: about - centre,
    })
}

/// True by logged torque of each moving joint, from motions with the `known` body in the last link's frame
/// and a fit of the arm without it to torques of the same scale. `None` where the body adds too little to
/// a joint to tell.
///
/// # Errors
/// Shapes that do not agree; a body of no mass.
pub fn torque_scale<const N: usize>(
    empty: &Fit<N>,
    motions: &[Motion],
    known: &Body,
) -> Result<Vec<Option<f64>>, IdentError> {
    known
        .validate()
        .map_err(|error| shape_error("known payload", "a physical body", error.to_string()))?;
    let p = parameters_of(known);
    let joints = empty.columns.moving().len();
    let mut sums = vec![[0.0; 3]; joints];
    for motion in motions {
        for (sum, load) in sums.iter_mut().zip(added(empty, motion)?) {
            let expected = &load.a * p;
            sum[0] += expected.dot(&expected);
            sum[1] += expected.dot(&load.b);
            sum[2] += load.b.len() as f64;
        }
    }
    let scale = |(row, [square, product, count]): (usize, &[f64; 3])| {
        let told = (square / count.max(1.0)).sqrt() > 3.0 * empty.noise_nm[row];
        (told && *product > 0.0).then(|| square / product)
    };
    Ok(sums.iter().enumerate().map(scale).collect())
}

/// Rows of the body's ten parameters, and what the arm alone leaves, by moving joint.
fn added<const N: usize>(empty: &Fit<N>, motion: &Motion) -> Result<Vec<JointRows>, IdentError> {
    let mut joints = joint_rows(empty.nominal(), &empty.columns, motion)?;
    let moving = empty.columns.moving();
    for joint in &mut joints {
        joint.b -= &joint.a * &empty.x;
        joint.a = DMatrix::zeros(motion.samples(), 10);
    }
    for i in 0..motion.samples() {
        let at = |m: &DMatrix<f64>| Vector::<N>::from_fn(|j, _| m[(i, j)]);
        let held = |m: &DMatrix<f64>| {
            Vector::<N>::from_fn(|j, _| if moving.contains(&j) { m[(i, j)] } else { 0.0 })
        };
        let (q, qd, qdd) = (at(&motion.q), held(&motion.qd), held(&motion.qdd));
        let rows = regressor(empty.nominal(), &q, &qd, &qdd);
        for (joint, row) in moving.iter().zip(&mut joints) {
            for k in 0..10 {
                row.a[(i, k)] = rows[*joint][N - 1][k];
            }
        }
    }
    Ok(joints)
}
