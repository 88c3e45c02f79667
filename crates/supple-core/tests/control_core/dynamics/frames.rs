//! Invariance: the same arm described in other frames, from another base, and with its tool as part
//! of the last link.

use super::identities::torque_scale;
use crate::common::cloud::turn;
use crate::common::numeric::size;
use crate::common::random::Case;
use crate::{for_arms_of_3_4_and_7_joints, prop_close};
use proptest::prelude::*;
use proptest::test_runner::TestCaseError;
use supple_core::dynamics::{
    aba, coriolis_matrix, crba, gravity, jacobian, jacobian_dot_qd, joint_poses, kinetic_energy,
    potential_energy, rnea, tip_pose,
};
use supple_core::math::Vector3;
use supple_core::{Arm, Pose, Vector};

type Outcome = Result<(), TestCaseError>;

for_arms_of_3_4_and_7_joints!(
    link_frames_are_free,
    base_frame_is_free,
    gravity_is_blind_to_turns_about_it,
    a_tool_is_a_heavier_last_link,
    an_inertia_symmetric_but_for_noise_is_made_so,
    accessors_tell_what_was_built,
);

/// Both arms need the same torques for the same motions.
fn same_dynamics<const N: usize>(case: &Case<N>, a: &Arm<N>, b: &Arm<N>) -> Outcome {
    let (q, qd, qdd) = (&case.q, &case.qd, &case.qdd);
    let scale = torque_scale(case, a);
    prop_close!(rnea(b, q, qd, qdd), rnea(a, q, qd, qdd), scale, 1e-12);
    prop_close!(crba(b, q), crba(a, q), size(&crba(a, q)), 1e-12);
    prop_close!(gravity(b, q), gravity(a, q), scale, 1e-12);
    let (ca, cb) = (coriolis_matrix(a, q, qd), coriolis_matrix(b, q, qd));
    prop_close!(cb, ca, scale, 1e-12);
    let (fa, fb) = (aba(a, q, qd, qdd), aba(b, q, qd, qdd));
    prop_close!(fb, fa, 1.0 + fa.norm(), 1e-9);
    let energy = |arm| Vector::<2>::new(kinetic_energy(arm, q, qd), potential_energy(arm, q));
    prop_close!(energy(b), energy(a), scale, 1e-12);
    Ok(())
}

fn same_tip<const N: usize>(case: &Case<N>, a: &Arm<N>, b: &Arm<N>) -> Outcome {
    let (q, qd) = (&case.q, &case.qd);
    prop_close!(tip_pose(b, q).rotation, tip_pose(a, q).rotation, 1.0, 1e-12);
    prop_close!(
        tip_pose(b, q).translation,
        tip_pose(a, q).translation,
        1.0,
        1e-12
    );
    prop_close!(jacobian(b, q), jacobian(a, q), 1.0, 1e-12);
    let scale = 1.0 + qd.norm_squared();
    prop_close!(
        jacobian_dot_qd(b, q, qd),
        jacobian_dot_qd(a, q, qd),
        scale,
        1e-12
    );
    Ok(())
}

/// Each link frame is rotated about its origin and shifted along its joint's axis.
fn link_frames_are_free<const N: usize>(case: &Case<N>) -> Outcome {
    let mut other = case.clone();
    let mut old_from_new = Pose::IDENTITY;
    for (i, joint) in other.joints.iter_mut().enumerate() {
        let parent = old_from_new;
        let rpy = [case.qdd[i], 0.3 * case.qdd[i], -1.7 * case.qdd[i]];
        old_from_new = Pose::from_xyz_rpy([0.0; 3], rpy);
        old_from_new.translation = joint.axis * (0.03 * case.qdd[i]);
        joint.parent_from_link = parent.inverse() * joint.parent_from_link * old_from_new;
        joint.axis = old_from_new.rotation.tr_mul(&joint.axis);
        joint.body = joint.body.expressed_in(&old_from_new.inverse());
    }
    other.last_link_from_tip = old_from_new.inverse() * case.last_link_from_tip;
    same_dynamics(case, &case.arm(), &other.arm())?;
    same_tip(case, &case.arm(), &other.arm())
}

/// The whole arm, and gravity with it, is rotated in the base frame.
fn base_frame_is_free<const N: usize>(case: &Case<N>) -> Outcome {
    let new_from_old = Pose::from_xyz_rpy([0.0; 3], [case.qdd[0], case.qdd[1], case.qdd[2]]);
    let mut other = case.clone();
    other.joints[0].parent_from_link = new_from_old * case.joints[0].parent_from_link;
    other.gravity = new_from_old.rotation * case.gravity;
    let (a, b) = (case.arm(), other.arm());
    same_dynamics(case, &a, &b)?;
    let expected = new_from_old * tip_pose(&a, &case.q);
    let found = tip_pose(&b, &case.q);
    prop_close!(found.rotation, expected.rotation, 1.0, 1e-12);
    prop_close!(found.translation, expected.translation, 1.0, 1e-12);
    Ok(())
}

/// Gravity torques do not depend on the rotation of the base about the vertical.
fn gravity_is_blind_to_turns_about_it<const N: usize>(case: &Case<N>) -> Outcome {
    let down = case.gravity.normalize();
    let mut other = case.clone();
    other.joints[0].parent_from_link = turn(&down, 1.234) * case.joints[0].parent_from_link;
    let (a, b) = (case.arm(), other.arm());
    prop_close!(
        gravity(&b, &case.q),
        gravity(&a, &case.q),
        torque_scale(case, &a),
        1e-12
    );
    same_dynamics(case, &a, &b)
}

fn a_tool_is_a_heavier_last_link<const N: usize>(case: &Case<N>) -> Outcome {
    let mut merged = case.clone();
    merged.tool = None;
    merged.joints[N - 1].body = case.carried()[N - 1].body();
    same_dynamics(case, &case.arm(), &merged.arm())?;
    same_tip(case, &case.arm(), &merged.arm())
}

/// An inertia with the largest accepted asymmetry: all functions still describe the same arm.
fn an_inertia_symmetric_but_for_noise_is_made_so<const N: usize>(case: &Case<N>) -> Outcome {
    let mut noisy = case.clone();
    for joint in &mut noisy.joints {
        let noise = 0.9e-9 * size(&joint.body.inertia_kg_m2);
        joint.body.inertia_kg_m2[(0, 2)] += noise;
        joint.body.inertia_kg_m2[(2, 1)] -= noise;
    }
    let (arm, q, qd, qdd) = (noisy.arm(), &case.q, &case.qd, &case.qdd);
    let tau = rnea(&arm, q, qd, qdd);
    let sum = crba(&arm, q) * qdd + coriolis_matrix(&arm, q, qd) * qd + gravity(&arm, q);
    prop_close!(tau, sum, torque_scale(case, &arm), 1e-13);
    Ok(())
}

fn accessors_tell_what_was_built<const N: usize>(case: &Case<N>) -> Outcome {
    let arm = case.arm();
    prop_assert_eq!(arm.gravity(), case.gravity);
    prop_assert_eq!(arm.armature(), case.armature());
    let poses = joint_poses(&arm, &case.q);
    let mut base_from_joint = Pose::IDENTITY;
    for (i, pose) in poses.iter().enumerate() {
        let link_from_joint = arm.link_from_joint(i);
        prop_close!(
            link_from_joint * Vector3::z(),
            case.joints[i].axis,
            1.0,
            1e-14
        );
        prop_close!(
            link_from_joint.tr_mul(&link_from_joint),
            Pose::IDENTITY.rotation,
            1.0,
            1e-14
        );
        prop_assert!(link_from_joint.determinant() > 0.0);

        base_from_joint = base_from_joint * arm.parent_from_joint_at(i, case.q[i]);
        prop_close!(pose.rotation, base_from_joint.rotation, 1.0, 1e-14);
        prop_close!(pose.translation, base_from_joint.translation, 1.0, 1e-14);
        prop_assert_eq!(arm.parent_from_joint_at(i, 0.0), arm.parent_from_joint(i));

        let expected = case.carried()[i].body();
        let link_from_joint = Pose {
            rotation: link_from_joint,
            ..Pose::IDENTITY
        };
        let found = arm.body(i).expressed_in(&link_from_joint);
        prop_close!(found.com_m, expected.com_m, 1.0, 1e-13);
        prop_close!(found.inertia_kg_m2, expected.inertia_kg_m2, 1.0, 1e-13);
    }
    let tip = base_from_joint * arm.joint_from_tip();
    prop_close!(
        tip.translation,
        tip_pose(&arm, &case.q).translation,
        1.0,
        1e-14
    );
    prop_close!(tip.rotation, tip_pose(&arm, &case.q).rotation, 1.0, 1e-14);
    Ok(())
}
