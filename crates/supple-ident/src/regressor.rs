//! Rows of the regressor: the contribution of each column to each identified joint's torque.

use crate::columns::{Column, Columns};
use crate::effect_rows::EffectState;
use crate::error::{IdentError, shape_error};
use crate::filter::LowPass;
pub use crate::joint_rows::JointRows;
use crate::joint_rows::MotorLoad;
use crate::motion::Motion;
use nalgebra::DMatrix;
use supple_core::dynamics::{parameters, regressor, regressor_times};
use supple_core::friction::LoadTorque;
use supple_core::math::exp;
use supple_core::{Arm, Friction, Vector};

/// Periods of the filter's cutoff frequency over which a step of the dry friction settles.
const FILTER_REACH: f64 = 1.5;

/// Returns the regressor of one state, (identified joints, columns). Other joints count as held at rest, independent of `qd` and
/// `qdd`. The motor torques are assumed to be those that the links of `arm` need.
pub fn rows<const N: usize>(
    arm: &Arm<N>,
    columns: &Columns,
    q: &Vector<N>,
    qd: &Vector<N>,
    qdd: &Vector<N>,
) -> DMatrix<f64> {
    rows_under_load(arm, columns, [q, qd, qdd], None)
}

/// [`rows`] at `[q, qd, qdd]` while the motors transmit `motor_nm`.
pub(crate) fn rows_under_load<const N: usize>(
    arm: &Arm<N>,
    columns: &Columns,
    [q, qd, qdd]: [&Vector<N>; 3],
    motor_nm: Option<&Vector<N>>,
) -> DMatrix<f64> {
    let with_held_at_rest = |v: &Vector<N>| {
        Vector::<N>::from_fn(|j, _| {
            if columns.identified_joints().contains(&j) {
                v[j]
            } else {
                0.0
            }
        })
    };
    let (qd, qdd) = (with_held_at_rest(qd), with_held_at_rest(qdd));
    let link_regressor = regressor(arm, q, &qd, &qdd);
    let friction = columns.friction();
    let uses_links = columns.effects().torque_scale || friction.load.is_some();
    let links = uses_links.then(|| regressor_times(&link_regressor, &parameters(arm)));
    let load = match (friction.load, motor_nm) {
        (Some(LoadTorque::Motor), Some(motor_nm)) => Some(*motor_nm),
        _ => links,
    };
    let dry = unit_dry_friction(columns);
    let effects = EffectState::new(arm, columns.effects(), q);
    let identified_joints = columns.identified_joints();
    let mut rows = DMatrix::zeros(identified_joints.len(), columns.len());
    for (c, column) in columns.list().iter().enumerate() {
        let mut put = |joint: usize, value: f64| {
            if let Ok(row) = identified_joints.binary_search(&joint) {
                rows[(row, c)] = value;
            }
        };
        match *column {
            Column::Link { link, entry } => {
                for &joint in identified_joints {
                    put(joint, link_regressor[joint][link][entry]);
                }
            }
            Column::Rotor(j) => put(j, qdd[j]),
            Column::Viscous(j) => put(j, qd[j]),
            Column::Coulomb(j) => put(j, dry.dry_torque_nm(qd[j])),
            Column::Offset(j) => put(j, 1.0),
            Column::TorqueScale(j) => put(
                j,
                links.map_or(0.0, |links| links[j]) + arm.armature()[j] * qdd[j],
            ),
            Column::Asymmetry(j) => put(j, qd[j].abs()),
            Column::Stribeck(j) => {
                let s = qd[j] / friction.stribeck_rad_per_s.unwrap_or(f64::INFINITY);
                put(j, exp(-s * s) * dry.dry_torque_nm(qd[j]));
            }
            Column::StribeckOffset(j) => {
                let s = qd[j] / friction.stribeck_rad_per_s.unwrap_or(f64::INFINITY);
                put(j, exp(-s * s));
            }
            Column::Load(j) => {
                let load_nm = load.map_or(0.0, |load| load[j].abs());
                put(j, load_nm * dry.dry_torque_nm(qd[j]));
            }
            Column::CoupledRotor(a, b) => [a, b].iter().for_each(|j| put(*j, qdd[a] + qdd[b])),
            Column::CoupledViscous(a, b) => [a, b].iter().for_each(|j| put(*j, qd[a] + qd[b])),
            Column::CoupledCoulomb(a, b) => {
                let torque = dry.dry_torque_nm(qd[a] + qd[b]);
                [a, b].iter().for_each(|j| put(*j, torque));
            }
            Column::Spring(_)
            | Column::Compliance(_)
            | Column::MotorCoulomb(_)
            | Column::MotorViscous(_)
            | Column::Tilt(_) => {
                if let Some(torque) = effects.torque_nm(columns, *column, q, &qd) {
                    identified_joints.iter().for_each(|j| put(*j, torque[*j]));
                }
            }
        }
    }
    rows
}

/// Returns the dry friction of 1 N m in the band of the columns.
fn unit_dry_friction(columns: &Columns) -> Friction {
    Friction {
        band_rad_per_s: columns.friction().band_rad_per_s,
        ..Friction::coulomb(0.0, 1.0)
    }
}

/// Returns the travel of joint `j` since its last reversal, for each sample.
fn travel_since_reversal(motion: &Motion, j: usize) -> Vec<f64> {
    let (mut travel, mut direction) = (0.0, 0.0_f64);
    let step_s = 1.0 / motion.rate_hz;
    let after = |v: &f64| {
        if v * direction < 0.0 {
            travel = 0.0;
        }
        direction = v.signum();
        travel += v.abs() * step_s;
        travel
    };
    motion.qd.column(j).iter().map(after).collect()
}

/// Returns for each sample of joint `j` whether a reversal before or after it is within the reach of the filter.
fn near_reversals(motion: &Motion, j: usize) -> Vec<bool> {
    let qd = motion.qd.column(j);
    let mut near = vec![false; qd.len()];
    let Some(cutoff_hz) = motion.cutoff_hz else {
        return near;
    };
    let reach = (FILTER_REACH * motion.rate_hz / cutoff_hz).ceil() as usize;
    let mut direction = 0.0_f64;
    for (i, v) in qd.iter().enumerate() {
        if v * direction < 0.0 {
            let end = i.saturating_add(reach).min(near.len());
            near[i.saturating_sub(reach)..end].fill(true);
        }
        if *v != 0.0 {
            direction = v.signum();
        }
    }
    near
}

/// Returns all rows of a motion, for each identified joint. Dry friction changes sign within a sample or two, faster than
/// the filter of the torques can follow, so its columns pass the same filter. Without a rotor column, the arm's
/// rotor inertia counts as known.
///
/// # Errors
/// [`IdentError::Shape`] if arm, columns and motion differ in their number of joints.
pub fn joint_rows<const N: usize>(
    arm: &Arm<N>,
    columns: &Columns,
    motion: &Motion,
) -> Result<Vec<JointRows>, IdentError> {
    for (argument, found) in [("columns", columns.dof()), ("motion", motion.q.ncols())] {
        if found != N {
            return Err(shape_error(
                argument,
                format!("{N} joints"),
                format!("{found}"),
            ));
        }
    }
    let (samples, identified_joints) = (motion.samples(), columns.identified_joints());
    let known_rotor = |j: usize| match columns.position(Column::Rotor(j)) {
        Some(_) => 0.0,
        None => arm.armature()[j],
    };
    let mut joints: Vec<JointRows> = identified_joints
        .iter()
        .map(|&j| {
            let rows = DMatrix::zeros(samples, columns.len());
            let torques = motion.tau.column(j) - motion.qdd.column(j) * known_rotor(j);
            let speed = motion.qd.column(j).iter().map(|v| v.abs()).collect();
            let mut rows = JointRows::new(rows, torques, speed);
            rows.travel_since_reversal_rad = travel_since_reversal(motion, j);
            rows.is_near_reversal = near_reversals(motion, j);
            if !motion.excluded_intervals.is_empty() {
                rows.used = (0..samples).map(|i| motion.used(i, j)).collect();
            }
            rows
        })
        .collect();
    for i in 0..samples {
        let at = |m: &DMatrix<f64>| Vector::<N>::from_fn(|j, _| m[(i, j)]);
        let state = [&at(&motion.q), &at(&motion.qd), &at(&motion.qdd)];
        let state = rows_under_load(arm, columns, state, Some(&at(&motion.tau)));
        for (row, joint) in joints.iter_mut().enumerate() {
            joint.a.row_mut(i).copy_from(&state.row(row));
        }
    }
    if columns.friction().load == Some(LoadTorque::Motor) {
        let dry = unit_dry_friction(columns);
        for (joint, &j) in joints.iter_mut().zip(identified_joints) {
            joint.motor_load = columns.position(Column::Load(j)).map(|column| MotorLoad {
                column,
                direction: (motion.qd.column(j).iter())
                    .map(|qd| dry.dry_torque_nm(*qd))
                    .collect(),
                rotor_nm: (motion.qdd.column(j) * known_rotor(j)).as_slice().to_vec(),
            });
        }
    }
    if let Some(cutoff_hz) = motion.cutoff_hz {
        let filter = LowPass::butterworth4(cutoff_hz, motion.rate_hz)?;
        for (c, _) in columns
            .list()
            .iter()
            .enumerate()
            .filter(|(_, c)| c.is_fast_at_reversal())
        {
            for joint in &mut joints {
                let smooth = filter.zero_phase(joint.a.column(c).clone_owned().as_slice())?;
                joint.a.column_mut(c).copy_from_slice(&smooth);
            }
        }
        for load in joints
            .iter_mut()
            .filter_map(|joint| joint.motor_load.as_mut())
        {
            load.direction = filter.zero_phase(&load.direction)?;
        }
    }
    Ok(joints)
}
