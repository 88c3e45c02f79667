//! Rows of the effects of [`crate::effects`], and the learned terms that follow from their values.

use crate::columns::{Column, Columns};
use crate::effects::Effects;
use supple_core::dynamics::{Terms, gravity, terms};
use supple_core::learned::{JointMap, LearnedBounds, LearnedTerms, MAP_KNOTS};
use supple_core::learned_torque::tilt_torque_nm;
use supple_core::math::Vector3;
use supple_core::{Arm, Config, Friction, Matrix, Vector};

/// Unit of the compliance columns \[rad/(N m)\].
pub(crate) const COMPLIANCE_UNIT: f64 = 1e-3;
/// Step of the difference quotient of gravity \[rad\].
const STEP_RAD: f64 = 1e-5;

/// Derivatives of the gravity torque at one state, from which the effect columns are computed.
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

    /// Returns the torque of each joint per unit of `column`; `None` for a column that is not an effect.
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

/// Returns the learned terms of identified springs, tilt and torque scales.
pub(crate) fn learned<const N: usize>(
    columns: &Columns,
    value: &dyn Fn(Column) -> f64,
    config: &Config<N>,
) -> LearnedTerms<N> {
    let bounds = LearnedBounds::new(&config.friction, &config.limits.joint_torque_nm);
    let mut terms = LearnedTerms::zero();
    for &joint in columns.identified_joints() {
        let bound_nm = bounds.map_nm[joint];
        let spring = spring_map(config, joint, value(Column::Spring(joint)));
        terms.map[joint] = JointMap {
            torque_nm: spring.map(|nm| nm.clamp(-bound_nm, bound_nm)),
            ..JointMap::ZERO
        };
    }
    for &joint in columns.identified_joints() {
        let bound = bounds.parameters.torque_scale[joint];
        terms.parameters.torque_scale[joint] =
            value(Column::TorqueScale(joint)).clamp(-bound, bound);
    }
    for axis in 0..2 {
        let bound_rad = bounds.parameters.tilt_rad[axis];
        terms.parameters.tilt_rad[axis] = value(Column::Tilt(axis)).clamp(-bound_rad, bound_rad);
    }
    terms
}
