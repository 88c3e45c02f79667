//! Connections of a simulated arm that differ from its description: swapped encoders, reversed motors.

use supple_core::Vector;

/// Connections of the encoders and motors of a simulated arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wiring<const N: usize> {
    /// Joint whose encoder is read as that of each joint; `None` for its own.
    pub encoder_of: Option<[usize; N]>,
    /// Factor between the torque of each joint and its command: -1 for a motor that turns in the opposite direction.
    pub torque_factor: Option<[f64; N]>,
}

impl<const N: usize> Wiring<N> {
    /// Connections that agree with the description.
    pub const AS_DESCRIBED: Wiring<N> = Wiring {
        encoder_of: None,
        torque_factor: None,
    };

    /// Returns the angles that the controller receives \[rad\].
    pub fn read(&self, position_rad: &Vector<N>) -> Vector<N> {
        match self.encoder_of {
            Some(of) => Vector::from_fn(|i, _| position_rad[of[i]]),
            None => *position_rad,
        }
    }

    /// Returns the torques that the motors produce \[N m\].
    pub fn drive(&self, torque_nm: &Vector<N>) -> Vector<N> {
        match self.torque_factor {
            Some(factor) => Vector::from_fn(|i, _| torque_nm[i] * factor[i]),
            None => *torque_nm,
        }
    }
}
