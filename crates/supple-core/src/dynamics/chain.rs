//! Where every joint frame stands in the base, joint after joint.
#![allow(
    clippy::needless_range_loop,
    reason = "joints, groups and lanes are counted: each index goes into several arrays"
)]

use super::vec3::{V3, add, product, rotate};
use crate::arm::Arm;
use crate::lanes::{Lanes, Rows, for_each_joint, of_joint, rows};
use crate::math::{Matrix3, Vector, Vector3};
use crate::pose::Pose;
use crate::sincos::sin_cos_all;

/// Rotation by columns, and origin.
#[derive(Clone, Copy)]
pub(super) struct Frame {
    pub rotation: [f64; 9],
    pub origin: V3,
}

impl Frame {
    /// Axis about which the joint turns.
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

    /// Of frame `c` in `a`, where `self` is frame `b` in `a`.
    #[inline(always)]
    fn then(&self, b_from_c: &Frame) -> Frame {
        Frame {
            rotation: product(&self.rotation, &b_from_c.rotation),
            origin: add(self.origin, rotate(&self.rotation, b_from_c.origin)),
        }
    }
}

/// `base_from_joint` of every joint, by rows, and `base_from_tip`.
pub(super) struct Chain<const G: usize> {
    pub rotations: Rows<9, G>,
    pub origins: Rows<3, G>,
    pub tip: Frame,
}

impl<const G: usize> Chain<G> {
    #[inline(always)]
    pub fn new<const N: usize>(arm: &Arm<N>, q: &Vector<N>) -> Self {
        let local = parent_rotations::<N, G>(arm, q);
        let mut base = Frame::of(&Pose::IDENTITY);
        let mut frames = [base; N];
        for (i, frame) in frames.iter_mut().enumerate() {
            let step = Frame {
                rotation: of_joint(&local, i),
                origin: arm.links[i].parent_from_joint.translation.data.0[0],
            };
            base = if i == 0 { step } else { base.then(&step) };
            *frame = base;
        }
        Chain {
            rotations: rows::<9, N, G>(|k, i| frames[i].rotation[k]),
            origins: rows::<3, N, G>(|k, i| frames[i].origin[k]),
            tip: base.then(&Frame::of(&arm.joint_from_tip)),
        }
    }

    #[inline(always)]
    pub fn frame(&self, i: usize) -> Frame {
        Frame {
            rotation: of_joint(&self.rotations, i),
            origin: of_joint(&self.origins, i),
        }
    }
}

/// Rotation of each joint frame in its parent's, by columns: the constant one, then a turn about z.
#[inline(always)]
pub(super) fn parent_rotations<const N: usize, const G: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
) -> Rows<9, G> {
    let [angles] = rows::<1, N, G>(|_, i| q[i]);
    let mut turns = [[Lanes::ZERO; G]; 2];
    for group in 0..G {
        let (sines, cosines) = sin_cos_all(&angles[group].to_array());
        (turns[0][group], turns[1][group]) = (Lanes::new(sines), Lanes::new(cosines));
    }
    let constant = rows::<9, N, G>(|k, i| arm.rows.rotation[k][i]);
    for_each_joint(&turns, &constant, &[], |[s, c], r, []| {
        [
            r[0] * c + r[3] * s,
            r[1] * c + r[4] * s,
            r[2] * c + r[5] * s,
            r[3] * c - r[0] * s,
            r[4] * c - r[1] * s,
            r[5] * c - r[2] * s,
            r[6],
            r[7],
            r[8],
        ]
    })
}
