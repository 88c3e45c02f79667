//! A body in the hand: found from the torques it adds, or, known, used to calibrate the torque scale.
//!
//! Published torque constants of one arm differ by a fifth. A weight that is known tells: the torque it
//! must add at each joint against the torque that was logged more than without it.

use crate::base::{Base, RANK_TOLERANCE};
use crate::compress::Block;
use crate::consistent::{Constraints, solve};
use crate::error::{IdentError, shape_error};
use crate::estimate::nearest;
use crate::fit::Fit;
use crate::motion::Motion;
use crate::regressor::{JointRows, joint_rows};
use nalgebra::{DMatrix, DVector, SVector};
use supple_core::dynamics::regressor;
use supple_core::math::{Matrix3, Vector3};
use supple_core::{Body, Vector};

/// Greatest standard deviation of a scale that is told, by the scale.
const TOLD: f64 = 0.05;

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

/// True by logged torque of each moving joint, from motions of the arm `without` the `known` body, which
/// the fit was made from, and motions `with` it in the last link's frame, torques of the same scales.
///
/// Each joint is told by itself: `tau_j = Y_j x_j + k_j Y_hand p`, where only the last term is there with the
/// body alone, and the scale is `1 / k_j`. Joints share links, so that parameters common to them all would
/// carry the scale of one joint into another. `None` where the body adds too little to a joint to tell.
///
/// # Errors
/// Shapes that do not agree; a body that is none.
pub fn torque_scale<const N: usize>(
    empty: &Fit<N>,
    without: &[Motion],
    with: &[Motion],
    known: &Body,
) -> Result<Vec<Option<f64>>, IdentError> {
    known
        .validate()
        .map_err(|error| shape_error("known payload", "a physical body", error.to_string()))?;
    let p = parameters_of(known);
    let mut blocks = vec![Block::empty(empty.columns.len() + 2); empty.columns.moving().len()];
    let mut independent_share: f64 = 1.0;
    for (motions, carries) in [(without, false), (with, true)] {
        for motion in motions {
            independent_share = independent_share.min(motion.independent_share);
            let arm = joint_rows(empty.nominal(), &empty.columns, motion)?;
            let hand = added(empty, motion)?;
            for (row, &joint) in empty.columns.moving().iter().enumerate() {
                let load = &hand[row].a * p * f64::from(u8::from(carries));
                // With the rotor as a column even where it is known: known, it is of another scale.
                let mut a = arm[row]
                    .a
                    .clone()
                    .resize_horizontally(blocks[row].unknowns(), 0.0);
                a.set_column(empty.columns.len(), &motion.qdd.column(joint));
                a.set_column(empty.columns.len() + 1, &load);
                let tau = motion.tau.column(joint).into_owned();
                let rows = JointRows::new(a, tau, arm[row].speed.clone());
                blocks[row].add(&Block::of(&rows, 0.0, None), 1.0);
            }
        }
    }
    blocks
        .iter()
        .map(|block| scale_of(block, independent_share))
        .collect()
}

/// One over the last unknown, where it is told.
fn scale_of(block: &Block, independent_share: f64) -> Result<Option<f64>, IdentError> {
    let base = Base::of(&block.a(), RANK_TOLERANCE)?;
    let Ok(place) = base.independent.binary_search(&(block.unknowns() - 1)) else {
        return Ok(None);
    };
    let x = nearest(block, &DVector::zeros(block.unknowns()))?;
    let found = x[block.unknowns() - 1];
    let freedom = block.rows().saturating_sub(base.rank()) as f64 * independent_share;
    let noise = (block.error_squared(&x) / freedom.max(1.0)).sqrt();
    let deviation = base.standard_deviations(noise)[place];
    Ok((found > 0.0 && deviation <= TOLD * found).then(|| 1.0 / found))
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
            for (k, value) in rows[*joint][N - 1].iter().enumerate() {
                row.a[(i, k)] = *value;
            }
        }
    }
    Ok(joints)
}
