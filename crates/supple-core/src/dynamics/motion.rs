//! Velocities and accelerations of all links, and the forces that they need, in base axes about the
//! tip.

use super::chain::Chain;
use super::inertia::{cross_force, cross_motion, inertia_times, times};
use crate::math::Vector;
use crate::math::lanes::{
    Lanes, NEGATIVE_ZERO, Number, Rows, column, for_each_joint, joint_values, prefix_sums, scaled,
    splat, total,
};
use crate::math::vec3::{
    V3, add, add_cross, add_rotated, cross, halves, join, rotate_back, scale, sub,
};
use crate::model::arm::Arm;

/// Motion of every link.
pub(crate) struct Motion<const G: usize> {
    pub twists: Rows<6, G>,
    /// Rate of change of each joint's motion: `v x S`.
    pub rates: Rows<6, G>,
    /// Spatial acceleration of the link's point that coincides with the reference point, with the
    /// base accelerated upwards.
    pub accelerations: Rows<6, G>,
    /// Velocity that each joint adds to that of its parent.
    steps: Rows<6, G>,
    /// Acceleration that each joint adds to that of its parent.
    added: Rows<6, G>,
    /// Acceleration of the base.
    base: [f64; 6],
}

impl<const G: usize> Motion<G> {
    /// Returns the motion for the joint velocities `qd` without joint accelerations.
    #[inline(always)]
    pub fn new<const N: usize>(motions: &Rows<6, G>, qd: &Vector<N>, gravity: V3) -> Self {
        let speeds = [column::<N, G>(&qd.data.0[0])];
        let steps = for_each_joint!([speed] in &speeds, motion in motions => scaled(motion, speed));
        let twists = prefix_sums([NEGATIVE_ZERO; 6], steps);
        let rates =
            for_each_joint!(twist in &twists, motion in motions => cross_motion(twist, motion));
        let base = join(gravity.map(|g| -g), [NEGATIVE_ZERO; 3]);
        let added = for_each_joint!([speed] in &speeds, rate in &rates => scaled(rate, speed));
        Motion {
            twists,
            rates,
            accelerations: prefix_sums(base, added),
            steps,
            added,
            base,
        }
    }

    /// Adds the joint accelerations `qdd`.
    #[inline(always)]
    pub fn accelerated<const N: usize>(mut self, motions: &Rows<6, G>, qdd: &[f64; N]) -> Self {
        let qdd = column::<N, G>(qdd);
        for (added, motion) in self.added.iter_mut().zip(motions) {
            for group in 0..G {
                added[group] = motion[group].multiply_add(qdd[group], added[group]);
            }
        }
        self.accelerations = prefix_sums(self.base, self.added);
        self
    }

    /// Returns the velocity of the tip, `J qd`.
    #[inline(always)]
    pub fn tip_rate<const N: usize>(&self) -> [f64; 6] {
        joint_values(&self.twists, N - 1)
    }

    /// Returns the classical acceleration of the tip at `qdd = 0`, `J' qd`: products of the velocities that the
    /// joints give the tip.
    #[inline(always)]
    pub fn tip_bias_acceleration<const N: usize>(&self) -> [f64; 6] {
        let linear: Rows<3, G> = for_each_joint!(twist in &self.twists, step in &self.steps => {
            let ((_, angular_velocity), (linear, angular)) = (halves(twist), halves(step));
            cross(sub(add(angular_velocity, angular_velocity), angular), linear)
        });
        let (_, angular) = halves(joint_values(&self.accelerations, N - 1));
        join(
            [total(&linear[0]), total(&linear[1]), total(&linear[2])],
            angular,
        )
    }

    /// Returns the force on each link, and momentum of each link.
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

    /// Returns the force on each link, by the Newton-Euler equations about the centre of mass, so that no
    /// inertia has to be transformed to the base.
    #[inline(always)]
    pub fn forces_of_links<const N: usize>(
        &self,
        arm: &Arm<N>,
        chain: &Chain<G>,
        point: V3,
    ) -> Rows<6, G> {
        let point = splat(point);
        let (masses, links) = (arm.rows.masses::<G>(), arm.rows.central::<G>());
        for_each_joint!(
            [mass] in &masses, link in &links, r in &chain.rotations, origin in &chain.origins,
            twist in &self.twists, accel in &self.accelerations => {
                let [x, y, z, inertia @ ..] = link;
                let com = add_rotated(sub(origin, point), &r, [x, y, z]);
                let ((v, w), (a, rate)) = (halves(twist), halves(accel));
                let com_accel = add_cross(add_cross(a, rate, com), w, add_cross(v, w, com));
                let force = scale(com_accel, mass);
                let (w, rate) = (rotate_back(&r, w), rotate_back(&r, rate));
                let moment = add_cross(inertia_times(inertia, rate), w, inertia_times(inertia, w));
                join(force, add_rotated(cross(com, force), &r, moment))
            }
        )
    }
}

/// Splits into force and momentum.
#[inline(always)]
pub(super) fn split(x: [Lanes; 12]) -> ([Lanes; 6], [Lanes; 6]) {
    (
        [x[0], x[1], x[2], x[3], x[4], x[5]],
        [x[6], x[7], x[8], x[9], x[10], x[11]],
    )
}
