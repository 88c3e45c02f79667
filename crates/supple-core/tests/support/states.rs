//! Random inputs of the impedance law, on one of the arms.

use super::property::{per_joint, vector3};
use proptest::prelude::*;
use supple_core::config::{Gains, Law, Role};
use supple_core::dynamics::{Terms, terms};
use supple_core::impedance::{LawInput, PositionTarget, Task, Torques, impedance};
use supple_core::math::Vector3;
use supple_core::{Arm, Friction, Reference, Vector};

/// State of the arm, reference, gains, force.
#[derive(Clone, Debug)]
pub struct Scene<const N: usize> {
    pub q: Vector<N>,
    pub qd: Vector<N>,
    pub reference: Reference,
    pub gains: Gains,
    pub force_n: Vector3<f64>,
    pub friction_share: f64,
}

/// Random scenes with joint angles within the stops.
pub fn scene<const N: usize>() -> impl Strategy<Value = Scene<N>> {
    let axis = |reach: f64| [0.0..reach, 0.0..reach, 0.0..reach].prop_map(Vector3::from);
    (
        (per_joint(2.0), per_joint(1.5)),
        (vector3(0.8), vector3(0.5), vector3(2.0)),
        (axis(200.0), axis(30.0)),
        vector3(20.0),
        0.0..1.0,
    )
        .prop_map(
            |((q, qd), (position, velocity, acceleration), (k, b), force_n, friction_share)| {
                Scene {
                    q,
                    qd,
                    reference: Reference {
                        position,
                        velocity,
                        acceleration,
                    },
                    gains: Gains {
                        stiffness_n_per_m: k,
                        damping_n_s_per_m: b,
                    },
                    force_n,
                    friction_share,
                }
            },
        )
}

impl<const N: usize> Scene<N> {
    pub fn terms(&self, arm: &Arm<N>) -> Terms<N> {
        let mut filled = Terms::default();
        terms(arm, &self.q, &self.qd, &mut filled);
        filled
    }

    pub fn task(&self, arm: &Arm<N>, roles: &[Role; N]) -> Task<N> {
        Task::new(&self.terms(arm), roles).expect("a positive definite mass matrix")
    }

    pub fn torques(
        &self,
        law: &Law,
        friction: &[Friction; N],
        arm: &Arm<N>,
        roles: &[Role; N],
        tip_force_n: Option<Vector3<f64>>,
    ) -> Torques<N> {
        let target = PositionTarget {
            reference: &self.reference,
            gains: &self.gains,
            spring_limit_n: f64::MAX,
        };
        let now = LawInput {
            friction_share: self.friction_share,
            ..LawInput::of_law(law, friction, target, &self.qd, tip_force_n)
        };
        let (terms, task) = (self.terms(arm), self.task(arm, roles));
        impedance(roles, &terms, &task, &now)
    }
}
