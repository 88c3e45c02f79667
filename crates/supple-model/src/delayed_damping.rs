//! Check for joint damping that is unstable in some pose because of the delay of the loop.
//!
//! With a delayed velocity, damping `D` of joints with mass matrix `H` is stable while the greatest eigenvalue of
//! `H^-1 D` times the delay stays below `pi/2`. The core reduces the gains of moves and of soft stops by pose, but applies the
//! gains of gravity hold and of held joints unchanged: gravity hold must be stable in any pose, held joints with their joints at
//! their angles.

use crate::description::Description;
use crate::error::ModelError;
use crate::identified::put;
use crate::poses::pose_rad;
use core::f64::consts::FRAC_PI_2;
use nalgebra::{DMatrix, SymmetricEigen};
use supple_core::config::Role;
use supple_core::controller::ConfigError;
use supple_core::dynamics::crba;
use supple_core::{Config, Controller, Matrix, Vector};
use toml_edit::value;

/// Maximum damping rate times delay at a lower control rate: three quarters of the limit.
const MARGIN: f64 = 0.75 * FRAC_PI_2;
/// Minimum factor by which gains are reduced: if a smaller factor were needed, an inertia would be wrong.
const MIN_SHARE: f64 = 0.3;
/// Number of poses.
const POSES: u32 = 100;
const MUST: &str = "less: with the delay of this loop it shakes the joint in poses where the arm has little inertia";

impl Description {
    /// Rejects damping of gravity hold and of held joints that is unstable in one of the poses.
    pub(crate) fn check_damping<const N: usize>(&self) -> Result<(), ModelError> {
        let controller = Controller::new(self.config::<N>()?).map_err(|e| self.rejected(&e))?;
        let rates = rates_times_delay(&controller);
        match rates.iter().find(|(_, rate)| *rate > FRAC_PI_2) {
            Some((error, _)) => Err(self.rejected(error)),
            None => Ok(()),
        }
    }

    /// Returns the factors, at most 1, of the damping of gravity hold and of held joints that keep the margin at the arm's
    /// control rate.
    pub(crate) fn allowed_damping_shares<const N: usize>(&self) -> [f64; 2] {
        let config = self.config::<N>().ok();
        let controller = config.and_then(|config| Controller::new(config).ok());
        controller.map_or([1.0; 2], |controller| {
            rates_times_delay(&controller)
                .map(|(_, rate_times_delay)| (MARGIN / rate_times_delay).min(1.0))
        })
    }

    /// Returns the same arm with the damping of gravity hold and the gains of held joints reduced in its TOML as far as its
    /// inertias and the delay of the loop require, including a margin; and both factors, which are 1 for unchanged gains.
    ///
    /// # Errors
    /// The error of [`Description::completed`] if a factor were less than 0.3, because then an inertia is wrong; any
    /// [`ModelError`] of the edited text.
    pub fn with_stable_damping<const N: usize>(
        &self,
    ) -> Result<(Description, [f64; 2]), ModelError> {
        let shares = self.allowed_damping_shares::<N>();
        if shares == [1.0; 2] {
            return Ok((self.clone(), shares));
        }
        if shares.iter().any(|share| *share < MIN_SHARE) {
            self.check_damping::<N>()?;
        }
        let mut document = self.document()?;
        let mut reduced = self.clone();
        reduced.reduce_damping(shares);
        for (joint, of) in reduced.joints.iter().enumerate() {
            let table = self.joint_table(&mut document, joint)?;
            if shares[0] < 1.0 {
                let damping = of.gains.hold_damping_nm_s_per_rad;
                put(table, "hold_damping_nm_s_per_rad", damping.into());
            }
            if shares[1] == 1.0 {
                continue;
            }
            let held = table
                .get_mut("held")
                .and_then(|held| held.as_table_like_mut());
            if let (Some(held), Some(loops)) = (held, &of.held) {
                held.insert("stiffness_nm_per_rad", value(loops.stiffness_nm_per_rad));
                held.insert("damping_nm_s_per_rad", value(loops.damping_nm_s_per_rad));
            }
        }
        let reduced = Description::from_text(&document.to_string(), self.urdf())?;
        Ok((reduced, shares))
    }

    /// Multiplies the damping of gravity hold, and the gains of held joints, by these factors.
    pub(crate) fn reduce_damping(&mut self, [hold, held]: [f64; 2]) {
        for joint in &mut self.joints {
            joint.gains.hold_damping_nm_s_per_rad *= hold;
            if let Some(loops) = &mut joint.held {
                loops.stiffness_nm_per_rad *= held;
                loops.damping_nm_s_per_rad *= held;
            }
        }
    }
}

/// Returns the largest damping rate times delay over the poses, of gravity hold and of the held joints, each with the joint that
/// has the largest motion in it.
fn rates_times_delay<const N: usize>(controller: &Controller<N>) -> [(ConfigError, f64); 2] {
    let config = controller.config();
    let held = Vector::<N>::from_fn(|joint, _| match config.roles[joint] {
        Role::Active => 0.0,
        Role::Held {
            damping_nm_s_per_rad,
            ..
        } => damping_nm_s_per_rad,
    });
    let entries = [
        (
            "hold_damping_nm_s_per_rad",
            config.hold_damping_nm_s_per_rad,
            false,
        ),
        ("held damping_nm_s_per_rad", held, true),
    ];
    entries.map(|(entry, damping, in_place)| {
        let mut largest = (0, 0.0);
        for number in 0..POSES {
            let mut pose = pose_rad(config, number);
            for (joint, role) in config.roles.iter().enumerate() {
                if let (Role::Held { position_rad, .. }, true) = (role, in_place) {
                    pose[joint] = *position_rad;
                }
            }
            let Some((joint, rate_per_s)) = fastest(config, &damping, &pose) else {
                continue;
            };
            if rate_per_s > largest.1 {
                largest = (joint, rate_per_s);
            }
        }
        let (joint, rate_per_s) = largest;
        let error = ConfigError {
            entry,
            joint: Some(joint),
            value: damping[joint],
            must: MUST,
        };
        (error, rate_per_s * controller.delay_s())
    })
}

/// Returns the rate of the motion that this damping slows fastest in a pose \[1/s\], and the joint that moves most in it.
fn fastest<const N: usize>(
    config: &Config<N>,
    damping: &Vector<N>,
    pose_rad: &Vector<N>,
) -> Option<(usize, f64)> {
    let inverse = crba(&config.arm, pose_rad).try_inverse()?;
    let root = damping.map(f64::sqrt);
    let rates = Matrix::<N, N>::from_fn(|i, j| root[i] * inverse[(i, j)] * root[j]);
    // A matrix of variable size has an eigenvalue solver for any number of joints.
    let rates = DMatrix::from_column_slice(N, N, rates.as_slice());
    let eigen = SymmetricEigen::new(rates);
    let (motion, rate_per_s) = eigen.eigenvalues.argmax();
    Some((eigen.eigenvectors.column(motion).iamax(), rate_per_s))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The gains of a held joint with a light rotor are reduced, so that a controller accepts the arm; other arms are unchanged.
    #[test]
    fn gains_of_a_held_joint_are_reduced_to_its_inertia() {
        let wam4 = Description::asset("wam4").expect("built in");
        let (same, shares) = wam4.with_stable_damping::<4>().expect("stable");
        assert_eq!((same.toml(), shares), (wam4.toml(), [1.0; 2]));

        let light = wam4
            .toml()
            .replace("armature_kg_m2 = 0.06691", "armature_kg_m2 = 0.03");
        assert_ne!(light, wam4.toml());
        let light = Description::from_text(&light, wam4.urdf()).expect("a description");
        let refused = light.completed().expect_err("it shakes").to_string();
        assert!(refused.contains("joint3"), "{refused}");
        let (reduced, [_, held]) = light.with_stable_damping::<4>().expect("reduced");
        assert!((0.1..0.9).contains(&held), "{held}");
        reduced.completed().expect("a controller takes it");
        let gains = |of: &Description| of.config::<4>().expect("four joints").roles[2];
        match (gains(&light), gains(&reduced)) {
            (
                Role::Held {
                    stiffness_nm_per_rad: before,
                    damping_nm_s_per_rad: damped,
                    ..
                },
                Role::Held {
                    stiffness_nm_per_rad: after,
                    damping_nm_s_per_rad: less,
                    ..
                },
            ) => {
                assert!((after - held * before).abs() < 1e-9);
                assert!((less - held * damped).abs() < 1e-9);
            }
            other => panic!("{other:?}"),
        }
    }

    /// The built-in arms keep three quarters of the limit.
    #[test]
    fn built_in_arms_keep_a_margin() {
        fn margin<const N: usize>(name: &str) {
            let config = Description::asset(name).and_then(|arm| arm.config::<N>());
            let controller = Controller::new(config.expect(name)).expect(name);
            for (error, rate_times_delay) in rates_times_delay(&controller) {
                let allowed = 0.75 * FRAC_PI_2;
                assert!(
                    rate_times_delay < allowed,
                    "{name}: {error}: {rate_times_delay}"
                );
            }
        }
        margin::<3>("wam3");
        margin::<4>("wam4");
        margin::<7>("wam7");
        margin::<3>("paper3");
        margin::<7>("openarm");
        margin::<6>("yam");
    }
}
