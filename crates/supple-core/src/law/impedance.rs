//! The impedance law, Eq. (3.6): separate terms, or their sum.
//!
//! With `Jb = H^-1 J^T (J H^-1 J^T)^-1`, the dynamically consistent inverse ([`crate::law::task`]):
//!
//! ```text
//! own inertia     tau = G + C qd + D + H Jb (Xo'' - J' qd) + J^T [K (Xo - X) + B (Xo' - X')]
//! chosen inertia  tau = G + C qd + D + H Jb (Xo'' - J' qd) - J^T F
//!                       + H Jb M^-1 [F + K (Xo - X) + B (Xo' - X')]
//! ```
//!
//! `F` is the measured force on the tip. `Xo''` is not in (3.6): it is the feed-forward `M Xo''` that
//! (3.3) lacks. The task does not use held joints; they receive the model's coupling torque
//! `H Jb (..)` from this law, and the torque of their own stiff loop elsewhere.
//!
//! **With more active joints than directions**, motion that does not move the tip is damped by
//! `-d N^T N qd`, `N = 1 - Jb J`. Because `J H^-1 N^T = 0`, this torque causes no force on the tip, and because of `N` on both
//! sides it takes energy from every motion of the arm (`-d N^T qd` alone can add energy). A further torque,
//! for example towards a posture, acts in this null space as `N^T tau`. Near singular poses, where `Jb` is damped, a part of
//! both torques acts on the tip.
//!
//! **Two implementations of one law.** A `TermSink` receives each term as an acceleration of the tip, a force on the tip or
//! joint torques. [`impedance`] maps each term to the joints and keeps it; [`crate::impedance_torque`] adds up the
//! accelerations and the forces and maps their sums once.

use crate::config::{ApparentInertia, FrictionVelocity, Law, Role};
use crate::dynamics::Terms;
use crate::law::task::count_active;
use crate::math::linalg::Cholesky;
use crate::math::{Matrix, Vector, Vector3, abs};
use crate::model::friction::Friction;
use crate::model::pose::Pose;
use Effect::{Acceleration, Force, Reaction, Torque};

pub use crate::law::target::{PositionTarget, Posture, Target};
pub use crate::law::task::{
    MAX_TASK_INERTIA_KG_M2, MAX_TASK_MASS_KG, SINGULAR_BELOW_M, Task, singularity_damping_per_kg,
};
pub use crate::law::torques::Torques;

/// Inputs of the law besides the model and the task.
#[derive(Clone, Copy, Debug)]
pub struct LawInput<'a, T, const N: usize, const D: usize = 3> {
    /// Reference and gains of the tip.
    pub target: T,
    /// Joint velocities \[rad/s\].
    pub velocity_rad_per_s: &'a Vector<N>,
    /// Chosen inertia and measured force; `None` for the arm's own inertia.
    pub apparent: Option<ChosenInertia<D>>,
    /// Friction of the joints to feed forward, and the velocity at which it is evaluated.
    pub friction: Option<(&'a [Friction; N], FrictionVelocity)>,
    /// Joint velocities at which the Stribeck effect of active joints is evaluated \[rad/s\]; `None`: as the rest of the friction.
    pub stribeck_velocity_rad_per_s: Option<&'a Vector<N>>,
    /// Direction of each joint's dry friction, -1 to 1; `None`: the direction of the velocity.
    pub dry_direction: Option<&'a Vector<N>>,
    /// Share of the dry friction feed-forward to apply, 0 to 1. Joints with presliding have all of it while `held_friction` is given.
    pub friction_share: f64,
    /// Friction of an arm that is blocked.
    pub held_friction: Option<HeldFriction<'a, N>>,
    /// Adds `M Xo''`.
    pub inertial_feedforward: bool,
    /// Damping of each joint's motion in the null space \[N m s/rad\], zero or more.
    pub nullspace_damping_nm_s_per_rad: Vector<N>,
    /// Torque to apply in the null space, for example of a [`Posture`] \[N m\]; it does not act on held joints.
    pub nullspace_torque_nm: Option<&'a Vector<N>>,
}

impl<'a, T, const N: usize, const D: usize> LawInput<'a, T, N, D> {
    /// Creates inputs with the arm's own inertia and its feed-forward, without friction and without null-space torque.
    pub fn new(target: T, velocity_rad_per_s: &'a Vector<N>) -> Self {
        LawInput {
            target,
            velocity_rad_per_s,
            apparent: None,
            friction: None,
            stribeck_velocity_rad_per_s: None,
            dry_direction: None,
            friction_share: 1.0,
            held_friction: None,
            inertial_feedforward: true,
            nullspace_damping_nm_s_per_rad: Vector::zeros(),
            nullspace_torque_nm: None,
        }
    }
}

impl<'a, T, const N: usize> LawInput<'a, T, N> {
    /// Creates the inputs of the configured position law, with the friction of the joints and the measured force on
    /// the tip, base axes \[N\].
    #[inline(always)]
    pub fn of_law(
        law: &Law,
        friction: &'a [Friction; N],
        target: T,
        velocity_rad_per_s: &'a Vector<N>,
        tip_force_n: Option<Vector3<f64>>,
    ) -> Self {
        LawInput {
            apparent: match (law.inertia, tip_force_n) {
                (ApparentInertia::Chosen(mass), Some(force)) => ChosenInertia::new(&mass, force),
                _ => None,
            },
            friction: Some((friction, law.friction_velocity)),
            inertial_feedforward: law.inertial_feedforward,
            nullspace_damping_nm_s_per_rad: Vector::repeat(law.nullspace_damping_nm_s_per_rad),
            ..LawInput::new(target, velocity_rad_per_s)
        }
    }
}

/// Friction feed-forward of a blocked arm: joints at rest have no viscous friction, and their dry
/// friction keeps the value from when they came to rest, independent of the reference. Where presliding is known, only its
/// magnitude keeps that value; its direction is given.
#[derive(Clone, Copy, Debug)]
pub struct HeldFriction<'a, const N: usize> {
    /// Joint velocities of the reference when the arm was blocked \[rad/s\].
    pub velocity_rad_per_s: &'a Vector<N>,
    /// Fraction of the dry friction that is evaluated at these velocities, 0 to 1; the rest is evaluated at the reference.
    pub weight: f64,
    /// Share of the viscous friction to apply, 0 to 1.
    pub viscous_share: f64,
}

impl<const N: usize> HeldFriction<'_, N> {
    /// Returns the feed-forward of `joint` at `velocity_rad_per_s` with dry friction in the `direction` of the measured motion; offset
    /// and magnitude of the dry friction are given as long as nothing is kept \[N m\]. A joint that is known to move faster than its
    /// reference did keeps neither: more friction than it has would drive it. Requires presliding.
    fn in_direction_nm(
        &self,
        friction: &Friction,
        joint: usize,
        velocity_rad_per_s: f64,
        measured_rad_per_s: Option<f64>,
        (offset_nm, dry_nm): (f64, f64),
        direction: f64,
    ) -> f64 {
        let kept_rad_per_s = self.velocity_rad_per_s[joint];
        let is_faster =
            measured_rad_per_s.is_some_and(|measured| abs(measured) > abs(kept_rad_per_s));
        let kept_nm = match is_faster {
            true => (offset_nm, dry_nm),
            false => (
                friction.offset_at_nm(kept_rad_per_s),
                friction.dry_size_nm(kept_rad_per_s),
            ),
        };
        self.viscous_share * friction.viscous_torque_nm(velocity_rad_per_s)
            + (offset_nm + self.weight * (kept_nm.0 - offset_nm))
            + (dry_nm + self.weight * (kept_nm.1 - dry_nm)) * direction
    }

    /// Returns the offset of `joint`, which is `offset_nm` as long as nothing is kept.
    fn offset_nm(&self, friction: &Friction, joint: usize, offset_nm: f64) -> f64 {
        let kept_nm = friction.offset_at_nm(self.velocity_rad_per_s[joint]);
        offset_nm + self.weight * (kept_nm - offset_nm)
    }

    /// Returns the correction of the feed-forward of `joint` at `velocity_rad_per_s` \[N m\]; `share` is the applied fraction of
    /// its dry part `dry_nm`.
    fn difference_nm(
        &self,
        friction: &Friction,
        joint: usize,
        velocity_rad_per_s: f64,
        (offset_nm, dry_nm): (f64, f64),
        share: f64,
    ) -> f64 {
        let kept = friction.dry_torque_nm(self.velocity_rad_per_s[joint]) - dry_nm;
        let viscous_nm = friction.viscous_torque_nm(velocity_rad_per_s);
        share * self.weight * kept - (1.0 - self.viscous_share) * viscous_nm
            + (self.offset_nm(friction, joint, offset_nm) - offset_nm)
    }
}

/// The chosen inertia `M` of Eq. (3.3), with the measured tip force that the law then needs.
#[derive(Clone, Copy, Debug)]
pub struct ChosenInertia<const D: usize> {
    inertia: Cholesky<D>,
    force: Vector<D>,
}

impl<const D: usize> ChosenInertia<D> {
    /// Creates the chosen inertia from `inertia` \[kg, kg m^2\] and the force on the tip \[N, N m\], base axes. `None` if `inertia` is not
    /// positive definite.
    pub fn new(inertia: &Matrix<D, D>, force: Vector<D>) -> Option<Self> {
        Cholesky::new(inertia).map(|inertia| ChosenInertia { inertia, force })
    }
}

/// Returns the torque of each term of the law. Held joints have only the terms of the model.
#[inline(always)]
pub fn impedance<T: Target<D>, const N: usize, const D: usize>(
    roles: &[Role; N],
    terms: &Terms<N>,
    task: &Task<N, D>,
    input: &LawInput<'_, T, N, D>,
) -> Torques<N> {
    let tip = Tip {
        base_from_tip: terms.base_from_tip,
        velocity: terms.tip_velocity(input.velocity_rad_per_s),
        bias: Vector::from_fn(|i, _| terms.jacobian_dot_qd[i]),
    };
    let torques = Torques {
        gravity: terms.gravity,
        coriolis: terms.coriolis_gravity - terms.gravity,
        ..Torques::zeros()
    };
    let mut separate = SeparateTerms {
        task,
        mass_matrix: &terms.mass_matrix,
        torques,
    };
    add_law_terms(roles, task, &tip, input, &mut separate);
    separate.torques
}

/// State of the tip in the task's directions.
pub(super) struct Tip<const D: usize> {
    pub base_from_tip: Pose,
    /// `X'`.
    pub velocity: Vector<D>,
    /// `J' qd`.
    pub bias: Vector<D>,
}

/// Effect of a term.
pub(super) enum Effect<const N: usize, const D: usize> {
    /// Accelerates the tip: `H Jb a`.
    Acceleration(Vector<D>),
    /// Pushes the tip: `J^T f`.
    Force(Vector<D>),
    /// Adds an opposing force to the term's torque: `-J^T f`.
    Reaction(Vector<D>),
    /// Acts on the joints.
    Torque(Vector<N>),
}

/// Field of [`Torques`] that holds a term.
pub(super) type TermField<const N: usize> = fn(&mut Torques<N>) -> &mut Vector<N>;

/// Receiver of the law's terms.
pub(super) trait TermSink<const N: usize, const D: usize> {
    /// Adds a term.
    fn add(&mut self, term: TermField<N>, effect: Effect<N, D>);
}

/// Adds the terms of the law to `sink`, except those of the model: `G + C qd`.
#[inline(always)]
pub(super) fn add_law_terms<T: Target<D>, F: TermSink<N, D>, const N: usize, const D: usize>(
    roles: &[Role; N],
    task: &Task<N, D>,
    tip: &Tip<D>,
    input: &LawInput<'_, T, N, D>,
    sink: &mut F,
) {
    sink.add(|t| &mut t.jacobian_rate, Acceleration(-tip.bias));
    if input.inertial_feedforward {
        sink.add(
            |t| &mut t.inertial,
            Acceleration(input.target.acceleration()),
        );
    }
    let spring = input.target.spring(&tip.base_from_tip);
    let damper = input.target.damper(&tip.velocity);
    if let Some(ChosenInertia { inertia, force }) = &input.apparent {
        sink.add(|t| &mut t.stiffness, Acceleration(inertia.solve(&spring)));
        sink.add(|t| &mut t.damping, Acceleration(inertia.solve(&damper)));
        sink.add(|t| &mut t.force, Acceleration(inertia.solve(force)));
        sink.add(|t| &mut t.force, Reaction(*force));
    } else {
        sink.add(|t| &mut t.stiffness, Force(spring));
        sink.add(|t| &mut t.damping, Force(damper));
    }
    let is_active = |i: usize| roles[i] == Role::Active;
    if let Some((friction, at)) = input.friction {
        let reference = task.inverse * input.target.velocity();
        let feed_forward = |i: usize, _| {
            let velocity = match at {
                FrictionVelocity::Measured if is_active(i) => input.velocity_rad_per_s[i],
                _ => reference[i],
            };
            let measured = match input.stribeck_velocity_rad_per_s {
                Some(of) if is_active(i) => Some(of[i]),
                _ => None,
            };
            let stribeck_velocity = measured.unwrap_or(velocity);
            let (friction, share) = (&friction[i], input.friction_share);
            let size_nm = friction.dry_size_nm(stribeck_velocity);
            let direction = match input.dry_direction {
                Some(of) => of[i],
                None => friction.direction(velocity),
            };
            let dry_nm = size_nm * direction;
            let offset_nm = friction.offset_at_nm(stribeck_velocity);
            let torque_nm = friction.viscous_torque_nm(velocity) + offset_nm + dry_nm * share;
            match &input.held_friction {
                None => torque_nm,
                Some(held) if input.dry_direction.is_some() && friction.presliding_rad > 0.0 => {
                    let present = (offset_nm, size_nm);
                    held.in_direction_nm(friction, i, velocity, measured, present, direction)
                }
                Some(held) => {
                    let present = (offset_nm, dry_nm);
                    torque_nm + held.difference_nm(friction, i, velocity, present, share)
                }
            }
        };
        sink.add(|t| &mut t.friction, Torque(Vector::from_fn(feed_forward)));
    }
    if N > D && count_active(roles) > D {
        // The part of the joints' motion that moves the tip; the rest is null-space motion.
        let tip_motion = task.inverse * (task.jacobian * input.velocity_rad_per_s);
        let mut torque = Vector::zeros();
        for i in (0..N).filter(|i| is_active(*i)) {
            let free_motion = input.velocity_rad_per_s[i] - tip_motion[i];
            torque[i] = free_motion * -input.nullspace_damping_nm_s_per_rad[i];
        }
        if let Some(more) = input.nullspace_torque_nm {
            for i in (0..N).filter(|i| is_active(*i)) {
                torque[i] += more[i];
            }
        }
        sink.add(|t| &mut t.nullspace, Torque(torque));
        sink.add(|t| &mut t.nullspace, Reaction(task.inverse.tr_mul(&torque)));
    }
}

/// Keeps the torque of each term.
struct SeparateTerms<'a, const N: usize, const D: usize> {
    task: &'a Task<N, D>,
    mass_matrix: &'a Matrix<N, N>,
    torques: Torques<N>,
}

impl<const N: usize, const D: usize> TermSink<N, D> for SeparateTerms<'_, N, D> {
    #[inline(always)]
    fn add(&mut self, term: TermField<N>, effect: Effect<N, D>) {
        let (task, term) = (self.task, term(&mut self.torques));
        match effect {
            Acceleration(a) => *term = self.mass_matrix * (task.inverse * a),
            Force(force) => *term = task.jacobian.tr_mul(&force),
            Reaction(force) => *term -= task.jacobian.tr_mul(&force),
            Torque(torque) => *term = torque,
        }
    }
}
