//! The impedance law for the tip's position or pose, with its task, targets and torque terms.

mod consistent_inverse;
pub mod impedance;
pub mod learned;
mod sum;
pub mod target;
pub mod task;
pub mod torques;

pub use sum::impedance_torque;
