//! Feed-forward torques of a controller along a motion: links and friction, compliance and learned terms.
//!
//! They differ from the prediction of a fit, which has terms that a controller does not have, such as viscous friction that
//! differs by direction.

use crate::motion::Motion;
use nalgebra::DMatrix;
use supple_core::dynamics::{Terms, terms};
use supple_core::learned::LearnedBounds;
use supple_core::learned_torque::{LearnedAtPose, learned_torque_nm};
use supple_core::math::Vector3;
use supple_core::{Config, Vector};

/// Returns the feed-forward of a controller with this configuration along a motion, (samples, N) \[N m\].
pub fn feedforward_nm<const N: usize>(config: &Config<N>, motion: &Motion) -> DMatrix<f64> {
    each_sample(config, motion, |_, whole| whole)
}

/// Returns the torques that compliance and learned terms add to those of rigid-body dynamics and friction along a motion, (samples, N)
/// \[N m\].
pub(crate) fn effects_nm<const N: usize>(config: &Config<N>, motion: &Motion) -> DMatrix<f64> {
    each_sample(config, motion, |plain, whole| whole - plain)
}

/// Returns `of(plain, whole)` for each sample: `plain` is the torque of rigid-body dynamics and friction at the encoders' angles, `whole` the
/// total feed-forward.
fn each_sample<const N: usize>(
    config: &Config<N>,
    motion: &Motion,
    of: impl Fn(Vector<N>, Vector<N>) -> Vector<N>,
) -> DMatrix<f64> {
    let bounds = LearnedBounds::new(&config.friction, &config.limits.joint_torque_nm);
    let mut torque_nm = DMatrix::zeros(motion.samples(), N);
    let mut at_pose = Terms::default();
    for sample in 0..motion.samples() {
        let at = |m: &DMatrix<f64>| Vector::<N>::from_fn(|j, _| m[(sample, j)]);
        let (encoder, qd, qdd) = (at(&motion.q), at(&motion.qd), at(&motion.qdd));
        let inverse_dynamics = |terms: &Terms<N>| {
            let friction = |j: usize, _| {
                let loaded = config.friction[j].at_load(terms.gravity[j]);
                loaded.torque_nm(qd[j])
            };
            terms.mass_matrix * qdd + terms.coriolis_gravity + Vector::from_fn(friction)
        };
        terms(&config.arm, &encoder, &qd, &mut at_pose);
        let plain = inverse_dynamics(&at_pose);
        let q = encoder - config.compliance_rad_per_nm.component_mul(&at_pose.gravity);
        terms(&config.arm, &q, &qd, &mut at_pose);
        let model = inverse_dynamics(&at_pose);
        let learned = LearnedAtPose::new(
            &config.learned,
            &config.friction,
            &config.limits,
            &config.arm.gravity(),
            &q,
            &at_pose,
            // Without acceleration of the tip: a learned payload counts with its weight, not with its inertia.
            &Vector3::zeros(),
        );
        // All of the dry friction, in the direction of the velocity.
        let (dry_direction, dry_share) = (None, Vector::repeat(1.0));
        let unscaled_nm = learned.torque_nm(
            &config.learned,
            &config.friction,
            &qd,
            dry_direction,
            &dry_share,
        );
        // With the learned torque scales, and within the bounds.
        let whole = model + learned_torque_nm(&config.learned, &bounds, &model, &unscaled_nm);
        let row = of(plain, whole);
        for joint in 0..N {
            torque_nm[(sample, joint)] = row[joint];
        }
    }
    torque_nm
}
