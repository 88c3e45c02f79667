//! Transmission between motors and joints: joint angles `q = J theta` from motor angles `theta`, motor torques `J^T tau` from
//! joint torques, with `J` = `joint_from_motor` (libbarrett's `m2jp`).

use supple_core::{Matrix, Vector};
use supple_model::Description;
use supple_puck::position::CountsError;
use supple_puck::torque::TorqueError;
use supple_puck::{Counts, PositionScale, PuckTorque, TorqueScale};

/// Transmission matrix, encoder scales and torque scales of an arm.
#[derive(Clone, Debug, PartialEq)]
pub struct Transmission<const N: usize> {
    joint_from_motor: Matrix<N, N>,
    motor_from_joint: Matrix<N, N>,
    position: [PositionScale; N],
    torque: [TorqueScale; N],
}

impl<const N: usize> Transmission<N> {
    /// Combines the description's transmission matrix with the scales that the pucks report. `None` if the
    /// description does not have `N` joints.
    pub fn new(
        description: &Description,
        position: [PositionScale; N],
        torque: [TorqueScale; N],
    ) -> Option<Transmission<N>> {
        let motors = description.motors();
        if motors.joint_from_motor.shape() != (N, N) {
            return None;
        }
        Some(Transmission {
            joint_from_motor: Matrix::from_fn(|i, j| motors.joint_from_motor[(i, j)]),
            motor_from_joint: Matrix::from_fn(|i, j| motors.motor_from_joint[(i, j)]),
            position,
            torque,
        })
    }

    /// Computes the joint angles \[rad\] from motor counts; `None` for a joint if a motor that moves it did not reply.
    pub fn joint_rad(&self, counts: &[Option<Counts>; N]) -> [Option<f64>; N] {
        core::array::from_fn(|joint| {
            let mut angle_rad = 0.0;
            for (motor, counts) in counts.iter().enumerate() {
                let ratio = self.joint_from_motor[(joint, motor)];
                if ratio != 0.0 {
                    angle_rad += ratio * self.position[motor].rad((*counts)?);
                }
            }
            Some(angle_rad)
        })
    }

    /// Computes the encoder counts of the motors at these joint angles \[rad\].
    ///
    /// # Errors
    /// [`CountsError`] for a motor angle that is not finite or exceeds the range of the counts.
    pub fn counts(&self, joint_rad: &Vector<N>) -> Result<[Counts; N], CountsError> {
        let motor_rad = self.motor_from_joint * joint_rad;
        let mut counts = [Counts::new(0)?; N];
        for (motor, counts) in counts.iter_mut().enumerate() {
            *counts = self.position[motor].counts(motor_rad[motor])?;
        }
        Ok(counts)
    }

    /// Computes motor torques in the pucks' integer unit, rounded to the nearest integer, from joint torques \[N m\].
    ///
    /// # Errors
    /// [`TorqueError`] for a torque that is not finite.
    pub fn puck_torques(&self, joint_nm: &Vector<N>) -> Result<[PuckTorque; N], TorqueError> {
        let motor_nm = self.joint_from_motor.transpose() * joint_nm;
        let mut torques = [PuckTorque::ZERO; N];
        for (motor, torque) in torques.iter_mut().enumerate() {
            *torque = self.torque[motor].puck_torque(motor_nm[motor])?;
        }
        Ok(torques)
    }
}
