//! Poses and bodies: URDF angles, composition, merging of bodies; compared with nalgebra and point
//! masses.

use crate::common::numeric::mixed_error;
use crate::common::random::{cloud, direction, pose};
use crate::support::settings::config;
use proptest::prelude::*;
use supple_core::math::{Matrix3, Vector3, skew};
use supple_core::nalgebra::Rotation3;
use supple_core::{Body, Pose};

proptest! {
    #![proptest_config(config(256, 20_260_102))]

    #[test]
    fn urdf_angles_are_roll_pitch_yaw_about_fixed_axes(rpy in [-3.2..3.2, -3.2..3.2, -3.2..3.2]) {
        let found = Pose::from_xyz_rpy([1.0, 2.0, 3.0], rpy);
        let expected = Rotation3::from_euler_angles(rpy[0], rpy[1], rpy[2]).into_inner();
        prop_assert!(mixed_error(&found.rotation, &expected) < 1e-15);
        prop_assert_eq!(found.translation, Vector3::new(1.0, 2.0, 3.0));
    }

    #[test]
    fn poses_compose_and_invert(a in pose(), b in pose(), c in pose()) {
        let there_and_back = a * b * (a * b).inverse();
        prop_assert!(mixed_error(&there_and_back.rotation, &Matrix3::identity()) < 1e-14);
        prop_assert!(mixed_error(&there_and_back.translation, &Vector3::zeros()) < 1e-14);
        let point = c.translation;
        let at_once = (a * b).transform_point(&point);
        let in_turn = a.transform_point(&b.transform_point(&point));
        prop_assert!(mixed_error(&at_once, &in_turn) < 1e-14);
    }

    #[test]
    fn z_is_rotated_onto_any_axis(axis in direction()) {
        let pose = Pose::z_onto(&axis);
        let r = pose.rotation;
        prop_assert_eq!(r.column(2).into_owned(), axis);
        prop_assert!(mixed_error(&(r.transpose() * r), &Matrix3::identity()) < 1e-14);
        prop_assert!(r.determinant() > 0.0);
        prop_assert_eq!(pose.translation, Vector3::zeros());
    }

    #[test]
    fn expressed_in_matches_transformed_points(cloud in cloud(), a_from_b in pose()) {
        let found = cloud.body().expressed_in(&a_from_b);
        same_body(&found, &cloud.expressed_in(&a_from_b).body())?;
    }

    #[test]
    fn merged_bodies_match_the_points_of_both(one in cloud(), two in cloud()) {
        let found = one.body().merged(&two.body());
        same_body(&found, &one.clone().joined(two.clone()).body())?;
        let origin = Vector3::zeros();
        let about_origin = found.inertia_about_origin();
        let expected = one.inertia_about(&origin) + two.inertia_about(&origin);
        prop_assert!(mixed_error(&about_origin, &expected) < 1e-14);
        prop_assert_eq!(found.validate(), Ok(()));
    }

    #[test]
    fn skew_is_the_cross_product(a in pose(), b in pose()) {
        let (a, b) = (a.translation, b.translation);
        prop_assert!(mixed_error(&(skew(&a) * b), &a.cross(&b)) < 1e-15);
    }
}

fn same_body(found: &Body, expected: &Body) -> Result<(), TestCaseError> {
    prop_assert!((found.mass_kg - expected.mass_kg).abs() < 1e-14);
    prop_assert!(mixed_error(&found.com_m, &expected.com_m) < 1e-14);
    prop_assert!(mixed_error(&found.inertia_kg_m2, &expected.inertia_kg_m2) < 1e-14);
    Ok(())
}

#[test]
fn z_onto_z_is_bit_exact_identity() {
    assert_eq!(Pose::z_onto(&Vector3::z()), Pose::IDENTITY);
}

#[test]
fn inertia_of_a_ball_is_isotropic() {
    let ball = Body::ball(2.0, 0.05, Vector3::new(0.0, 0.0, 0.1));
    assert_eq!(ball.validate(), Ok(()));
    let expected = Matrix3::identity() * (2.0 / 5.0 * 2.0 * 0.05 * 0.05);
    assert!(mixed_error(&ball.inertia_kg_m2, &expected) < 1e-16);
}
