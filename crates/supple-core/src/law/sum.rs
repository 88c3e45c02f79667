//! The sum of the law's terms, from the joint angles on: as [`super::impedance`] by terms, but for
//! rounding.

use super::impedance::{Effect, Form, LawInput, Place, Tip, act};
use super::target::Target;
use super::task::{Task, count_active, square_task};
use crate::config::Role;
use crate::dynamics::{Sweep, Terms, fill};
use crate::math::Vector;
use crate::math::lanes::{in_groups, joint_values, per_joint};
use crate::model::arm::Arm;
use core::array::from_fn;

/// The law's joint torques as one sum \[N m\]. `q` \[rad\].
///
/// Three joints, all active and away from singular poses, take a shorter way: `J^-1` gives their
/// accelerations and inverse dynamics the torques, without a mass matrix.
///
/// `None` if the mass matrix of the active joints is not positive definite (not tested on the shorter
/// way), or if fewer than six joints are active for a pose.
#[cfg_attr(not(debug_assertions), inline)]
pub fn impedance_torque<T: Target<D>, const N: usize, const D: usize>(
    arm: &Arm<N>,
    roles: &[Role; N],
    q: &Vector<N>,
    now: &LawInput<'_, T, N, D>,
) -> Option<Vector<N>> {
    const { assert!(N >= D, "a task takes a joint for each direction") };
    in_groups!(N, torque[T, D](arm, roles, q, now))
}

#[inline(always)]
fn torque<T: Target<D>, const D: usize, const N: usize, const G: usize>(
    arm: &Arm<N>,
    roles: &[Role; N],
    q: &Vector<N>,
    now: &LawInput<'_, T, N, D>,
) -> Option<Vector<N>> {
    let sweep = Sweep::<G>::new(arm, q, now.velocity_rad_per_s);
    if N == 3 && D == 3 && count_active(roles) == 3 {
        let columns = from_fn(|i| {
            let [x, y, z, ..] = joint_values(&sweep.motions, i);
            [x, y, z]
        });
        let Some(task) = square_task(columns) else {
            return near_singular::<T, D, N, G>(arm, roles, q, now);
        };
        let bias = first(sweep.tip_bias_acceleration::<N>());
        let sum = Sum::new(roles, &task, &sweep, bias, now);
        let qdd = task.inverse * sum.acceleration;
        let force = task.jacobian.tr_mul(&sum.force);
        let torque = per_joint(&sweep.inverse_dynamics(arm, &qdd.data.0[0]));
        return Some(Vector::from(torque) + force + sum.torque);
    }
    by_mass_matrix(arm, roles, &sweep, now)
}

/// Any number of joints, by the mass matrix.
#[inline(always)]
fn by_mass_matrix<T: Target<D>, const D: usize, const N: usize, const G: usize>(
    arm: &Arm<N>,
    roles: &[Role; N],
    sweep: &Sweep<G>,
    now: &LawInput<'_, T, N, D>,
) -> Option<Vector<N>> {
    let mut terms = Terms::default();
    fill(sweep, arm, now.velocity_rad_per_s, &mut terms);
    let task = Task::from_terms(&terms, roles)?;
    let bias = terms.jacobian_dot_qd.fixed_rows::<D>(0).into_owned();
    let sum = Sum::new(roles, &task, sweep, bias, now);
    let inertial = terms.mass_matrix * (task.inverse * sum.acceleration);
    let force = task.jacobian.tr_mul(&sum.force);
    Some(terms.coriolis_gravity + inertial + force + sum.torque)
}

/// Not inlined: this way is rare for three joints, and inlining it would slow down the common one.
#[cold]
#[inline(never)]
fn near_singular<T: Target<D>, const D: usize, const N: usize, const G: usize>(
    arm: &Arm<N>,
    roles: &[Role; N],
    q: &Vector<N>,
    now: &LawInput<'_, T, N, D>,
) -> Option<Vector<N>> {
    let sweep = Sweep::<G>::new(arm, q, now.velocity_rad_per_s);
    by_mass_matrix(arm, roles, &sweep, now)
}

/// The first `D` of six numbers.
#[inline(always)]
fn first<const D: usize>(six: [f64; 6]) -> Vector<D> {
    Vector::from_fn(|k, _| six[k])
}

/// The terms added up before they are mapped to the joints.
struct Sum<const N: usize, const D: usize> {
    acceleration: Vector<D>,
    force: Vector<D>,
    torque: Vector<N>,
}

impl<const N: usize, const D: usize> Sum<N, D> {
    #[inline(always)]
    fn new<T: Target<D>, const G: usize>(
        roles: &[Role; N],
        task: &Task<N, D>,
        sweep: &Sweep<G>,
        bias: Vector<D>,
        now: &LawInput<'_, T, N, D>,
    ) -> Self {
        let tip = Tip {
            base_from_tip: sweep.chain.tip.pose(),
            velocity: first(sweep.motion.tip_rate::<N>()),
            bias,
        };
        let mut sum = Sum {
            acceleration: Vector::zeros(),
            force: Vector::zeros(),
            torque: Vector::zeros(),
        };
        act(roles, task, &tip, now, &mut sum);
        sum
    }
}

impl<const N: usize, const D: usize> Form<N, D> for Sum<N, D> {
    #[inline(always)]
    fn add(&mut self, _: Place<N>, effect: Effect<N, D>) {
        match effect {
            Effect::Acceleration(a) => self.acceleration += a,
            Effect::Force(force) => self.force += force,
            Effect::Reaction(force) => self.force -= force,
            Effect::Torque(torque) => self.torque += torque,
        }
    }
}
