//! How every link moves, each in its own joint frame.
//!
//! With `W = [alpha x] + [omega x][omega x]`, a point `p` of a link is accelerated by `a + W p`.
#![allow(
    clippy::needless_range_loop,
    reason = "joints, groups and lanes are counted: each index goes into several arrays"
)]

use crate::arm::Arm;
use crate::lanes::{Number, Rows, of_joint};
use crate::math::Vector;
use crate::vec3::{V3, add_rotated, rotate_back};

/// Motion of a joint frame, in its own axes.
#[derive(Clone, Copy)]
pub(super) struct BodyMotion {
    /// `omega` \[rad/s\].
    pub spin: V3,
    /// `alpha` \[rad/s^2\].
    pub rate: V3,
    /// Of the origin, with the base accelerated upwards \[m/s^2\].
    pub accel: V3,
    /// `W`, by columns.
    pub gradient: [f64; 9],
}

impl BodyMotion {
    const REST: BodyMotion = BodyMotion {
        spin: [0.0; 3],
        rate: [0.0; 3],
        accel: [0.0; 3],
        gradient: [0.0; 9],
    };
}

/// Motions of all joint frames, from the base outwards.
#[inline(always)]
pub(super) fn body_motions<const N: usize, const G: usize>(
    arm: &Arm<N>,
    rotations: &Rows<9, G>,
    qd: &Vector<N>,
    qdd: &Vector<N>,
) -> [BodyMotion; N] {
    let mut motions = [BodyMotion::REST; N];
    let mut last = BodyMotion::REST;
    last.accel = arm.gravity.map(|g| -g).data.0[0];
    for i in 0..N {
        let r = of_joint(rotations, i);
        let origin = arm.links[i].parent_from_joint.translation.data.0[0];
        let (mut spin, mut rate, mut accel) = ([0.0; 3], [0.0; 3], last.accel);
        if i > 0 {
            spin = rotate_back(&r, last.spin);
            rate = rotate_back(&r, last.rate);
            rate[0] = spin[1].times_plus(qd[i], rate[0]);
            rate[1] = (-spin[0]).times_plus(qd[i], rate[1]);
            accel = add_rotated(accel, &last.gradient, origin);
        }
        rate[2] += qdd[i];
        spin[2] += qd[i];
        last = BodyMotion {
            spin,
            rate,
            accel: rotate_back(&r, accel),
            gradient: gradient(spin, rate),
        };
        motions[i] = last;
    }
    motions
}

/// `W`, by columns.
#[inline(always)]
pub(super) fn gradient<T: Number>(w: V3<T>, rate: V3<T>) -> [T; 9] {
    let zz = w[2] * w[2];
    [
        -w[1].times_plus(w[1], zz),
        w[0].times_plus(w[1], rate[2]),
        w[0].times_plus(w[2], -rate[1]),
        w[0].times_plus(w[1], -rate[2]),
        -w[0].times_plus(w[0], zz),
        w[1].times_plus(w[2], rate[0]),
        w[0].times_plus(w[2], rate[1]),
        w[1].times_plus(w[2], -rate[0]),
        -w[0].times_plus(w[0], w[1] * w[1]),
    ]
}
