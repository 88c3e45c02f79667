//! The one sweep out and back that gives every term of the law, in groups of joints: [`super::terms`] puts
//! it into matrices, [`crate::operational`] goes on with it as it is.

use super::chain::Chain;
use super::crba::mass_columns;
use super::frames::{bodies, joint_motions};
use super::inertia::weight_on;
use super::motion::{Motion, split};
use crate::arm::Arm;
use crate::lanes::{Column, Columns, Rows, column, for_each_joint, splat, sums_inward};
use crate::math::Vector;
use crate::vec3::dot6;

/// An arm in a state. What nobody asks for is not computed: everything here is inlined.
pub(crate) struct Sweep<const G: usize> {
    /// Where the joints and the tip are.
    pub chain: Chain<G>,
    /// The Jacobian's rows.
    pub motions: Rows<6, G>,
    /// Velocities, and accelerations without those of the joints.
    pub motion: Motion<G>,
    bodies: Rows<10, G>,
}

/// What the links' forces and momenta ask of the joints.
pub(crate) struct Held<const G: usize> {
    /// `H qdd + C qd + G` \[N m\], without rotors.
    pub torque: Column<G>,
    /// `H qd` \[kg m^2/s\], without rotors.
    pub momentum: Column<G>,
    /// `dT/dq` \[N m\].
    pub kinetic_gradient: Column<G>,
}

impl<const G: usize> Sweep<G> {
    /// At `q` \[rad\], `qd` \[rad/s\].
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

    /// `J' qd` of the tip.
    #[inline(always)]
    pub fn tip_drift<const N: usize>(&self) -> [f64; 6] {
        self.motion.tip_drift::<N>()
    }

    /// The mass matrix, right from the diagonal downwards, with rotor inertias.
    #[inline(always)]
    pub fn mass<const N: usize>(&self, arm: &Arm<N>) -> Columns<N, G> {
        mass_columns(arm, &self.motions, &sums_inward(self.bodies))
    }

    /// `G`.
    #[inline(always)]
    pub fn gravity<const N: usize>(&self, arm: &Arm<N>) -> Column<G> {
        let (carried, falls) = (sums_inward(self.bodies), splat(arm.gravity.data.0[0]));
        let [weight] = for_each_joint!(axis in &self.motions, body in &carried => [weight_on(axis, body, falls)]);
        weight
    }

    /// Of this motion.
    #[inline(always)]
    pub fn held(&self) -> Held<G> {
        let held = sums_inward(self.motion.forces(&self.bodies));
        let rates = &self.motion.rates;
        let [torque, momentum, kinetic_gradient] = for_each_joint!(axis in &self.motions, rate in rates, held in &held => {
            let (force, momentum) = split(held);
            [
                dot6(axis, force),
                dot6(axis, momentum),
                dot6(rate, momentum),
            ]
        });
        Held {
            torque,
            momentum,
            kinetic_gradient,
        }
    }

    /// `H qdd + C qd + G` \[N m\].
    #[inline(always)]
    pub fn inverse_dynamics<const N: usize>(self, arm: &Arm<N>, qdd: &[f64; N]) -> Column<G> {
        let motion = self.motion.accelerated(&self.motions, qdd);
        let forces = motion.forces_of_links(arm, &self.chain, self.chain.tip.origin);
        let held = sums_inward(forces);
        let [mut torque] =
            for_each_joint!(axis in &self.motions, force in &held => [dot6(axis, force)]);
        let (armature, qdd) = (column::<N, G>(&arm.armature.data.0[0]), column::<N, G>(qdd));
        for group in 0..G {
            torque[group] += armature[group] * qdd[group];
        }
        torque
    }
}
