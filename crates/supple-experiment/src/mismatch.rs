//! How a controller's model differs from the plant: by what an identification leaves.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use supple_core::nalgebra::Vector3;
use supple_core::{Arm, ArmError, Body, Config, Friction, Joint};

/// Relative errors of a model. Each parameter is off by the full amount, with a seeded sign.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Mismatch {
    /// Of every mass and of every component of every centre of mass: of the gravity parameters.
    pub gravity: f64,
    /// Of the viscous, Coulomb and breakaway friction of every joint.
    pub friction: f64,
    /// Which signs.
    pub seed: u64,
}

impl Mismatch {
    /// What a good identification leaves: 0.1 % of gravity, 3 % of friction.
    pub fn identified(seed: u64) -> Mismatch {
        Mismatch {
            gravity: 1e-3,
            friction: 0.03,
            seed,
        }
    }

    /// The configuration of a controller whose model is off by this.
    ///
    /// # Errors
    /// Where the changed arm is no longer physical.
    pub fn apply<const N: usize>(&self, exact: &Config<N>) -> Result<Config<N>, ArmError> {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let mut off = |amount: f64| {
            1.0 + if random.random::<bool>() {
                amount
            } else {
                -amount
            }
        };
        let arm = &exact.arm;
        let joints: [Joint; N] = core::array::from_fn(|i| {
            let body = arm.body(i);
            let mass_kg = body.mass_kg * off(self.gravity);
            let com_m = Vector3::from_fn(|axis, _| body.com_m[axis] * off(self.gravity));
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
            let viscous = off(self.friction);
            let dry = off(self.friction);
            Friction {
                viscous_nm_s_per_rad: friction.viscous_nm_s_per_rad * viscous,
                coulomb_nm: friction.coulomb_nm * dry,
                breakaway_nm: friction.breakaway_nm * dry,
                ..friction
            }
        });
        Ok(Config {
            arm: Arm::new(&joints, arm.joint_from_tip(), None, arm.gravity())?,
            friction,
            ..*exact
        })
    }
}
