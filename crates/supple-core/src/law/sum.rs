//! The sum of the law's terms, computed from the joint angles: equal to the sum of the terms of [`super::impedance`], except for
//! rounding.

use super::impedance::{Effect, LawInput, TermField, TermSink, Tip, add_law_terms};
use super::target::Target;
use super::task::{Task, count_active, square_task};
use crate::config::Role;
use crate::dynamics::{Sweep, symmetric};
use crate::math::lanes::{in_groups, joint_values, per_joint};
use crate::math::{Matrix, Vector};
use crate::model::arm::Arm;
use core::array::from_fn;

/// Returns the law's joint torques as one sum \[N m\]; `q` are the joint angles \[rad\].
///
/// For an arm of three joints, all active and away from singular poses, a shorter computation applies: `J^-1` gives the joint
/// accelerations, and inverse dynamics the torques, without a mass matrix.
///
/// Returns `None` if the mass matrix of the active joints is not positive definite (the shorter computation does not test it), or
/// if fewer than six joints are active for a pose.
#[cfg_attr(not(debug_assertions), inline)]
pub fn impedance_torque<T: Target<D>, const N: usize, const D: usize>(
    arm: &Arm<N>,
    roles: &[Role; N],
    q: &Vector<N>,
    input: &LawInput<'_, T, N, D>,
) -> Option<Vector<N>> {
    const { assert!(N >= D, "a task takes a joint for each direction") };
    in_groups!(N, torque[T, D](arm, roles, q, input))
}

#[inline(always)]
fn torque<T: Target<D>, const D: usize, const N: usize, const G: usize>(
    arm: &Arm<N>,
    roles: &[Role; N],
    q: &Vector<N>,
    input: &LawInput<'_, T, N, D>,
) -> Option<Vector<N>> {
    let sweep = Sweep::<G>::new(arm, q, input.velocity_rad_per_s);
    if N == 3 && D == 3 && count_active(roles) == 3 {
        let columns = from_fn(|i| {
            let [x, y, z, ..] = joint_values(&sweep.motions, i);
            [x, y, z]
        });
        let Some(task) = square_task(columns) else {
            return near_singular::<T, D, N, G>(arm, roles, q, input);
        };
        let bias = first(sweep.tip_bias_acceleration::<N>());
        let sum = TermSum::new(roles, &task, &sweep, bias, input);
        let qdd = task.inverse * sum.acceleration;
        let force = task.jacobian.tr_mul(&sum.force);
        let torque = per_joint(&sweep.inverse_dynamics(arm, &qdd.data.0[0]));
        return Some(Vector::from(torque) + force + sum.torque);
    }
    by_mass_matrix(arm, roles, &sweep, input)
}

/// Computes the torques of any number of joints with the mass matrix.
#[inline(always)]
fn by_mass_matrix<T: Target<D>, const D: usize, const N: usize, const G: usize>(
    arm: &Arm<N>,
    roles: &[Role; N],
    sweep: &Sweep<G>,
    input: &LawInput<'_, T, N, D>,
) -> Option<Vector<N>> {
    let columns = sweep.mass(arm);
    let task = Task::from_sweep(sweep, columns, roles)?;
    let bias = first(sweep.tip_bias_acceleration::<N>());
    let sum = TermSum::new(roles, &task, sweep, bias, input);
    let mass_matrix: Matrix<N, N> = symmetric(&columns);
    let inertial = mass_matrix * (task.inverse * sum.acceleration);
    let force = task.jacobian.tr_mul(&sum.force);
    let coriolis_gravity = Vector::from(per_joint(&sweep.projection().torque));
    Some(coriolis_gravity + inertial + force + sum.torque)
}

/// Is not inlined: this branch is rare for three joints, and inlining it would slow down the common branch.
#[cold]
#[inline(never)]
fn near_singular<T: Target<D>, const D: usize, const N: usize, const G: usize>(
    arm: &Arm<N>,
    roles: &[Role; N],
    q: &Vector<N>,
    input: &LawInput<'_, T, N, D>,
) -> Option<Vector<N>> {
    let sweep = Sweep::<G>::new(arm, q, input.velocity_rad_per_s);
    by_mass_matrix(arm, roles, &sweep, input)
}

/// Returns the first `D` of six numbers.
#[inline(always)]
fn first<const D: usize>(six: [f64; 6]) -> Vector<D> {
    Vector::from_fn(|k, _| six[k])
}

/// The terms added up before they are mapped to the joints.
struct TermSum<const N: usize, const D: usize> {
    acceleration: Vector<D>,
    force: Vector<D>,
    torque: Vector<N>,
}

impl<const N: usize, const D: usize> TermSum<N, D> {
    #[inline(always)]
    fn new<T: Target<D>, const G: usize>(
        roles: &[Role; N],
        task: &Task<N, D>,
        sweep: &Sweep<G>,
        bias: Vector<D>,
        input: &LawInput<'_, T, N, D>,
    ) -> Self {
        let tip = Tip {
            base_from_tip: sweep.chain.tip.pose(),
            velocity: first(sweep.motion.tip_rate::<N>()),
            bias,
        };
        let mut sum = TermSum {
            acceleration: Vector::zeros(),
            force: Vector::zeros(),
            torque: Vector::zeros(),
        };
        add_law_terms(roles, task, &tip, input, &mut sum);
        sum
    }
}

impl<const N: usize, const D: usize> TermSink<N, D> for TermSum<N, D> {
    #[inline(always)]
    fn add(&mut self, _: TermField<N>, effect: Effect<N, D>) {
        match effect {
            Effect::Acceleration(a) => self.acceleration += a,
            Effect::Force(force) => self.force += force,
            Effect::Reaction(force) => self.force -= force,
            Effect::Torque(torque) => self.torque += torque,
        }
    }
}
