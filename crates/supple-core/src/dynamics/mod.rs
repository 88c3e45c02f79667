//! Rigid-body dynamics of a serial arm: free functions over an immutable [`crate::Arm`].
//!
//! `aba`, `rnea` and `coriolis` recurse in joint frames, so that each joint rotates about z and precision does not
//! depend on how far the wrist is from the base; their accelerations are classical (of the frame's origin). `terms`,
//! `crba` and `momentum` work in base axes about the tip, `regressor` in base axes about the last joint, with spatial
//! accelerations. Gravity `g` enters as an acceleration `-g` of the base.
//!
//! Functions of the number of joints are marked `inline` only in builds without debug assertions: in others (`dev`, `test`) each
//! unit of each crate that calls one would compile it again (`sizes.rs`). So is `impedance_torque` of the law.

mod aba;
mod body_motion;
mod chain;
mod coriolis;
mod crba;
mod energy;
mod frames;
mod inertia;
pub mod inverse_kinematics;
mod kinematics;
mod momentum;
mod motion;
mod regressor;
mod rnea;
mod rotations;
mod sweep;
mod terms;

pub use aba::aba;
pub use coriolis::{coriolis, coriolis_matrix};
pub use crba::crba;
pub(crate) use crba::symmetric;
pub use energy::{kinetic_energy, potential_energy};
pub use kinematics::{jacobian, jacobian_dot_qd, joint_poses, tip_pose};
pub use momentum::{Momentum, momentum};
pub use regressor::{Regressor, parameters, regressor, regressor_rows, regressor_times};
pub use rnea::{gravity, rnea};
pub(crate) use sweep::Sweep;

pub use terms::{Terms, terms};
