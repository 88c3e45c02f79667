//! Columns of what a real arm has besides its links and the friction of its joints.
//!
//! ```text
//! tau += k_j (q_j)                                  spring over joint j: hoses and wires
//!      + c_m r_m^T p(r_m qd / delta)                dry friction of motor m, r_m its row of j2mp over its largest entry
//!      + b_m r_m^T r_m qd                           viscous friction of motor m
//!      - C_j (dG / dq_j) G_j                        compliance C_j between the encoder of joint j and its link
//!      + t_x dG / dt_x + t_y dG / dt_y              gravity turned by a small rotation t: the base is tilted
//! ```
//!
//! Friction at the motors is that of the joints unless a motor drives several: only these have columns. `G` is that of the
//! nominal arm; an error of some per cent of it is one of some per cent in the small effect.

use crate::columns::{Column, Columns};
use nalgebra::DMatrix;
use supple_core::dynamics::{Terms, gravity, terms};
use supple_core::learned::{JointMap, LearnedBounds, LearnedTerms, MAP_KNOTS};
use supple_core::learned_torque::tilt_torque_nm;
use supple_core::math::Vector3;
use supple_core::{Arm, Config, Friction, Matrix, Vector};

/// Unit of the compliance columns \[rad/(N m)\].
pub(crate) const COMPLIANCE_UNIT: f64 = 1e-3;
/// Step of the difference quotient of gravity \[rad\].
const STEP_RAD: f64 = 1e-5;

/// Which of the effects are identified.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Effects {
    /// Springs over the joints.
    pub springs: bool,
    /// Tilt of the base.
    pub tilt: bool,
    /// Compliance of the joints.
    pub compliance: bool,
    /// `j2mp`, (motors, joints): friction of the motors that drive several joints.
    pub motor_from_joint: Option<DMatrix<f64>>,
}

impl Effects {
    /// All of them, for an arm with this `j2mp`.
    pub fn all<const N: usize>(motor_from_joint: &Matrix<N, N>) -> Effects {
        Effects {
            springs: true,
            tilt: true,
            compliance: true,
            motor_from_joint: Some(DMatrix::from_fn(N, N, |m, j| motor_from_joint[(m, j)])),
        }
    }

    /// The columns of these effects for the moving joints.
    pub(crate) fn columns(&self, moving: &[usize]) -> Vec<Column> {
        let mut columns = Vec::new();
        for &joint in moving {
            columns.extend(self.springs.then_some(Column::Spring(joint)));
            columns.extend(self.compliance.then_some(Column::Compliance(joint)));
        }
        columns.extend(
            self.motors(moving)
                .iter()
                .flat_map(|motor| [Column::MotorCoulomb(*motor), Column::MotorViscous(*motor)]),
        );
        if self.tilt {
            columns.extend([Column::Tilt(0), Column::Tilt(1)]);
        }
        columns
    }

    /// Motors that drive several moving joints.
    fn motors(&self, moving: &[usize]) -> Vec<usize> {
        let motors = self.motor_from_joint.as_ref().map_or(0, DMatrix::nrows);
        let drives = |motor: usize| {
            let row = self.row(motor);
            moving.iter().filter(|joint| row[**joint] != 0.0).count()
        };
        (0..motors).filter(|motor| drives(*motor) > 1).collect()
    }

    /// `r_m`.
    pub(crate) fn row(&self, motor: usize) -> Vec<f64> {
        let Some(matrix) = &self.motor_from_joint else {
            return Vec::new();
        };
        let row = matrix.row(motor);
        let greatest = row.amax();
        row.iter().map(|x| x / greatest).collect()
    }
}

/// What the columns of one state need.
pub(crate) struct EffectState<const N: usize> {
    tilt: [Vector<N>; 2],
    compliance: Matrix<N, N>,
}

impl<const N: usize> EffectState<N> {
    pub fn new(arm: &Arm<N>, effects: &Effects, q: &Vector<N>) -> EffectState<N> {
        let mut state = EffectState {
            tilt: [Vector::zeros(); 2],
            compliance: Matrix::zeros(),
        };
        if effects.tilt {
            let mut at = Terms::default();
            terms(arm, q, &Vector::zeros(), &mut at);
            state.tilt = core::array::from_fn(|axis| {
                let mut unit = Vector3::zeros();
                unit[axis] = 1.0;
                tilt_torque_nm(&at, &arm.gravity(), &unit)
            });
        }
        if effects.compliance {
            let torque = gravity(arm, q);
            for joint in 0..N {
                let mut moved = *q;
                moved[joint] += STEP_RAD;
                let slope = (gravity(arm, &moved) - torque) / STEP_RAD;
                let column = slope * (-torque[joint] * COMPLIANCE_UNIT);
                state.compliance.set_column(joint, &column);
            }
        }
        state
    }

    /// Torque of each joint by a unit of `column`; `None` for a column of another kind.
    pub fn torque_nm(
        &self,
        columns: &Columns,
        column: Column,
        q: &Vector<N>,
        qd: &Vector<N>,
    ) -> Option<Vector<N>> {
        let effects = columns.effects();
        let motor = |motor: usize, law: &dyn Fn(f64) -> f64| {
            let row = effects.row(motor);
            let speed = (0..N).map(|j| row[j] * qd[j]).sum();
            let torque = law(speed);
            Vector::from_fn(|j, _| row[j] * torque)
        };
        let dry = Friction {
            band_rad_per_s: columns.friction().band_rad_per_s,
            ..Friction::coulomb(0.0, 1.0)
        };
        match column {
            Column::Spring(joint) => {
                let mut torque = Vector::zeros();
                torque[joint] = q[joint];
                Some(torque)
            }
            Column::Compliance(joint) => Some(self.compliance.column(joint).into_owned()),
            Column::MotorCoulomb(m) => Some(motor(m, &|speed| dry.dry_torque_nm(speed))),
            Column::MotorViscous(m) => Some(motor(m, &|speed| speed)),
            Column::Tilt(axis) => Some(self.tilt[axis]),
            _ => None,
        }
    }
}

/// Coefficients of a map whose torque is `slope` times the angle of joint `joint`.
pub(crate) fn spring_map<const N: usize>(
    config: &Config<N>,
    joint: usize,
    slope: f64,
) -> [f64; MAP_KNOTS] {
    let limits = &config.limits;
    let (lower, upper) = (
        limits.position_lower_rad[joint],
        limits.position_upper_rad[joint],
    );
    // A spline of second degree whose coefficients are these has the value `slope q` (Greville abscissae).
    let interval = (upper - lower) / (MAP_KNOTS - 2) as f64;
    core::array::from_fn(|k| slope * (lower + interval * (k as f64 - 0.5)))
}

/// The learned terms of identified springs and tilt.
pub(crate) fn learned<const N: usize>(
    columns: &Columns,
    value: &dyn Fn(Column) -> f64,
    config: &Config<N>,
) -> LearnedTerms<N> {
    let bounds = LearnedBounds::new(&config.friction, &config.limits.joint_torque_nm);
    let mut terms = LearnedTerms::zero();
    for &joint in columns.moving() {
        let bound_nm = bounds.map_nm[joint];
        let spring = spring_map(config, joint, value(Column::Spring(joint)));
        terms.map[joint] = JointMap {
            torque_nm: spring.map(|nm| nm.clamp(-bound_nm, bound_nm)),
            ..JointMap::ZERO
        };
    }
    for axis in 0..2 {
        let bound_rad = bounds.parameters.tilt_rad[axis];
        terms.parameters.tilt_rad[axis] = value(Column::Tilt(axis)).clamp(-bound_rad, bound_rad);
    }
    terms
}
