//! Torques of the learned terms, see [`crate::learned`].
//!
//! A payload at the tip, of mass `m` and first moment `h` (base axes), needs the force `m (a - g)` on the tip and the moment
//! `h x (a - g)` for the acceleration `a` of the tip and gravity `g`; the torque for its angular acceleration is neglected.
//! Gravity rotated by the small rotation vector `t` is `g + t x g`.

use crate::config::Limits;
use crate::dynamics::Terms;
use crate::math::{Vector, Vector3};
use crate::model::friction::Friction;
use crate::model::learned::{LearnedBounds, LearnedTerms, MapWeights};

/// Returns the torque that a payload needs \[N m\].
///
/// `force_n_per_kg` is `a - g` in base axes \[m/s^2\]; mass \[kg\] and first moment \[kg m\] in the tip frame.
pub fn payload_torque_nm<const N: usize>(
    terms: &Terms<N>,
    force_n_per_kg: &Vector3<f64>,
    payload_kg: f64,
    payload_moment_kg_m: &Vector3<f64>,
) -> Vector<N> {
    let force = force_n_per_kg * payload_kg;
    let moment = (terms.base_from_tip.rotation * payload_moment_kg_m).cross(force_n_per_kg);
    terms.jacobian.fixed_rows::<3>(0).tr_mul(&force)
        + terms.jacobian.fixed_rows::<3>(3).tr_mul(&moment)
}

/// Returns the change of the gravity torque if gravity `gravity_m_per_s2` turns by `tilt_rad`, small \[N m\].
pub fn tilt_torque_nm<const N: usize>(
    terms: &Terms<N>,
    gravity_m_per_s2: &Vector3<f64>,
    tilt_rad: &Vector3<f64>,
) -> Vector<N> {
    terms
        .gravity_gradient
        .tr_mul(&tilt_rad.cross(gravity_m_per_s2))
}

/// The learned terms evaluated at one pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LearnedAtPose<const N: usize> {
    /// Torque that does not depend on the velocity \[N m\].
    static_nm: Vector<N>,
    /// Change of the dry friction \[N m\].
    dry_nm: Vector<N>,
}

impl<const N: usize> LearnedAtPose<N> {
    /// Evaluates `learned` at the pose `q` \[rad\] of `terms`, for a tip with the acceleration `acceleration_m_per_s2`.
    pub fn new(
        learned: &LearnedTerms<N>,
        friction: &[Friction; N],
        limits: &Limits<N>,
        gravity_m_per_s2: &Vector3<f64>,
        q: &Vector<N>,
        terms: &Terms<N>,
        acceleration_m_per_s2: &Vector3<f64>,
    ) -> Self {
        let parameters = &learned.parameters;
        let force = acceleration_m_per_s2 - gravity_m_per_s2;
        let mut static_nm = parameters.offset_nm
            + payload_torque_nm(
                terms,
                &force,
                parameters.payload_kg,
                &parameters.payload_moment_kg_m,
            )
            + tilt_torque_nm(terms, gravity_m_per_s2, &parameters.tilt_rad);
        let mut dry_nm = parameters.coulomb_nm;
        for (i, friction) in friction.iter().enumerate() {
            let (lower, upper) = (limits.position_lower_rad[i], limits.position_upper_rad[i]);
            let weights = MapWeights::new(q[i], lower, upper);
            static_nm[i] += weights.of(&learned.map[i].torque_nm);
            dry_nm[i] += weights.of(&learned.map[i].dry_nm);
            // A larger reduction would make the total dry friction negative.
            dry_nm[i] = dry_nm[i].max(-friction.coulomb_nm);
        }
        LearnedAtPose { static_nm, dry_nm }
    }

    /// Torque at joint velocities `velocity_rad_per_s`, with a fraction `dry_share` of each joint's dry friction \[N m\] in the
    /// direction of the velocity, or in a given `dry_direction`.
    pub fn torque_nm(
        &self,
        learned: &LearnedTerms<N>,
        friction: &[Friction; N],
        velocity_rad_per_s: &Vector<N>,
        dry_direction: Option<&Vector<N>>,
        dry_share: &Vector<N>,
    ) -> Vector<N> {
        let viscous = &learned.parameters.viscous_nm_s_per_rad;
        Vector::from_fn(|i, _| {
            let v = velocity_rad_per_s[i];
            let direction = dry_direction.map_or_else(|| friction[i].direction(v), |of| of[i]);
            self.static_nm[i] + viscous[i] * v + self.dry_nm[i] * direction * dry_share[i]
        })
    }
}

/// Returns the total learned torque of each joint, within its bound \[N m\]: `change_nm`, plus the torque by which the drives
/// fall short of `model_nm + change_nm`.
pub fn learned_torque_nm<const N: usize>(
    learned: &LearnedTerms<N>,
    bounds: &LearnedBounds<N>,
    model_nm: &Vector<N>,
    change_nm: &Vector<N>,
) -> Vector<N> {
    let scale = &learned.parameters.torque_scale;
    Vector::from_fn(|i, _| {
        let whole = change_nm[i] + scale[i] * (model_nm[i] + change_nm[i]);
        // A NaN stays NaN and causes a fault later.
        whole.clamp(-bounds.torque_nm[i], bounds.torque_nm[i])
    })
}
