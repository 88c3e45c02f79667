//! Plant outputs: measurements, ground truth and every physics step.

use supple_core::Vector;
use supple_core::nalgebra::Vector3;

/// Measurements at the end of a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement<const N: usize> {
    /// Cycles since the start.
    pub cycle: u64,
    /// Time since the start \[s\].
    pub time_s: f64,
    /// Joint angles measured by the encoders \[rad\].
    pub position_rad: Vector<N>,
    /// Force on the tip with the sensor's filter and noise, base axes \[N\].
    pub force_n: Vector3<f64>,
}

/// Ground truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth<const N: usize> {
    /// Time since the start \[s\].
    pub time_s: f64,
    /// Joint angles \[rad\].
    pub position_rad: Vector<N>,
    /// Joint velocities \[rad/s\].
    pub velocity_rad_per_s: Vector<N>,
    /// Centre of the spherical tip, base axes \[m\].
    pub tip_position_m: Vector3<f64>,
    /// Velocity of the tip, base axes \[m/s\].
    pub tip_velocity_m_per_s: Vector3<f64>,
    /// Contact force on the tip over the last step, base axes \[N\].
    pub contact_force_n: Vector3<f64>,
    /// Friction torque of joints and motors over the last step, seen at the joints, positive against positive motion \[N m\].
    pub friction_torque_nm: Vector<N>,
    /// Torque of the motors over the last step, ripple and braking included \[N m\].
    pub motor_torque_nm: Vector<N>,
    /// Angles of the motors, seen at the joints \[rad\]; those of the joints if the transmission is rigid.
    pub motor_position_rad: Vector<N>,
    /// Velocities of the motors, seen at the joints \[rad/s\]; those of the joints if the transmission is rigid.
    pub motor_velocity_rad_per_s: Vector<N>,
}

/// One step of the physics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepRecord {
    /// Time at the end of the step \[s\].
    pub time_s: f64,
    /// Contact force on the tip over the step, base axes \[N\].
    pub force_n: Vector3<f64>,
    /// Contact force after the sensor's filter, without its noise \[N\].
    pub filtered_force_n: Vector3<f64>,
    /// Deepest penetration of the tip at the start of the step \[m\], zero without contact.
    pub depth_m: f64,
}
