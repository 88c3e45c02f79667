//! Poses of all joint frames in the base frame.
//!
//! Poses are composed by pairs, then pairs of pairs, then group after group: four lanes need two
//! steps instead of three for a joint-by-joint composition, and all joints stay in their lanes.
#![allow(
    clippy::needless_range_loop,
    reason = "joints, groups and lanes are counted: each index goes into several arrays"
)]

use crate::math::lanes::{
    Column, LANES, Lanes, Number, Rows, for_each_joint, joint_values, load_group, splat,
    store_group,
};
use crate::math::sincos::sin_cos;
use crate::math::vec3::{V3, add_rotated, product};
use crate::math::{Matrix3, Vector, Vector3};
use crate::model::arm::Arm;
use crate::model::pose::Pose;
use core::array::from_fn;

/// Rotation by columns, and origin.
#[derive(Clone, Copy)]
pub(crate) struct Transform<T> {
    pub rotation: [T; 9],
    pub origin: V3<T>,
}

/// Pose of one joint, or of the tip.
pub(crate) type Frame = Transform<f64>;

impl<T: Number> Transform<T> {
    /// Returns the pose of frame `c` in `a`; `self` is frame `b` in `a`.
    #[inline(always)]
    fn then(&self, b_from_c: &Transform<T>) -> Transform<T> {
        Transform {
            rotation: product(&self.rotation, &b_from_c.rotation),
            origin: add_rotated(self.origin, &self.rotation, b_from_c.origin),
        }
    }
}

impl Transform<Lanes> {
    #[inline(always)]
    fn base() -> Transform<Lanes> {
        Transform {
            rotation: splat(IDENTITY_ROTATION),
            origin: splat([0.0; 3]),
        }
    }

    /// Moves joints to other lanes; `moved` also receives the value of the base for the free lanes.
    #[inline(always)]
    fn shifted(&self, moved: impl Fn([f64; LANES], f64) -> [f64; LANES]) -> Transform<Lanes> {
        let mut pose = *self;
        for (x, base) in pose.rotation.iter_mut().zip(IDENTITY_ROTATION) {
            *x = Lanes::new(moved(x.to_array(), base));
        }
        for x in &mut pose.origin {
            *x = Lanes::new(moved(x.to_array(), 0.0));
        }
        pose
    }
}

/// Returns the lanes with the first one replaced.
#[inline(always)]
fn first_lane(x: Lanes, first: f64) -> Lanes {
    let [_, b, c, d] = x.to_array();
    Lanes::new([first, b, c, d])
}

const IDENTITY_ROTATION: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

impl Frame {
    /// Axis of the joint.
    #[inline(always)]
    pub fn axis(&self) -> V3 {
        [self.rotation[6], self.rotation[7], self.rotation[8]]
    }

    #[inline(always)]
    fn of(pose: &Pose) -> Frame {
        let c = &pose.rotation.data.0;
        Frame {
            rotation: [
                c[0][0], c[0][1], c[0][2], c[1][0], c[1][1], c[1][2], c[2][0], c[2][1], c[2][2],
            ],
            origin: pose.translation.data.0[0],
        }
    }

    #[inline(always)]
    pub fn pose(&self) -> Pose {
        Pose {
            rotation: Matrix3::from_column_slice(&self.rotation),
            translation: Vector3::from(self.origin),
        }
    }
}

/// `base_from_joint` of every joint, by rows, and `base_from_tip`.
pub(crate) struct Chain<const G: usize> {
    pub rotations: Rows<9, G>,
    pub origins: Rows<3, G>,
    pub tip: Frame,
}

impl<const G: usize> Chain<G> {
    #[inline(always)]
    pub fn new<const N: usize>(arm: &Arm<N>, q: &Vector<N>) -> Self {
        Self::of_steps(arm, parent_rotations::<N, G>(arm, q), arm.rows.origins(), N)
    }

    /// Returns the chain in the axes of the first joint, about its origin: quantities of the joints alone
    /// do not depend on this choice, and three joints need one composition less.
    #[inline(always)]
    pub fn from_first_joint<const N: usize>(arm: &Arm<N>, q: &Vector<N>) -> Self {
        let (mut turns, mut origins) = (parent_rotations::<N, G>(arm, q), arm.rows.origins::<G>());
        for (row, x) in turns.iter_mut().zip(IDENTITY_ROTATION) {
            row[0] = first_lane(row[0], x);
        }
        for row in &mut origins {
            row[0] = first_lane(row[0], 0.0);
        }
        Self::of_steps(arm, turns, origins, N - 1)
    }

    /// Composes the poses of the joints in their parents' frames; all but the first
    /// `rotated_joints` are the identity.
    #[inline(always)]
    fn of_steps<const N: usize>(
        arm: &Arm<N>,
        local: Rows<9, G>,
        steps: Rows<3, G>,
        rotated_joints: usize,
    ) -> Self {
        let (mut rotations, mut origins) = ([[Lanes::ZERO; G]; 9], [[Lanes::ZERO; G]; 3]);
        let mut before = Transform::<Lanes>::base();
        for group in 0..G {
            let step = Transform {
                rotation: load_group(&local, group),
                origin: load_group(&steps, group),
            };
            let pairs = step
                .shifted(|[a, b, c, _], base| [base, a, b, c])
                .then(&step);
            let mut pose = pairs;
            if rotated_joints > 2 {
                pose = pairs
                    .shifted(|[a, b, ..], base| [base, base, a, b])
                    .then(&pairs);
            }
            if group > 0 {
                pose = before.then(&pose);
            }
            before = pose.shifted(|[.., last], _| [last; LANES]);
            store_group(&mut rotations, group, pose.rotation);
            store_group(&mut origins, group, pose.origin);
        }
        let last = Frame {
            rotation: joint_values(&rotations, N - 1),
            origin: joint_values(&origins, N - 1),
        };
        Chain {
            tip: last.then(&Frame::of(&arm.joint_from_tip)),
            rotations,
            origins,
        }
    }

    #[inline(always)]
    pub fn frame(&self, i: usize) -> Frame {
        Frame {
            rotation: joint_values(&self.rotations, i),
            origin: joint_values(&self.origins, i),
        }
    }
}

/// Returns the rotation of each joint frame in its parent's, by columns: the constant one, then the rotation
/// about z.
#[inline(always)]
pub(super) fn parent_rotations<const N: usize, const G: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
) -> Rows<9, G> {
    // Lanes without a joint repeat the last angle: with a constant the compiler would split the
    // group.
    let angles: Column<G> =
        from_fn(|group| Lanes::new(from_fn(|lane| q[(group * LANES + lane).min(N - 1)])));
    let turns = sin_cos(&angles);
    let constant = arm.rows.rotations::<G>();
    for_each_joint!([s, c] in &turns, r in &constant => {
        [
            Number::multiply_add(r[3], s, r[0] * c),
            Number::multiply_add(r[4], s, r[1] * c),
            Number::multiply_add(r[5], s, r[2] * c),
            Number::multiply_add(r[3], c, -(r[0] * s)),
            Number::multiply_add(r[4], c, -(r[1] * s)),
            Number::multiply_add(r[5], c, -(r[2] * s)),
            r[6],
            r[7],
            r[8],
        ]
    })
}
