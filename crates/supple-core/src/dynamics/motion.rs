//! Velocities and accelerations of all links, and the forces that they take, in base axes about the tip.

use super::inertia::{cross_force, cross_motion, times};
use super::vec3::{V3, add, add_cross, halves, join};
use crate::lanes::{Lanes, Rows, column, for_each_joint, of_joint, scaled, sums_outward};
use crate::math::Vector;

/// How every link moves.
pub(crate) struct Motion<const G: usize> {
    pub twists: Rows<6, G>,
    /// Of each joint's motion: `v x S`.
    pub rates: Rows<6, G>,
    /// With the base accelerated upwards, of the link's point that is at the reference point: spatial.
    pub accelerations: Rows<6, G>,
}

impl<const G: usize> Motion<G> {
    /// Under the joint speeds `qd` alone.
    #[inline(always)]
    pub fn new<const N: usize>(motions: &Rows<6, G>, qd: &Vector<N>, gravity: V3) -> Self {
        let speeds = [column::<N, G>(&qd.data.0[0])];
        let twists =
            for_each_joint!([speed] in &speeds, motion in motions => scaled(motion, speed));
        let twists = sums_outward([0.0; 6], twists);
        let rates =
            for_each_joint!(twist in &twists, motion in motions => cross_motion(twist, motion));
        let up = [-gravity[0], -gravity[1], -gravity[2], 0.0, 0.0, 0.0];
        let accelerations =
            for_each_joint!([speed] in &speeds, rate in &rates => scaled(rate, speed));
        Motion {
            twists,
            rates,
            accelerations: sums_outward(up, accelerations),
        }
    }

    /// The same with the joint accelerations `qdd`.
    #[inline(always)]
    pub fn accelerated<const N: usize>(mut self, motions: &Rows<6, G>, qdd: &[f64; N]) -> Self {
        let rates = [column::<N, G>(qdd)];
        let own = for_each_joint!([rate] in &rates, motion in motions => scaled(motion, rate));
        for (row, own) in self
            .accelerations
            .iter_mut()
            .zip(sums_outward([0.0; 6], own))
        {
            for (x, own) in row.iter_mut().zip(own) {
                *x += own;
            }
        }
        self
    }

    /// Velocity of the tip, `J qd`.
    #[inline(always)]
    pub fn tip_rate<const N: usize>(&self) -> [f64; 6] {
        of_joint(&self.twists, N - 1)
    }

    /// Classical acceleration of the tip at `qdd = 0`, `J' qd`.
    #[inline(always)]
    pub fn tip_drift<const N: usize>(&self, gravity: V3) -> [f64; 6] {
        let (velocity, spin) = halves(self.tip_rate::<N>());
        let (linear, angular) = halves(of_joint(&self.accelerations, N - 1));
        let linear = add(add_cross(linear, spin, velocity), gravity);
        join(linear, angular)
    }

    /// Force on each link, and its momentum.
    #[inline(always)]
    pub fn forces(&self, bodies: &Rows<10, G>) -> Rows<12, G> {
        for_each_joint!(
            body in bodies, twist in &self.twists, accel in &self.accelerations => {
                let momentum = times(body, twist);
                let (inertial, gyroscopic) = (times(body, accel), cross_force(twist, momentum));
                let mut both = [Lanes::ZERO; 12];
                for k in 0..6 {
                    both[k] = inertial[k] + gyroscopic[k];
                    both[k + 6] = momentum[k];
                }
                both
            }
        )
    }
}

/// Force and momentum.
#[inline(always)]
pub(super) fn split(x: [Lanes; 12]) -> ([Lanes; 6], [Lanes; 6]) {
    (
        [x[0], x[1], x[2], x[3], x[4], x[5]],
        [x[6], x[7], x[8], x[9], x[10], x[11]],
    )
}
