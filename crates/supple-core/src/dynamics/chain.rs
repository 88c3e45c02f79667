//! Where every joint frame stands in the base.
//!
//! Poses are composed by pairs, then pairs of pairs, then group after group: in four lanes that is two steps
//! where joint after joint takes three, and all joints stay in their lanes.
#![allow(
    clippy::needless_range_loop,
    reason = "joints, groups and lanes are counted: each index goes into several arrays"
)]

use crate::arm::Arm;
use crate::lanes::{
    Column, LANES, Lanes, Number, Rows, for_each_joint, of_group, of_joint, put_group, splat,
};
use crate::math::{Matrix3, Vector, Vector3};
use crate::pose::Pose;
use crate::sincos::sin_cos;
use crate::vec3::{V3, add_rotated, product};
use core::array::from_fn;

/// Rotation by columns, and origin.
#[derive(Clone, Copy)]
pub(crate) struct Place<T> {
    pub rotation: [T; 9],
    pub origin: V3<T>,
}

/// Of one joint, or of the tip.
pub(crate) type Frame = Place<f64>;

impl<T: Number> Place<T> {
    /// Of frame `c` in `a`, where `self` is frame `b` in `a`.
    #[inline(always)]
    fn then(&self, b_from_c: &Place<T>) -> Place<T> {
        Place {
            rotation: product(&self.rotation, &b_from_c.rotation),
            origin: add_rotated(self.origin, &self.rotation, b_from_c.origin),
        }
    }
}

impl Place<Lanes> {
    #[inline(always)]
    fn base() -> Place<Lanes> {
        Place {
            rotation: splat(UNTURNED),
            origin: splat([0.0; 3]),
        }
    }

    /// Joints moved to other lanes; `moved` is also given the number that the base has there.
    #[inline(always)]
    fn shifted(&self, moved: impl Fn([f64; LANES], f64) -> [f64; LANES]) -> Place<Lanes> {
        let mut place = *self;
        for (x, base) in place.rotation.iter_mut().zip(UNTURNED) {
            *x = Lanes::new(moved(x.to_array(), base));
        }
        for x in &mut place.origin {
            *x = Lanes::new(moved(x.to_array(), 0.0));
        }
        place
    }
}

/// With another number in the first lane.
#[inline(always)]
fn first_lane(x: Lanes, first: f64) -> Lanes {
    let [_, b, c, d] = x.to_array();
    Lanes::new([first, b, c, d])
}

const UNTURNED: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

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

    /// The same in the axes of the first joint, about its origin: what is of the joints alone is not changed by
    /// it, and three joints have one composition less.
    #[inline(always)]
    pub fn from_first_joint<const N: usize>(arm: &Arm<N>, q: &Vector<N>) -> Self {
        let (mut turns, mut origins) = (parent_rotations::<N, G>(arm, q), arm.rows.origins::<G>());
        for (row, x) in turns.iter_mut().zip(UNTURNED) {
            row[0] = first_lane(row[0], x);
        }
        for row in &mut origins {
            row[0] = first_lane(row[0], 0.0);
        }
        Self::of_steps(arm, turns, origins, N - 1)
    }

    /// From the pose of each joint in its parent's, of which all but `turned` are the identity.
    #[inline(always)]
    fn of_steps<const N: usize>(
        arm: &Arm<N>,
        local: Rows<9, G>,
        steps: Rows<3, G>,
        turned: usize,
    ) -> Self {
        let (mut rotations, mut origins) = ([[Lanes::ZERO; G]; 9], [[Lanes::ZERO; G]; 3]);
        let mut before = Place::<Lanes>::base();
        for group in 0..G {
            let step = Place {
                rotation: of_group(&local, group),
                origin: of_group(&steps, group),
            };
            let pairs = step
                .shifted(|[a, b, c, _], base| [base, a, b, c])
                .then(&step);
            let mut place = pairs;
            if turned > 2 {
                place = pairs
                    .shifted(|[a, b, ..], base| [base, base, a, b])
                    .then(&pairs);
            }
            if group > 0 {
                place = before.then(&place);
            }
            before = place.shifted(|[.., last], _| [last; LANES]);
            put_group(&mut rotations, group, place.rotation);
            put_group(&mut origins, group, place.origin);
        }
        let last = Frame {
            rotation: of_joint(&rotations, N - 1),
            origin: of_joint(&origins, N - 1),
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
    // The last angle again where there is no joint: with a constant there the compiler takes the group apart.
    let angles: Column<G> =
        from_fn(|group| Lanes::new(from_fn(|lane| q[(group * LANES + lane).min(N - 1)])));
    let turns = sin_cos(&angles);
    let constant = arm.rows.rotations::<G>();
    for_each_joint!([s, c] in &turns, r in &constant => {
        [
            Number::times_plus(r[3], s, r[0] * c),
            Number::times_plus(r[4], s, r[1] * c),
            Number::times_plus(r[5], s, r[2] * c),
            Number::times_plus(r[3], c, -(r[0] * s)),
            Number::times_plus(r[4], c, -(r[1] * s)),
            Number::times_plus(r[5], c, -(r[2] * s)),
            r[6],
            r[7],
            r[8],
        ]
    })
}
