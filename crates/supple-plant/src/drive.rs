//! Between the controller's joints and the plant's: motors, their encoders and their amplifiers.
//!
//! Joint angles are `q = m2jp p` of the motor angles `p`, motor torques `m2jp^T tau` of the joint
//! torques. A commanded torque is rounded to the amplifier's steps and acts a whole number of cycles
//! later; a measured angle is rounded to the encoder's counts. A motor whose terminals are shorted, as an
//! amplifier in idle does it, brakes by its own current: `tau = -(Kt^2 / R) p'` at the motor, the current's own
//! time (inductance over resistance) left out. The cables between are taken as rigid.

use crate::error::{PlantError, entry};
use crate::noise::Noise;
use core::f64::consts::TAU;
use std::collections::VecDeque;
use supple_core::linalg;
use supple_core::{Matrix, Vector};

/// A harmonic of a motor's torque over its angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ripple {
    /// Index of the motor, from 0.
    pub motor: usize,
    /// Periods in a revolution of the motor.
    pub harmonic: u32,
    /// Amplitude at the motor \[N m\].
    pub amplitude_nm: f64,
    /// Phase \[rad\]: the torque is `amplitude sin(harmonic p + phase)`.
    pub phase_rad: f64,
}

/// Transmission, encoders and amplifiers.
#[derive(Clone, Debug, PartialEq)]
pub struct Drive<const N: usize> {
    /// `m2jp`: joint angles from motor angles, regular.
    pub joint_from_motor: Matrix<N, N>,
    /// Encoder counts in a revolution of each motor, zero or more; zero measures without rounding.
    pub counts_per_motor_revolution: Vector<N>,
    /// Standard deviation of the noise on each motor angle before it is rounded \[rad\], zero or more.
    pub encoder_noise_rad: Vector<N>,
    /// Least change of each motor's torque \[N m\], zero or more; zero commands without rounding.
    pub motor_torque_quantum_nm: Vector<N>,
    /// Torque of each motor per its speed when it is shorted, `Kt^2 / R` \[N m s/rad\], zero or more.
    pub braking_nm_s_per_rad: Vector<N>,
    /// Cycles after which a commanded torque acts; 1 on an arm whose drives take over at the next
    /// cycle.
    pub torque_delay_cycles: usize,
    /// Torque ripple of the motors; empty for none.
    pub ripple: Vec<Ripple>,
}

impl<const N: usize> Drive<N> {
    /// A motor of ratio 1 at every joint, nothing rounded, nothing late.
    pub fn direct() -> Drive<N> {
        Drive {
            joint_from_motor: Matrix::identity(),
            counts_per_motor_revolution: Vector::zeros(),
            encoder_noise_rad: Vector::zeros(),
            motor_torque_quantum_nm: Vector::zeros(),
            braking_nm_s_per_rad: Vector::zeros(),
            torque_delay_cycles: 0,
            ripple: Vec::new(),
        }
    }
}

/// A drive at work.
#[derive(Clone, Debug)]
pub(crate) struct DriveState<const N: usize> {
    drive: Drive<N>,
    motor_from_joint: Matrix<N, N>,
    pending: VecDeque<Vector<N>>,
    last_command: Vector<N>,
    /// Which motors are shorted.
    shorted: [bool; N],
    /// Joint torque against joint velocity that they make \[N m s/rad\].
    braking: Matrix<N, N>,
}

impl<const N: usize> DriveState<N> {
    /// `held` is the joint torque that acts until the first command does.
    pub fn new(drive: Drive<N>, held: &Vector<N>) -> Result<Self, PlantError> {
        let motor_from_joint = inverse(&drive.joint_from_motor).ok_or(PlantError::Transmission)?;
        for i in 0..N {
            for (field, value) in [
                (
                    "counts_per_motor_revolution",
                    drive.counts_per_motor_revolution[i],
                ),
                ("encoder_noise_rad", drive.encoder_noise_rad[i]),
                ("motor_torque_quantum_nm", drive.motor_torque_quantum_nm[i]),
                ("braking_nm_s_per_rad", drive.braking_nm_s_per_rad[i]),
            ] {
                let sound = value >= 0.0 && value.is_finite();
                let name = format!("{field} of motor {i}");
                entry(sound, name, value, "finite and not negative")?;
            }
        }
        for ripple in &drive.ripple {
            let (motor, amplitude) = (ripple.motor, ripple.amplitude_nm);
            let must = "the index of a motor, from 0";
            entry(motor < N, "motor of a ripple", motor as f64, must)?;
            let sound = amplitude.is_finite() && ripple.phase_rad.is_finite();
            let name = format!("amplitude_nm or phase_rad of a ripple of motor {motor}");
            entry(sound, name, amplitude, "finite")?;
        }
        let mut state = DriveState {
            drive,
            motor_from_joint,
            pending: VecDeque::new(),
            last_command: Vector::zeros(),
            shorted: [false; N],
            braking: Matrix::zeros(),
        };
        state.restart(held);
        Ok(state)
    }

    /// Forgets what was commanded; `held` acts until the next command does.
    pub fn restart(&mut self, held: &Vector<N>) {
        self.last_command = *held;
        self.pending.clear();
        for _ in 0..self.drive.torque_delay_cycles {
            self.pending.push_back(*held);
        }
    }

    /// Takes a command for this cycle and gives the joint torque that acts in it, ripple apart. A
    /// command that is not finite is not taken over: the one before stays.
    pub fn command(&mut self, torque_nm: &Vector<N>) -> Vector<N> {
        if torque_nm.iter().all(|t| t.is_finite()) {
            self.last_command = self.rounded(torque_nm);
        }
        self.pending.push_back(self.last_command);
        self.pending.pop_front().unwrap_or(self.last_command)
    }

    fn rounded(&self, torque_nm: &Vector<N>) -> Vector<N> {
        let quantum = &self.drive.motor_torque_quantum_nm;
        if quantum.iter().all(|q| *q == 0.0) {
            return *torque_nm;
        }
        let mut motor = self.drive.joint_from_motor.transpose() * torque_nm;
        for i in 0..N {
            if quantum[i] > 0.0 {
                motor[i] = libm::rint(motor[i] / quantum[i]) * quantum[i];
            }
        }
        self.motor_from_joint.transpose() * motor
    }

    /// Shorts these motors and no others.
    pub fn short(&mut self, motors: [bool; N]) {
        if motors == self.shorted {
            return;
        }
        self.shorted = motors;
        let at_motors = Vector::from_fn(|i, _| match motors[i] {
            true => self.drive.braking_nm_s_per_rad[i],
            false => 0.0,
        });
        self.braking = self.motor_from_joint.transpose()
            * Matrix::from_diagonal(&at_motors)
            * self.motor_from_joint;
    }

    /// Joint torque of the shorted motors at joint velocities `qd`.
    pub fn braking(&self, qd: &Vector<N>) -> Vector<N> {
        if self.shorted.contains(&true) {
            -(self.braking * qd)
        } else {
            Vector::zeros()
        }
    }

    /// Joint torque of the motors' ripple at joint angles `q`.
    pub fn ripple(&self, q: &Vector<N>) -> Vector<N> {
        if self.drive.ripple.is_empty() {
            return Vector::zeros();
        }
        let angle = self.motor_from_joint * q;
        let mut motor = Vector::<N>::zeros();
        for ripple in &self.drive.ripple {
            let phase = f64::from(ripple.harmonic) * angle[ripple.motor] + ripple.phase_rad;
            motor[ripple.motor] += ripple.amplitude_nm * libm::sin(phase);
        }
        self.motor_from_joint.transpose() * motor
    }

    /// Joint angles as the encoders give them.
    pub fn measure(&self, q: &Vector<N>, noise: &mut Noise) -> Vector<N> {
        let counts = &self.drive.counts_per_motor_revolution;
        let deviation = &self.drive.encoder_noise_rad;
        if counts.iter().chain(deviation.iter()).all(|x| *x == 0.0) {
            return *q;
        }
        let mut angle = self.motor_from_joint * q;
        for i in 0..N {
            if deviation[i] > 0.0 {
                angle[i] += deviation[i] * noise.normal();
            }
            if counts[i] > 0.0 {
                angle[i] = libm::rint(angle[i] / TAU * counts[i]) / counts[i] * TAU;
            }
        }
        self.drive.joint_from_motor * angle
    }
}

/// Inverse by the normal equations, `(A^T A)^-1 A^T`; `None` for a singular matrix.
fn inverse<const N: usize>(a: &Matrix<N, N>) -> Option<Matrix<N, N>> {
    let factor = linalg::Cholesky::new(&(a.transpose() * a))?;
    let inverse = factor.solve(&a.transpose());
    let error = (a * inverse - Matrix::<N, N>::identity()).abs().max();
    (error < 1e-9).then_some(inverse)
}
