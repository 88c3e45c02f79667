//! Gains of the joint loops, from the mass matrix over the workspace and the delay of the loop.
//!
//! Let `H(q) >= diag(m)` in every pose, `m_i = d_i / l` with `d_i` the smallest inertia that joint `i` has alone, `1 / (H^-1)_ii`,
//! and `l` the greatest eigenvalue of `H^-1 diag(d)`. With `D = r diag(m)` and `K = w^2 diag(m)` no mode of the arm is damped
//! faster than `r` or stiffer than `w`, in no pose. A loop whose velocity arrives `t` late is stable for `r t < pi / 2`;
//! here `r t = 0.4`, and `w = r / 2` makes the fastest mode critically damped, all others more. Half of an estimated rotor
//! inertia is left out of `H`: the loop stays stable if the rotor is that much lighter.

use super::derived::rounded;
use super::inertia::{POSES, max_inertia_kg_m2};
use super::write::Writer;
use crate::poses::pose_rad;
use supple_core::dynamics::{crba, gravity};
use supple_core::nalgebra::SymmetricEigen;
use supple_core::{Config, Controller, Matrix, Vector};

/// Damping rate times delay of the position loops.
const DAMPING_TIMES_DELAY: f64 = 0.4;
/// Stiffness of the position loops: at most this share of the torque limit at an error of one radian.
const TORQUE_PER_RAD: f64 = 10.0;
/// Stiffness of the soft stops over that of the position loops, at most.
const SOFT_OVER_MOVE: f64 = 2.0;
/// Damping of gravity hold over that of the position loops.
const HOLD_OVER_MOVE: f64 = 0.25;
/// Full torque in this time \[s\].
const FULL_TORQUE_S: f64 = 0.05;
/// Bandwidth of the velocity estimator \[rad/s\], and its product with the period at slower rates.
const ESTIMATOR: (f64, f64) = (500.0, 0.5);
/// Acceleration and jerk of moves: at most these \[rad/s^2\], and the ratio of jerk to acceleration \[1/s\].
const ACCELERATION: (f64, f64) = (20.0, 50.0);
/// Least acceleration of moves \[rad/s^2\].
const MIN_ACCELERATION: f64 = 2.0;

/// Gains of each joint.
pub(super) struct Gains<const N: usize> {
    pub stiffness: Vector<N>,
    pub damping: Vector<N>,
    soft_stiffness: Vector<N>,
    torque_rate: Vector<N>,
    acceleration: Vector<N>,
    estimator: f64,
    delay_s: f64,
}

impl<const N: usize> Gains<N> {
    pub fn of(config: &Config<N>) -> Self {
        let (bandwidth, product) = ESTIMATOR;
        let estimator = bandwidth.min(product / config.period_s);
        let with_estimator = Config {
            estimator_rad_per_s: estimator,
            ..*config
        };
        // The delay is that of the controller, which a valid configuration has.
        let delay_s = Controller::new(with_estimator).map_or(0.01, |found| found.delay_s());
        let rate = DAMPING_TIMES_DELAY / delay_s;
        let min_kg_m2 = min_inertia_kg_m2(config);
        let torque_nm = config.limits.joint_torque_nm;
        let stiffness = Vector::from_fn(|i, _| {
            let stable = min_kg_m2[i] * 0.25 * rate * rate;
            rounded(stable.min(TORQUE_PER_RAD * torque_nm[i]))
        });
        let max_kg_m2 = max_inertia_kg_m2(config);
        let weight = max_gravity_nm(config);
        Gains {
            damping: Vector::from_fn(|i, _| rounded(min_kg_m2[i] * rate)),
            soft_stiffness: Vector::from_fn(|i, _| {
                let at_stop = 0.5 * torque_nm[i] / config.limits.soft_zone_rad;
                rounded(at_stop.min(SOFT_OVER_MOVE * stiffness[i]))
            }),
            torque_rate: torque_nm.map(|limit| rounded((limit / FULL_TORQUE_S).min(1e6))),
            acceleration: Vector::from_fn(|i, _| {
                let spare = (0.9 * torque_nm[i] - weight[i]).max(0.0);
                let possible = 0.5 * spare / max_kg_m2[i];
                rounded(possible.clamp(MIN_ACCELERATION, ACCELERATION.0))
            }),
            stiffness,
            estimator: rounded(estimator),
            delay_s,
        }
    }

    pub fn add(&self, writer: &mut Writer) {
        let delay_ms = 1e3 * self.delay_s;
        writer.set(
            "",
            "estimator_rad_per_s",
            self.estimator,
            "half of a radian per cycle, at most 500",
        );
        let damping =
            format!("damping rate times delay ({delay_ms:.1} ms) is 0.4, stable below 1.57");
        for i in 0..N {
            let mut put = |key: &str, value: f64, why: &str| {
                writer.joint(i, key, value, why);
            };
            put(
                "torque_rate_nm_per_s",
                self.torque_rate[i],
                "full torque in 50 ms",
            );
            put(
                "soft_stiffness_nm_per_rad",
                self.soft_stiffness[i],
                "half of the torque limit at the stop, at most twice the move's",
            );
            put(
                "soft_damping_nm_s_per_rad",
                self.damping[i],
                "as in the move mode",
            );
            put(
                "move_stiffness_nm_per_rad",
                self.stiffness[i],
                "critical with this damping for the smallest inertia in the workspace",
            );
            put("move_damping_nm_s_per_rad", self.damping[i], &damping);
            put(
                "acceleration_rad_per_s2",
                self.acceleration[i],
                "half of what nine tenths of the torque limit leave above gravity",
            );
            let jerk = rounded(ACCELERATION.1 * self.acceleration[i]);
            put("jerk_rad_per_s3", jerk, "full acceleration in 20 ms");
            let hold = rounded(HOLD_OVER_MOVE * self.damping[i]);
            put(
                "hold_damping_nm_s_per_rad",
                hold,
                "a quarter of the move mode's",
            );
        }
    }
}

/// Returns `m` of the module's description \[kg m^2\].
fn min_inertia_kg_m2<const N: usize>(config: &Config<N>) -> Vector<N> {
    let inverses: Vec<Matrix<N, N>> = (0..POSES)
        .filter_map(|pose| {
            let mut mass = crba(&config.arm, &pose_rad(config, pose));
            for i in 0..N {
                mass[(i, i)] -= 0.5 * config.arm.armature()[i];
            }
            mass.cholesky().map(|factor| factor.inverse())
        })
        .collect();
    let mut alone = Vector::<N>::repeat(f64::MAX);
    for inverse in &inverses {
        alone = Vector::from_fn(|i, _| alone[i].min(1.0 / inverse[(i, i)]));
    }
    let mut most: f64 = 1.0;
    let root = Matrix::<N, N>::from_diagonal(&alone.map(supple_core::math::sqrt));
    for inverse in &inverses {
        let coupled = nalgebra::DMatrix::from_fn(N, N, |i, j| (root * inverse * root)[(i, j)]);
        most = most.max(SymmetricEigen::new(coupled).eigenvalues.max());
    }
    alone / most
}

/// Returns the greatest gravity torque of each joint over its poses \[N m\].
pub(super) fn max_gravity_nm<const N: usize>(config: &Config<N>) -> Vector<N> {
    let mut max = Vector::<N>::zeros();
    for pose in 0..POSES {
        let torque_nm = gravity(&config.arm, &pose_rad(config, pose));
        max = Vector::from_fn(|i, _| max[i].max(torque_nm[i].abs()));
    }
    max
}
