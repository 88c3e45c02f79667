//! An estimate of the rotor inertia of each joint, reflected to it.
//!
//! The estimate is `J = 15 ms * torque / speed`: the joint's greatest torque accelerates the rotor alone to the joint's
//! greatest speed in 15 ms. The 15 ms are an assumption without a source; the built-in WAM's joints need 2 to 5 ms, and
//! stronger gears make it longer. The estimate is at most half of the arm's greatest inertia, because limits in a URDF may
//! be anything, and at least a hundredth of the largest inertia at the joint. Without a limit of torque (10 kN m or
//! more) it is a tenth of that inertia.

use super::derived::rounded;
use super::write::Writer;
use crate::poses::pose_rad;
use supple_core::dynamics::crba;
use supple_core::{Config, Vector};

/// Time in which the motor accelerates its own rotor to the largest speed \[s\].
const ROTOR_S: f64 = 0.015;
/// Largest estimate as a share of the arm's largest inertia.
const MAX_SHARE: f64 = 0.5;
/// Smallest estimate as a share of the joint's own largest inertia.
const MIN_SHARE: f64 = 0.01;
/// Number of poses over which inertias are compared.
pub(super) const POSES: u32 = 64;
/// Torque limits from here on are no limits of a motor \[N m\].
const NO_LIMIT_NM: f64 = 1e4;

/// Adds the estimates.
pub(super) fn add<const N: usize>(writer: &mut Writer, config: &Config<N>) {
    let inertia_kg_m2 = max_inertia_kg_m2(config);
    for joint in 0..N {
        let torque_nm = config.limits.joint_torque_nm[joint];
        let speed = config.limits.joint_speed_rad_per_s[joint];
        let max = MAX_SHARE * inertia_kg_m2.max();
        let estimate = match torque_nm < NO_LIMIT_NM {
            true => ROTOR_S * torque_nm / speed,
            false => 0.1 * inertia_kg_m2[joint],
        };
        let estimate = estimate.min(max).max(MIN_SHARE * inertia_kg_m2[joint]);
        let why = "an estimate from the limits of torque and speed, not a datum: identify it";
        if writer.joint(joint, "armature_kg_m2", rounded(estimate), why) {
            writer.joint(joint, "armature_is_estimate", true, "see above");
        }
    }
}

/// Returns the greatest diagonal entries of the mass matrix over the joint ranges \[kg m^2\].
pub(super) fn max_inertia_kg_m2<const N: usize>(config: &Config<N>) -> Vector<N> {
    let mut max = Vector::<N>::zeros();
    for pose in 0..POSES {
        let mass = crba(&config.arm, &pose_rad(config, pose));
        max = Vector::from_fn(|i, _| max[i].max(mass[(i, i)]));
    }
    max
}
