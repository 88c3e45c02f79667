//! Samples of a run for figures, from the start of the trajectory: every cycle of a probing run, every tenth
//! cycle of the others.

use serde::Serialize;
use supple_core::Output;

/// Torques of one joint \[N m\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct JointTorque {
    /// `G`.
    pub gravity: f64,
    /// `D`.
    pub friction: f64,
    /// Velocity products and `M Xo''` together.
    pub inertial: f64,
    /// `K` and `B` together: the paper's PD torque.
    pub feedback: f64,
}

impl JointTorque {
    /// Returns the torque terms of joint `i`.
    pub fn of<const N: usize>(output: &Output<N>, i: usize) -> JointTorque {
        let t = &output.torques;
        JointTorque {
            gravity: t.gravity[i],
            friction: t.friction[i],
            inertial: t.coriolis[i] + t.jacobian_rate[i] + t.inertial[i],
            feedback: t.stiffness[i] + t.damping[i],
        }
    }
}

/// One sample.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Sample {
    /// Time since the start of the trajectory \[s\].
    pub time_s: f64,
    /// Reference position of the tip, base axes \[m\].
    pub reference_m: [f64; 3],
    /// True position of the tip, base axes \[m\].
    pub tip_m: [f64; 3],
    /// Torques of the second and third active joints: shoulder pitch and elbow.
    pub torques: [JointTorque; 2],
    /// Filtered force on the tip along base z \[N\].
    pub force_n: f64,
    /// Whether contact is latched.
    pub in_contact: bool,
}

/// Samples of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Trace {
    /// The samples, in order of time.
    pub samples: Vec<Sample>,
}

/// Returns the base coordinates as an array.
pub(crate) fn xyz(v: &supple_core::nalgebra::Vector3<f64>) -> [f64; 3] {
    [v.x, v.y, v.z]
}
