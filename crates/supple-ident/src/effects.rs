//! Effects of a real arm besides its links and the friction of its joints.
//!
//! ```text
//! tau += k_j (q_j)                                  spring over joint j: hoses and wires
//!      + c_m r_m^T p(r_m qd / delta)                dry friction of motor m, r_m its row of j2mp over its largest entry
//!      + b_m r_m^T r_m qd                           viscous friction of motor m
//!      - C_j (dG / dq_j) G_j                        compliance C_j between the encoder of joint j and its link
//!      + t_x dG / dt_x + t_y dG / dt_y              gravity turned by a small rotation t: the base is tilted
//!      + s_j (Y_j p)                                a motor that gives 1 / (1 + s_j) of the torque that it is commanded
//! ```
//!
//! Motor friction equals joint friction unless a motor drives several joints: only these motors have columns. `G` and `Y p` are
//! those of the nominal arm; a relative error of some per cent in them gives the same relative error of the small effect. The
//! common part of `s` of all motors is contained in the parameters of the links.

use nalgebra::DMatrix;

/// Selection of the effects to identify.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Effects {
    /// Springs over the joints.
    pub springs: bool,
    /// Tilt of the base.
    pub tilt: bool,
    /// Compliance of the joints.
    pub compliance: bool,
    /// Torque scale of each joint.
    pub torque_scale: bool,
    /// `j2mp`, (motors, joints): friction of the motors that drive several joints.
    pub motor_from_joint: Option<DMatrix<f64>>,
}

impl Effects {
    /// Returns all effects, for an arm with this `j2mp`.
    pub fn all(motor_from_joint: DMatrix<f64>) -> Effects {
        Effects {
            springs: true,
            tilt: true,
            compliance: true,
            torque_scale: true,
            motor_from_joint: Some(motor_from_joint),
        }
    }

    /// Motors that drive several identified joints.
    pub(crate) fn motors(&self, identified_joints: &[usize]) -> Vec<usize> {
        let motors = self.motor_from_joint.as_ref().map_or(0, DMatrix::nrows);
        let drives = |motor: usize| {
            let row = self.row(motor);
            identified_joints
                .iter()
                .filter(|joint| row[**joint] != 0.0)
                .count()
        };
        (0..motors).filter(|motor| drives(*motor) > 1).collect()
    }

    /// Returns `r_m`.
    pub(crate) fn row(&self, motor: usize) -> Vec<f64> {
        let Some(matrix) = &self.motor_from_joint else {
            return Vec::new();
        };
        let row = matrix.row(motor);
        let max = row.amax();
        row.iter().map(|x| x / max).collect()
    }
}
