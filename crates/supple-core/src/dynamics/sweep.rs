//! One outward and one inward sweep that compute every term of the law, in groups of joints:
//! [`super::terms`] stores the result in matrices; the sum of the law also reads it directly.

use super::chain::Chain;
use super::crba::mass_columns;
use super::frames::{bodies, joint_motions};
use super::inertia::{gravity_gradient_about, gravity_torque_about};
use super::motion::{Motion, split};
use crate::math::Vector;
use crate::math::lanes::{Column, Columns, Rows, column, for_each_joint, splat, suffix_sums};
use crate::math::vec3::dot6;
use crate::model::arm::Arm;

/// Kinematic quantities of an arm in one state. All functions are inlined, so unused results cost
/// nothing.
pub(crate) struct Sweep<const G: usize> {
    /// Poses of the joints and the tip.
    pub chain: Chain<G>,
    /// The Jacobian's rows.
    pub motions: Rows<6, G>,
    /// Velocities, and accelerations at zero joint acceleration.
    pub motion: Motion<G>,
    bodies: Rows<10, G>,
}

/// Link forces and momenta projected onto the joint axes.
pub(crate) struct JointProjection<const G: usize> {
    /// `H qdd + C qd + G` \[N m\], without rotors.
    pub torque: Column<G>,
    /// `H qd` \[kg m^2/s\], without rotors.
    pub momentum: Column<G>,
    /// `dT/dq` \[N m\].
    pub kinetic_gradient: Column<G>,
}

impl<const G: usize> Sweep<G> {
    /// Sweeps an arm at `q` \[rad\], `qd` \[rad/s\].
    #[inline(always)]
    pub fn new<const N: usize>(arm: &Arm<N>, q: &Vector<N>, qd: &Vector<N>) -> Self {
        let chain = Chain::<G>::new(arm, q);
        let motions = joint_motions(&chain, chain.tip.origin);
        Sweep {
            motion: Motion::new(&motions, qd, arm.gravity.data.0[0]),
            bodies: bodies(arm, &chain, chain.tip.origin),
            motions,
            chain,
        }
    }

    /// Returns `J' qd` of the tip.
    #[inline(always)]
    pub fn tip_bias_acceleration<const N: usize>(&self) -> [f64; 6] {
        self.motion.tip_bias_acceleration::<N>()
    }

    /// Returns the mass matrix with rotor inertias; valid from the diagonal downwards.
    #[inline(always)]
    pub fn mass<const N: usize>(&self, arm: &Arm<N>) -> Columns<N, G> {
        mass_columns(arm, &self.motions, &suffix_sums(self.bodies))
    }

    /// Returns `G`.
    #[inline(always)]
    pub fn gravity<const N: usize>(&self, arm: &Arm<N>) -> Column<G> {
        let (carried, falls) = (suffix_sums(self.bodies), splat(arm.gravity.data.0[0]));
        let [weight] = for_each_joint!(axis in &self.motions, body in &carried => [gravity_torque_about(axis, body, falls)]);
        weight
    }

    /// Returns the gradient of `G` by gravity.
    #[inline(always)]
    pub fn gravity_gradient(&self) -> Rows<3, G> {
        let carried = suffix_sums(self.bodies);
        for_each_joint!(axis in &self.motions, body in &carried => gravity_gradient_about(axis, body))
    }

    /// Returns the joint torques, momenta and kinetic gradient of this motion.
    #[inline(always)]
    pub fn projection(&self) -> JointProjection<G> {
        let carried = suffix_sums(self.motion.forces(&self.bodies));
        let rates = &self.motion.rates;
        let [torque, momentum, kinetic_gradient] = for_each_joint!(axis in &self.motions, rate in rates, carried in &carried => {
            let (force, momentum) = split(carried);
            [
                dot6(axis, force),
                dot6(axis, momentum),
                dot6(rate, momentum),
            ]
        });
        JointProjection {
            torque,
            momentum,
            kinetic_gradient,
        }
    }

    /// Returns `H qdd + C qd + G` \[N m\].
    #[inline(always)]
    pub fn inverse_dynamics<const N: usize>(self, arm: &Arm<N>, qdd: &[f64; N]) -> Column<G> {
        let motion = self.motion.accelerated(&self.motions, qdd);
        let forces = motion.forces_of_links(arm, &self.chain, self.chain.tip.origin);
        let carried = suffix_sums(forces);
        let [mut torque] =
            for_each_joint!(axis in &self.motions, force in &carried => [dot6(axis, force)]);
        let (armature, qdd) = (column::<N, G>(&arm.armature.data.0[0]), column::<N, G>(qdd));
        for group in 0..G {
            torque[group] += armature[group] * qdd[group];
        }
        torque
    }
}
