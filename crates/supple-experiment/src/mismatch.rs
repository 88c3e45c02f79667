//! Parameter errors of the controller's model relative to the plant, of the size that remains after an identification.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use supple_core::nalgebra::Vector3;
use supple_core::{Arm, ArmError, Body, Config, Joint, Link};

/// Relative parameter errors of a model. Masses, centres of mass, viscous and dry friction are multiplied by one plus or minus
/// the fraction. The signs are random, drawn from `seed`; Coulomb and breakaway friction of a joint have the same sign. All other
/// parameters are exact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Mismatch {
    /// Error of the parameters on which gravity torques depend: the mass of every link and every component of its centre of mass.
    pub gravity: f64,
    /// Error of the viscous, Coulomb and breakaway friction of every joint.
    pub friction: f64,
    /// Seed of the random signs.
    pub seed: u64,
}

impl Mismatch {
    /// Returns typical errors after a good identification: masses and centres of mass 0.1 %, friction 3 %.
    pub fn identified(seed: u64) -> Mismatch {
        Mismatch {
            gravity: 1e-3,
            friction: 0.03,
            seed,
        }
    }

    /// Applies these errors to the model in a controller configuration.
    ///
    /// # Errors
    /// If the changed inertial parameters are not physically consistent.
    pub fn apply<const N: usize>(&self, exact: &Config<N>) -> Result<Config<N>, ArmError> {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let mut factor = |amount: f64| {
            1.0 + if random.random::<bool>() {
                amount
            } else {
                -amount
            }
        };
        let arm = &exact.arm;
        let joints: [Joint; N] = core::array::from_fn(|i| {
            let body = arm.body(i);
            let mass_kg = body.mass_kg * factor(self.gravity);
            let com_m = Vector3::from_fn(|axis, _| body.com_m[axis] * factor(self.gravity));
            Joint {
                parent_from_link: arm.parent_from_joint(i),
                axis: Vector3::z(),
                body: Body {
                    mass_kg,
                    com_m,
                    ..body
                },
                armature_kg_m2: arm.armature()[i],
            }
        });
        let friction = exact.friction.map(|friction| {
            let viscous_friction_factor = factor(self.friction);
            let dry_friction_factor = factor(self.friction);
            friction
                .with_viscous_scaled(viscous_friction_factor)
                .with_dry_scaled(dry_friction_factor)
        });
        let changed = Arm::new(&joints, arm.joint_from_tip(), None, arm.gravity())?;
        // `joints` are in joint frames; a fit that starts from this model gives its links in the frames of the description.
        let links = core::array::from_fn(|i| Link {
            link_from_joint: arm.link_from_joint(i),
            ..changed.links()[i]
        });
        let (armature, tip) = (changed.armature(), changed.joint_from_tip());
        Ok(Config {
            arm: Arm::from_links(links, armature, tip, arm.gravity())?,
            friction,
            ..*exact
        })
    }
}
