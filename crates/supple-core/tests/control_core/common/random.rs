//! Random physical arms: bodies are clouds of point masses, axes and frames have random
//! orientations.

use super::cloud::{Cloud, Point};
use crate::support::property::{Outcome, run};
use crate::support::settings::config;
use proptest::collection::vec;
use proptest::prelude::*;
use supple_core::math::Vector3;
use supple_core::{Arm, Joint, Pose, Vector};

/// A random arm, its components, and a random state.
#[derive(Clone, Debug)]
pub struct Case<const N: usize> {
    pub joints: [Joint; N],
    /// The links' bodies in their link frames.
    pub clouds: [Cloud; N],
    pub last_link_from_tip: Pose,
    /// Body in the tip frame.
    pub tool: Option<Cloud>,
    pub gravity: Vector3<f64>,
    pub q: Vector<N>,
    pub qd: Vector<N>,
    pub qdd: Vector<N>,
}

impl<const N: usize> Case<N> {
    pub fn arm(&self) -> Arm<N> {
        let tool = self.tool.as_ref().map(Cloud::body);
        Arm::new(&self.joints, self.last_link_from_tip, tool, self.gravity)
            .expect("random arms are physically consistent")
    }

    /// The links' bodies in their link frames; the last one includes the tool.
    pub fn carried(&self) -> [Cloud; N] {
        let mut clouds = self.clouds.clone();
        if let Some(tool) = &self.tool {
            let last = clouds[N - 1].clone();
            clouds[N - 1] = last.joined(tool.expressed_in(&self.last_link_from_tip));
        }
        clouds
    }

    pub fn armature(&self) -> Vector<N> {
        Vector::from_fn(|i, _| self.joints[i].armature_kg_m2)
    }
}

/// Runs `property` on 200 random arms of `N` joints, the same ones each time.
///
/// `PROPTEST_CASES` and `PROPTEST_RNG_SEED` override number and seed.
pub fn check<const N: usize>(property: fn(&Case<N>) -> Outcome) {
    run(config(200, 20_260_101), case::<N>(), |case| property(&case));
}

/// Defines one test per property and arm size.
#[macro_export]
macro_rules! for_arms_of_3_4_and_7_joints {
    ($($property:ident),* $(,)?) => {$(
        mod $property {
            #[test]
            fn of_3_joints() { $crate::common::random::check(super::$property::<3>); }
            #[test]
            fn of_4_joints() { $crate::common::random::check(super::$property::<4>); }
            #[test]
            fn of_7_joints() { $crate::common::random::check(super::$property::<7>); }
        }
    )*};
}

fn vector3(reach: f64) -> impl Strategy<Value = Vector3<f64>> {
    [-reach..reach, -reach..reach, -reach..reach].prop_map(Vector3::from)
}

/// Unit vectors: arbitrary, in a coordinate plane, close to a coordinate axis, and along one in
/// either direction.
pub fn direction() -> impl Strategy<Value = Vector3<f64>> {
    let oblique = vector3(1.0)
        .prop_filter("long enough to have a direction", |v| v.norm() > 0.1)
        .prop_map(|v| v.normalize());
    let planar = (0..3_usize, 0.1..3.0_f64).prop_map(|(i, angle_rad)| {
        let mut axis = Vector3::zeros();
        axis[i] = angle_rad.cos();
        axis[(i + 1) % 3] = angle_rad.sin();
        axis
    });
    let nearly_straight =
        (0..3_usize, vector3(1e-5)).prop_map(|(i, off)| (Vector3::ith(i, 1.0) + off).normalize());
    let straight = (0..3_usize, any::<bool>())
        .prop_map(|(i, back)| Vector3::ith(i, if back { -1.0 } else { 1.0 }));
    prop_oneof![3 => oblique, 1 => planar, 1 => nearly_straight, 2 => straight]
}

pub fn pose() -> impl Strategy<Value = Pose> {
    (vector3(0.4), vector3(3.2)).prop_map(|(xyz, rpy)| Pose::from_xyz_rpy(xyz.into(), rpy.into()))
}

pub fn cloud() -> impl Strategy<Value = Cloud> {
    let point = (0.05..1.0, vector3(0.2)).prop_map(|(mass_kg, position_m)| Point {
        mass_kg,
        position_m,
    });
    // Without it, a failing case shrinks to a point and fails for another reason.
    vec(point, 5..8)
        .prop_map(Cloud)
        .prop_filter("a body with a volume", |cloud| {
            cloud.body().validate().is_ok()
        })
}

fn joint() -> impl Strategy<Value = (Joint, Cloud)> {
    let armature = prop_oneof![Just(0.0), 0.0..0.3];
    (pose(), direction(), cloud(), armature).prop_map(
        |(parent_from_link, axis, cloud, armature_kg_m2)| {
            let joint = Joint {
                parent_from_link,
                axis,
                body: cloud.body(),
                armature_kg_m2,
            };
            (joint, cloud)
        },
    )
}

fn per_joint<const N: usize>(reach: f64) -> impl Strategy<Value = Vector<N>> {
    vec(-reach..reach, N).prop_map(|v| Vector::from_column_slice(&v))
}

pub fn case<const N: usize>() -> impl Strategy<Value = Case<N>> {
    let parts = (
        vec(joint(), N),
        pose(),
        proptest::option::of(cloud()),
        vector3(10.0),
    );
    let state = (per_joint(3.2), per_joint(3.0), per_joint(10.0));
    (parts, state).prop_map(|((links, tip, tool, gravity), (q, qd, qdd))| Case {
        joints: std::array::from_fn(|i| links[i].0),
        clouds: std::array::from_fn(|i| links[i].1.clone()),
        last_link_from_tip: tip,
        tool,
        gravity,
        q,
        qd,
        qdd,
    })
}
