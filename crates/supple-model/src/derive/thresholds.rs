//! Thresholds of force, from the weight of the arm as it is felt at the tip and from the torque limits.
//!
//! The error of a gravity model is a share of the arm's weight: the force at the tip that carries the gravity torques of
//! the active joints is the measure of what a wrong model looks like there.

use super::derived::rounded;
use super::place::tip_weight_n;
use super::write::{Writer, list};
use crate::description::Description;
use supple_core::dynamics::{Terms, jacobian, terms};
use supple_core::nalgebra::SymmetricEigen;
use supple_core::task::Task;
use supple_core::{Config, Vector};

/// Force of an unmodelled load as a share of that weight, and its smallest value \[N\].
const LOAD: (f64, f64) = (0.05, 5.0);
/// Contact threshold as a share of that weight, and its smallest value \[N\].
const CONTACT: (f64, f64) = (0.02, 3.0);
/// Collision threshold as a share of the force that the torque limits allow, and its range \[N\].
const COLLISION: (f64, f64, f64) = (0.5, 10.0, 60.0);

/// Stiffness for which the damping of the law is derived \[N/m\], its damping ratio, and its smallest value \[N s/m\].
const LAW: (f64, f64, f64) = (5.0, 0.7, 1.5);
/// Torque against the motion over the torque limit that is a fault: at least, at most, and as a multiple of the share that
/// dry friction has.
const AGAINST: (f64, f64, f64) = (0.05, 0.5, 1.5);

/// Adds the damping of the law.
pub(super) fn add_damping<const N: usize>(
    writer: &mut Writer,
    config: &Config<N>,
    home: &Vector<N>,
) {
    let (stiffness, ratio, min) = LAW;
    let mass_kg = tip_mass_kg(config, home);
    let damping = 2.0 * ratio * supple_core::math::sqrt(stiffness * mass_kg);
    let damping = rounded(damping.max(min).min(config.limits.damping_n_s_per_m));
    let why = format!(
        "damping ratio 0.7 at 5 N/m with the {mass_kg:.1} kg that the tip has at home along its heaviest direction, \
         rotors included"
    );
    writer.set(
        "law",
        "stiffness_n_per_m",
        list(&[stiffness; 3]),
        "as in the paper",
    );
    writer.set("law", "damping_n_s_per_m", list(&[damping; 3]), &why);
}

/// Returns the greatest mass of the tip over all directions \[kg\].
fn tip_mass_kg<const N: usize>(config: &Config<N>, q: &Vector<N>) -> f64 {
    let mut state = Terms::default();
    terms(&config.arm, q, &Vector::zeros(), &mut state);
    let Some(task) = Task::new(&state, &config.roles) else {
        return 0.0;
    };
    // Held joints do not move: the mass that the active joints alone have.
    let mass = task.inverse.transpose() * state.mass_matrix * task.inverse;
    SymmetricEigen::new(0.5 * (mass + mass.transpose()))
        .eigenvalues
        .max()
}

/// Adds the thresholds.
pub(super) fn add<const N: usize>(
    writer: &mut Writer,
    config: &Config<N>,
    description: &Description,
) {
    let home = Vector::<N>::from_column_slice(description.home_rad());
    let weight_n = tip_weight_n(config, &home);
    let (min, max, friction) = AGAINST;
    let shares = (0..N).map(|i| config.friction[i].breakaway_nm / config.limits.joint_torque_nm[i]);
    let against = (friction * shares.fold(0.0, f64::max)).clamp(min, max);
    let why = "one and a half times the largest share of a torque limit that dry friction has, at least 0.05";
    writer.set("plausible", "against_share", rounded(against), why);
    let why = format!(
        "5 % of the tip weight at home, {weight_n:.0} N, at least 5 N; it is the force at the tip that carries the arm"
    );
    let load_n = rounded((LOAD.0 * weight_n).max(LOAD.1));
    writer.set("plausible", "load_n", load_n, &why);
    let why = "2 % of the tip weight at home, at least 3 N";
    let contact_n = rounded((CONTACT.0 * weight_n).max(CONTACT.1));
    writer.set("latch", "threshold_n", contact_n, why);
    let rows = jacobian(&config.arm, &home);
    // Along the weakest base axis the weakest joint limits the force.
    let force = |axis: usize| {
        let joints =
            (0..N).map(|i| config.limits.joint_torque_nm[i] / rows[(axis, i)].abs().max(1e-9));
        joints.fold(f64::MAX, f64::min)
    };
    let possible_n = force(0).min(force(1)).min(force(2));
    let (share, min, max) = COLLISION;
    let collision_n = (share * possible_n).clamp(min, max).max(2.0 * load_n);
    let why = "half of what the torque limits can press along the weakest axis, 10 to 60 N";
    writer.set("collision", "tip_force_n", rounded(collision_n), why);
}
