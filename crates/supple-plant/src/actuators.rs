//! Transmission, motors, encoders and amplifiers between controller and plant.
//!
//! Joint angles are `q = m2jp p` with the motor angles `p`; motor torques are `m2jp^T tau` with the joint
//! torques `tau`. A commanded torque is rounded to the amplifier's resolution, the remainder carried to the next cycle if
//! the drive does so, and acts a whole number of cycles later:
//!
//! ```text
//! motor torque = k (1 + sum r sin(n p + phase)) slack(command) + offset + sum a sin(n p + phase)
//! ```
//!
//! with the torque constant's error `k`, the torque ripple `r`, the amplifier's dead zone (`slack` subtracts it), its
//! offset and the cogging `a`, which do not depend on the command. A measured angle has a constant bias and is rounded
//! to the encoder's counts. A motor with shorted terminals (amplifier in idle) brakes by its own current: `tau =
//! -(Kt^2 / R) p'` at the motor; the electrical time constant (inductance over resistance) is neglected, and its
//! amplifier has no offset. Elastic cables are in [`crate::elasticity`]; here `p` are the motor angles in both cases.

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
    /// Periods per revolution of the motor.
    pub harmonic: u32,
    /// Amplitude at the motor \[N m\].
    pub amplitude_nm: f64,
    /// Phase \[rad\]: the torque is `amplitude sin(harmonic p + phase)`.
    pub phase_rad: f64,
}

/// A harmonic of a motor's torque constant over its angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorqueRipple {
    /// Index of the motor, from 0.
    pub motor: usize,
    /// Periods per revolution of the motor.
    pub harmonic: u32,
    /// Amplitude as a fraction of the torque.
    pub fraction: f64,
    /// Phase \[rad\]: the torque is multiplied by `1 + fraction sin(harmonic p + phase)`.
    pub phase_rad: f64,
}

/// Transmission, encoders and amplifiers.
#[derive(Clone, Debug, PartialEq)]
pub struct ActuatorModel<const N: usize> {
    /// `m2jp`: joint angles from motor angles, regular.
    pub joint_from_motor: Matrix<N, N>,
    /// Encoder counts per revolution of each motor, zero or more; zero measures without rounding.
    pub counts_per_motor_revolution: Vector<N>,
    /// Standard deviation of the noise on each motor angle before it is rounded \[rad\], zero or more.
    pub encoder_noise_rad: Vector<N>,
    /// Resolution of each motor's torque \[N m\], zero or more; zero commands without rounding.
    pub motor_torque_quantum_nm: Vector<N>,
    /// Whether the drive carries the rounding error of a torque to the next cycle, so that the mean torque is exact.
    pub carries_remainder: bool,
    /// Damping of each motor with shorted terminals, `Kt^2 / R` \[N m s/rad\], zero or more.
    pub braking_nm_s_per_rad: Vector<N>,
    /// Cycles after which a commanded torque acts; 1 on an arm whose drives apply it in the next cycle.
    pub torque_delay_cycles: usize,
    /// Torque ripple of the motors that does not depend on the command (cogging); empty for none.
    pub ripple: Vec<Ripple>,
    /// Torque ripple of the motors in proportion to the torque; empty for none.
    pub torque_ripple: Vec<TorqueRipple>,
    /// Torque of each motor over the commanded one, positive; 1 for an exact torque constant.
    pub torque_constant: Vector<N>,
    /// Dead zone of each amplifier at the motor \[N m\], zero or more: smaller commands have no effect, larger ones lose
    /// this much.
    pub dead_zone_nm: Vector<N>,
    /// Torque of each motor without command \[N m\], unless its terminals are shorted.
    pub offset_nm: Vector<N>,
    /// Measured minus true angle of each joint \[rad\].
    pub encoder_bias_rad: Vector<N>,
}

impl<const N: usize> ActuatorModel<N> {
    /// Returns the ideal direct drive: ratio 1, no quantisation, no delay.
    pub fn direct() -> ActuatorModel<N> {
        ActuatorModel {
            joint_from_motor: Matrix::identity(),
            counts_per_motor_revolution: Vector::zeros(),
            encoder_noise_rad: Vector::zeros(),
            motor_torque_quantum_nm: Vector::zeros(),
            carries_remainder: false,
            braking_nm_s_per_rad: Vector::zeros(),
            torque_delay_cycles: 0,
            ripple: Vec::new(),
            torque_ripple: Vec::new(),
            torque_constant: Vector::repeat(1.0),
            dead_zone_nm: Vector::zeros(),
            offset_nm: Vector::zeros(),
            encoder_bias_rad: Vector::zeros(),
        }
    }

    /// Returns whether the torques of the amplifiers differ from the commands.
    fn amplifiers_inexact(&self) -> bool {
        let zero = |values: &Vector<N>| values.iter().all(|x| *x == 0.0);
        let exact = self.torque_constant.iter().all(|k| *k == 1.0);
        !(exact
            && zero(&self.dead_zone_nm)
            && zero(&self.offset_nm)
            && self.torque_ripple.is_empty())
    }
}

/// Run-time state of the actuators.
#[derive(Clone, Debug)]
pub(crate) struct ActuatorState<const N: usize> {
    model: ActuatorModel<N>,
    motor_from_joint: Matrix<N, N>,
    /// Commands that do not act yet, with the motors to be shorted until they act.
    pending: VecDeque<(Vector<N>, [bool; N])>,
    last_command: Vector<N>,
    /// Rounding error of each motor's torque that the next cycle adds \[N m\].
    remainder: Vector<N>,
    /// Whether motor torques differ from commands.
    amplifiers_inexact: bool,
    /// Motors to be shorted, and motors that are shorted: a motor stays shorted until its first torque acts.
    to_short: [bool; N],
    shorted: [bool; N],
    /// Resulting joint-space damping matrix \[N m s/rad\].
    braking: Matrix<N, N>,
}

impl<const N: usize> ActuatorState<N> {
    /// Creates the actuators; `held` is the joint torque that acts until the first command takes effect.
    pub fn new(model: ActuatorModel<N>, held: &Vector<N>) -> Result<Self, PlantError> {
        let motor_from_joint = inverse(&model.joint_from_motor).ok_or(PlantError::Transmission)?;
        for i in 0..N {
            for (field, value) in [
                (
                    "counts_per_motor_revolution",
                    model.counts_per_motor_revolution[i],
                ),
                ("encoder_noise_rad", model.encoder_noise_rad[i]),
                ("motor_torque_quantum_nm", model.motor_torque_quantum_nm[i]),
                ("braking_nm_s_per_rad", model.braking_nm_s_per_rad[i]),
                ("dead_zone_nm", model.dead_zone_nm[i]),
            ] {
                let valid = value >= 0.0 && value.is_finite();
                let name = format!("{field} of motor {i}");
                entry(valid, name, value, "finite and not negative")?;
            }
            let constant = model.torque_constant[i];
            let valid = constant > 0.0 && constant.is_finite();
            let name = format!("torque_constant of motor {i}");
            entry(valid, name, constant, "finite and positive")?;
            for (name, value) in [
                (format!("offset_nm of motor {i}"), model.offset_nm[i]),
                (
                    format!("encoder_bias_rad of joint {i}"),
                    model.encoder_bias_rad[i],
                ),
            ] {
                entry(value.is_finite(), name, value, "finite")?;
            }
        }
        for ripple in &model.ripple {
            let (motor, amplitude) = (ripple.motor, ripple.amplitude_nm);
            let must = "the index of a motor, from 0";
            entry(motor < N, "motor of a ripple", motor as f64, must)?;
            let valid = amplitude.is_finite() && ripple.phase_rad.is_finite();
            let name = format!("amplitude_nm or phase_rad of a ripple of motor {motor}");
            entry(valid, name, amplitude, "finite")?;
        }
        for ripple in &model.torque_ripple {
            let (motor, fraction) = (ripple.motor, ripple.fraction);
            let must = "the index of a motor, from 0";
            entry(motor < N, "motor of a torque ripple", motor as f64, must)?;
            let valid = fraction.is_finite() && ripple.phase_rad.is_finite();
            let name = format!("fraction or phase_rad of a torque ripple of motor {motor}");
            entry(valid, name, fraction, "finite")?;
        }
        let mut state = ActuatorState {
            amplifiers_inexact: model.amplifiers_inexact(),
            model,
            motor_from_joint,
            pending: VecDeque::new(),
            last_command: Vector::zeros(),
            remainder: Vector::zeros(),
            to_short: [false; N],
            shorted: [false; N],
            braking: Matrix::zeros(),
        };
        state.restart(held);
        Ok(state)
    }

    /// Resets the command queue; `held` acts until the first new command takes effect.
    pub fn restart(&mut self, held: &Vector<N>) {
        self.last_command = *held;
        self.remainder = Vector::zeros();
        self.pending.clear();
        for _ in 0..self.model.torque_delay_cycles {
            self.pending.push_back((*held, [false; N]));
        }
    }

    /// Queues the command of this cycle and returns the joint torque that acts in it, without ripple. A non-finite
    /// command is ignored; the previous one remains in effect.
    pub fn command(&mut self, torque_nm: &Vector<N>) -> Vector<N> {
        if torque_nm.iter().all(|t| t.is_finite()) {
            self.last_command = self.rounded(torque_nm);
        }
        let command = (self.last_command, self.to_short);
        self.pending.push_back(command);
        let (acting, were_shorted) = self.pending.pop_front().unwrap_or(command);
        self.set_shorted(core::array::from_fn(|i| {
            self.to_short[i] || were_shorted[i]
        }));
        acting
    }

    fn rounded(&mut self, torque_nm: &Vector<N>) -> Vector<N> {
        let quantum = &self.model.motor_torque_quantum_nm;
        if quantum.iter().all(|q| *q == 0.0) {
            return *torque_nm;
        }
        let mut motor = self.model.joint_from_motor.transpose() * torque_nm;
        for i in 0..N {
            if quantum[i] > 0.0 {
                let wanted = motor[i] + self.remainder[i];
                motor[i] = libm::rint(wanted / quantum[i]) * quantum[i];
                if self.model.carries_remainder {
                    self.remainder[i] = wanted - motor[i];
                }
            }
        }
        self.motor_from_joint.transpose() * motor
    }

    /// Shorts these motors at the next command, and releases the others when the torque of that command acts.
    pub fn short_motors(&mut self, motors: [bool; N]) {
        self.to_short = motors;
    }

    fn set_shorted(&mut self, motors: [bool; N]) {
        if motors == self.shorted {
            return;
        }
        self.shorted = motors;
        let at_motors = Vector::from_fn(|i, _| match motors[i] {
            true => self.model.braking_nm_s_per_rad[i],
            false => 0.0,
        });
        self.braking = self.motor_from_joint.transpose()
            * Matrix::from_diagonal(&at_motors)
            * self.motor_from_joint;
    }

    /// Returns the joint torque of the shorted motors at joint velocities `qd`.
    pub fn braking(&self, qd: &Vector<N>) -> Vector<N> {
        if self.shorted.contains(&true) {
            -(self.braking * qd)
        } else {
            Vector::zeros()
        }
    }

    /// Returns the torque of the motors at the joints for the acting command `applied`, with motor angles that are `q` at the
    /// joints; without the braking of shorted motors.
    pub fn motor_torque(&self, applied: &Vector<N>, q: &Vector<N>) -> Vector<N> {
        if !self.amplifiers_inexact {
            return applied + self.ripple(q);
        }
        let model = &self.model;
        let angle = self.motor_from_joint * q;
        let commanded = model.joint_from_motor.transpose() * applied;
        let mut ripple = Vector::<N>::zeros();
        for line in &model.torque_ripple {
            let phase = f64::from(line.harmonic) * angle[line.motor] + line.phase_rad;
            ripple[line.motor] += line.fraction * libm::sin(phase);
        }
        let motor = Vector::from_fn(|i, _| {
            let beyond = (commanded[i].abs() - model.dead_zone_nm[i]).max(0.0);
            let offset_nm = if self.shorted[i] {
                0.0
            } else {
                model.offset_nm[i]
            };
            beyond.copysign(commanded[i]) * model.torque_constant[i] * (1.0 + ripple[i]) + offset_nm
        });
        self.motor_from_joint.transpose() * motor + self.ripple(q)
    }

    /// Returns the joint torque of the motors' cogging with motor angles that are `q` at the joints.
    fn ripple(&self, q: &Vector<N>) -> Vector<N> {
        if self.model.ripple.is_empty() {
            return Vector::zeros();
        }
        let angle = self.motor_from_joint * q;
        let mut motor = Vector::<N>::zeros();
        for ripple in &self.model.ripple {
            let phase = f64::from(ripple.harmonic) * angle[ripple.motor] + ripple.phase_rad;
            motor[ripple.motor] += ripple.amplitude_nm * libm::sin(phase);
        }
        self.motor_from_joint.transpose() * motor
    }

    /// Returns the joint angles as measured by the encoders, with motor angles that are `q` at the joints.
    pub fn measure(&self, q: &Vector<N>, noise: &mut Noise) -> Vector<N> {
        let counts = &self.model.counts_per_motor_revolution;
        let deviation = &self.model.encoder_noise_rad;
        let q = q + self.model.encoder_bias_rad;
        if counts.iter().chain(deviation.iter()).all(|x| *x == 0.0) {
            return q;
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
        self.model.joint_from_motor * angle
    }
}

/// Returns the motor angles from joint angles; `None` for a singular transmission.
pub(crate) fn motor_from_joint<const N: usize>(model: &ActuatorModel<N>) -> Option<Matrix<N, N>> {
    inverse(&model.joint_from_motor)
}

/// Returns the inverse by the normal equations, `(A^T A)^-1 A^T`; `None` for a singular matrix.
fn inverse<const N: usize>(a: &Matrix<N, N>) -> Option<Matrix<N, N>> {
    let factor = linalg::Cholesky::new(&(a.transpose() * a))?;
    let inverse = factor.solve(&a.transpose());
    let error = (a * inverse - Matrix::<N, N>::identity()).abs().max();
    (error < 1e-9).then_some(inverse)
}
