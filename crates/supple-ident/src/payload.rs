//! Payload at the hand: identified from the torques it adds, or, if known, used to calibrate the torque scale.
//!
//! Published torque constants of one arm differ by 20 %. A known weight resolves this: the torque that it
//! must add at each joint is compared with the logged increase.

use crate::base_parameters::{BaseParameters, RANK_TOLERANCE};
use crate::constrained_least_squares::{Constraints, solve};
use crate::error::{IdentError, shape_error};
use crate::estimate::nearest;
use crate::fit::Fit;
use crate::joint_rows::JointRows;
use crate::motion::Motion;
use crate::qr_reduction::ReducedSystem;
use crate::regressor::joint_rows;
use nalgebra::{DMatrix, DVector, SVector};
use supple_core::dynamics::regressor;
use supple_core::math::{Matrix3, Vector3};
use supple_core::{Body, Vector};

/// Maximum relative standard deviation of a returned scale.
const MAX_RELATIVE_SCALE_STD: f64 = 0.05;

/// Returns the ten parameters of `body`, given in the last link's frame, in the order of
/// [`supple_core::dynamics::parameters`].
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

/// Identifies a payload in the last link's frame from the residual of `empty`, a fit of the arm without it,
/// over `motions` with it. Undetermined parameters are regularised towards `guess`.
///
/// # Errors
/// Shapes that do not agree; a physically inconsistent guess.
pub fn payload<const N: usize>(
    empty: &Fit<N>,
    motions: &[Motion],
    guess: &Body,
) -> Result<Body, IdentError> {
    let mut all = ReducedSystem::empty(10);
    for motion in motions {
        let loads = payload_rows(empty, motion)?;
        for (row, load) in loads.iter().enumerate() {
            let block = load.reduced(0.0, None);
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

/// Estimates the ratio of true to logged torque of each identified joint, from the fitted motions `without` the `known` payload
/// and motions `with` the payload in the last link's frame, with the same torque scales.
///
/// Each joint is estimated separately: `tau_j = Y_j x_j + k_j Y_hand p`, where the last term is present only
/// with the payload; the scale is `1 / k_j`. Since joints share links, common parameters would transfer the
/// scale of one joint to another. `None` if the payload adds too little torque to a joint.
///
/// # Errors
/// Shapes that do not agree; a physically inconsistent payload.
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
    let independent = without.iter().chain(with).map(|m| m.independent_fraction);
    let independent_fraction = independent.fold(1.0, f64::min);
    let blocks = blocks_with_load(empty, without, with)?;
    blocks
        .iter()
        .map(|block| torque_scale_from(&block.along(p.as_slice()), independent_fraction))
        .collect()
}

/// Returns for each identified joint the system of its torques in the motions `without` and `with` a load at the last link: columns
/// of the arm, the joint's acceleration, and the ten parameters of the load. The rotor column is always included: the torque of a
/// known rotor inertia is not scaled.
pub(crate) fn blocks_with_load<const N: usize>(
    empty: &Fit<N>,
    without: &[Motion],
    with: &[Motion],
) -> Result<Vec<ReducedSystem>, IdentError> {
    let arm_columns = empty.columns.len();
    let identified_joints = empty.columns.identified_joints();
    let mut blocks = vec![ReducedSystem::empty(arm_columns + 11); identified_joints.len()];
    for (motions, carries) in [(without, false), (with, true)] {
        for motion in motions {
            let arm = joint_rows(empty.nominal(), &empty.columns, motion)?;
            let hand = payload_rows(empty, motion)?;
            for (row, &joint) in identified_joints.iter().enumerate() {
                let a = arm[row].a.clone();
                let mut a = a.resize_horizontally(arm_columns + 11, 0.0);
                a.set_column(arm_columns, &motion.qdd.column(joint));
                if carries {
                    a.columns_mut(arm_columns + 1, 10).copy_from(&hand[row].a);
                }
                let tau = motion.tau.column(joint).into_owned();
                let mut rows = JointRows::new(a, tau, arm[row].speed.clone());
                rows.used.clone_from(&arm[row].used);
                blocks[row].add(&rows.reduced(0.0, None), 1.0);
            }
        }
    }
    Ok(blocks)
}

/// Returns the reciprocal of the last unknown; `None` if the data do not determine it.
fn torque_scale_from(
    block: &ReducedSystem,
    independent_fraction: f64,
) -> Result<Option<f64>, IdentError> {
    let base = BaseParameters::from_regressor(&block.a(), RANK_TOLERANCE)?;
    let Ok(index) = base.independent.binary_search(&(block.unknowns() - 1)) else {
        return Ok(None);
    };
    let x = nearest(block, &DVector::zeros(block.unknowns()))?;
    let found = x[block.unknowns() - 1];
    let freedom = block.rows().saturating_sub(base.rank()) as f64 * independent_fraction;
    let noise = (block.error_squared(&x) / freedom.max(1.0)).sqrt();
    let deviation = base.standard_deviations(noise)[index];
    Ok((found > 0.0 && deviation <= MAX_RELATIVE_SCALE_STD * found).then(|| 1.0 / found))
}

/// Returns for each identified joint the rows of the payload's ten parameters and the residual of the arm without payload.
fn payload_rows<const N: usize>(
    empty: &Fit<N>,
    motion: &Motion,
) -> Result<Vec<JointRows>, IdentError> {
    let mut joints = joint_rows(empty.nominal(), &empty.columns, motion)?;
    let identified_joints = empty.columns.identified_joints();
    for joint in &mut joints {
        joint.b -= &joint.a * &empty.x;
        joint.a = DMatrix::zeros(motion.samples(), 10);
        joint.motor_load = None;
    }
    for i in 0..motion.samples() {
        let at = |m: &DMatrix<f64>| Vector::<N>::from_fn(|j, _| m[(i, j)]);
        let with_held_at_rest = |m: &DMatrix<f64>| {
            Vector::<N>::from_fn(|j, _| {
                if identified_joints.contains(&j) {
                    m[(i, j)]
                } else {
                    0.0
                }
            })
        };
        let (q, qd, qdd) = (
            at(&motion.q),
            with_held_at_rest(&motion.qd),
            with_held_at_rest(&motion.qdd),
        );
        let rows = regressor(empty.nominal(), &q, &qd, &qdd);
        for (joint, row) in identified_joints.iter().zip(&mut joints) {
            for (k, value) in rows[*joint][N - 1].iter().enumerate() {
                row.a[(i, k)] = *value;
            }
        }
    }
    Ok(joints)
}
