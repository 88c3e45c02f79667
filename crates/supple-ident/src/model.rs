//! Conversion between parameter vectors and an arm with its friction.

use crate::columns::{Column, Columns};
use crate::error::IdentError;
use nalgebra::{DMatrix, DVector, SVector};
use supple_core::arm::Link;
use supple_core::dynamics::{parameters, regressor, regressor_times};
use supple_core::friction::MAX_LOAD_COEFFICIENT;
use supple_core::math::{Matrix3, Vector3};
use supple_core::{Arm, Friction, Vector};

/// Parameters of `arm` in the order of `columns`; friction is zero.
pub fn prior<const N: usize>(arm: &Arm<N>, columns: &Columns) -> DVector<f64> {
    let links = parameters(arm);
    let value = |column: &Column| match *column {
        Column::Link { link, entry } => links[link][entry],
        Column::Rotor(joint) => arm.armature()[joint],
        _ => 0.0,
    };
    DVector::from_iterator(columns.len(), columns.list().iter().map(value))
}

/// Returns the ten parameters of each link from `x`.
pub fn link_parameters<const N: usize>(x: &DVector<f64>) -> [SVector<f64, 10>; N] {
    std::array::from_fn(|k| x.fixed_rows::<10>(10 * k).into_owned())
}

/// Returns `nominal` with the inertial parameters of `x`; joints without a rotor column keep their rotor inertia.
///
/// # Errors
/// [`IdentError::NotPhysical`] if a link is physically inconsistent or a rotor inertia is negative.
pub fn arm<const N: usize>(
    nominal: &Arm<N>,
    columns: &Columns,
    x: &DVector<f64>,
) -> Result<Arm<N>, IdentError> {
    let found = link_parameters::<N>(x);
    let links: [Link; N] = std::array::from_fn(|k| {
        let rotation = nominal.link_from_joint(k);
        let [m, hx, hy, hz, xx, xy, yy, xz, yz, zz] = found[k].data.0[0];
        let inertia = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        let inertia = rotation.tr_mul(&(inertia * rotation));
        Link {
            mass: m,
            first_moment: rotation.tr_mul(&Vector3::new(hx, hy, hz)),
            inertia: (inertia + inertia.transpose()) * 0.5,
            ..nominal.links()[k]
        }
    });
    let rotors = Vector::<N>::from_fn(|j, _| rotor(nominal, columns, x, j));
    Arm::from_links(links, rotors, nominal.joint_from_tip(), nominal.gravity())
        .map_err(IdentError::NotPhysical)
}

/// Returns the friction of each joint of the arm in the controller's friction law. Effects that this law does not model
/// (couplings) are left out; load-dependent friction refers to the load `load_nm` of each identified joint. Held
/// joints have no friction.
pub fn friction(columns: &Columns, x: &DVector<f64>, load_nm: &[f64]) -> Vec<Friction> {
    let value = |column: Column| columns.position(column).map_or(0.0, |i| x[i]);
    let of_joint = |j: usize| {
        let (motor_coulomb_nm, motor_viscous) = motor_friction(columns, x, j);
        let load_coefficient = value(Column::Load(j)).min(MAX_LOAD_COEFFICIENT);
        let coulomb_at_nm = match columns.identified_joints().binary_search(&j) {
            Ok(row) if load_coefficient > 0.0 => load_nm[row],
            _ => 0.0,
        };
        let coulomb_nm =
            value(Column::Coulomb(j)) + load_coefficient * coulomb_at_nm + motor_coulomb_nm;
        let viscous_nm_s_per_rad = value(Column::Viscous(j)) + motor_viscous;
        // The constraint of a consistent fit holds up to rounding; plain least squares and draws may break it.
        let asymmetry_limit = viscous_nm_s_per_rad.max(0.0);
        let shape = columns.friction();
        Friction {
            viscous_nm_s_per_rad,
            viscous_asymmetry_nm_s_per_rad: value(Column::Asymmetry(j))
                .clamp(-asymmetry_limit, asymmetry_limit),
            coulomb_nm,
            breakaway_nm: coulomb_nm + value(Column::Stribeck(j)),
            stribeck_rad_per_s: shape
                .stribeck_rad_per_s
                .unwrap_or(Friction::NONE.stribeck_rad_per_s),
            offset_nm: value(Column::Offset(j)),
            stribeck_offset_nm: value(Column::StribeckOffset(j)),
            band_rad_per_s: shape.band_rad_per_s,
            presliding_rad: 0.0,
            load_coefficient,
            load_torque: shape.load.unwrap_or_default(),
            coulomb_at_nm,
        }
    };
    (0..columns.dof()).map(of_joint).collect()
}

/// Returns Coulomb and viscous friction of the motors at a joint while it moves alone.
fn motor_friction(columns: &Columns, x: &DVector<f64>, joint: usize) -> (f64, f64) {
    let mut sums = (0.0, 0.0);
    for (column, value) in columns.list().iter().zip(x) {
        match *column {
            Column::MotorCoulomb(m) => sums.0 += columns.effects().row(m)[joint].abs() * value,
            Column::MotorViscous(m) => sums.1 += columns.effects().row(m)[joint].powi(2) * value,
            _ => {}
        }
    }
    sums
}

/// Returns the mass matrix of the parameters `x` at `q`, even if they are physically inconsistent \[kg m^2\].
pub fn mass_matrix<const N: usize>(
    nominal: &Arm<N>,
    columns: &Columns,
    x: &DVector<f64>,
    q: &Vector<N>,
) -> Result<DMatrix<f64>, IdentError> {
    let weightless = Arm::from_links(
        *nominal.links(),
        nominal.armature(),
        nominal.joint_from_tip(),
        Vector3::zeros(),
    )
    .map_err(IdentError::NotPhysical)?;
    let found = link_parameters::<N>(x);
    let mut mass = DMatrix::zeros(N, N);
    for j in 0..N {
        let mut unit = Vector::<N>::zeros();
        unit[j] = 1.0;
        let link_regressor = regressor(&weightless, q, &Vector::zeros(), &unit);
        let torque = regressor_times(&link_regressor, &found);
        (0..N).for_each(|i| mass[(i, j)] = torque[i]);
        mass[(j, j)] += rotor(nominal, columns, x, j);
    }
    for column in columns.list() {
        if let Column::CoupledRotor(a, b) = *column {
            let inertia = columns.position(*column).map_or(0.0, |i| x[i]);
            for (i, j) in [(a, a), (a, b), (b, a), (b, b)] {
                mass[(i, j)] += inertia;
            }
        }
    }
    Ok(mass)
}

fn rotor<const N: usize>(
    nominal: &Arm<N>,
    columns: &Columns,
    x: &DVector<f64>,
    joint: usize,
) -> f64 {
    let column = columns.position(Column::Rotor(joint));
    column.map_or(nominal.armature()[joint], |i| x[i])
}

#[cfg(test)]
mod tests {
    use super::friction;
    use crate::columns::{Column, Columns, FrictionColumns};
    use nalgebra::DVector;

    /// Draws from the uncertainty of a fit contain such values: the friction is then invalid, which the draw notices.
    #[test]
    fn friction_of_negative_viscous_friction_is_invalid() {
        let shape = FrictionColumns {
            asymmetry: true,
            ..FrictionColumns::COULOMB_AND_OFFSET
        };
        let columns = Columns::new(1, &[0], true, shape, &[]).unwrap();
        let mut x = DVector::zeros(columns.len());
        for (column, value) in [
            (Column::Coulomb(0), 0.5),
            (Column::Viscous(0), -0.1),
            (Column::Asymmetry(0), 0.02),
        ] {
            x[columns.position(column).unwrap()] = value;
        }
        let drawn = friction(&columns, &x, &[0.0])[0];
        assert_eq!(drawn.viscous_nm_s_per_rad, -0.1);
        assert!(drawn.validate().is_err(), "{drawn:?}");
    }
}
