//! Torque ripple of the motors: harmonics of the motor angle, compensated by feed-forward.
//!
//! ```text
//! r_m(p) = sum_h (a_h + c_h tau_m) sin(h p_m) + (b_h + d_h tau_m) cos(h p_m)
//!                                                      joint torque to feed forward: -j2mp^T r(j2mp q)
//! ```
//!
//! `a` and `b` are cogging. They depend on the measured angle alone: their compensation is the torque of a potential, so
//! it adds no energy over a revolution and cannot become unstable. `c` and `d` are the variation of the torque constant
//! over the angle: their compensation changes the commanded torque `tau_m` by a few per cent at most.

use crate::math::{Matrix, Vector, abs, sin_cos};

/// Maximum number of harmonics in a table.
pub const LINES: usize = 6;
/// Maximum variation of a torque constant in one harmonic, as a share.
pub const MAX_SHARE: f64 = 0.2;

/// One harmonic of a motor's torque over its angle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Harmonic {
    /// Periods in a revolution of the motor, 1 or more.
    pub harmonic: u32,
    /// `a` at the motor \[N m\].
    pub sine_nm: f64,
    /// `b` at the motor \[N m\].
    pub cosine_nm: f64,
    /// `c`, as a share of the motor's torque.
    pub sine_share: f64,
    /// `d`, as a share of the motor's torque.
    pub cosine_share: f64,
}

/// The ripple of one motor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RippleTable {
    lines: [Harmonic; LINES],
    count: usize,
}

impl RippleTable {
    /// No ripple.
    pub const NONE: RippleTable = RippleTable {
        lines: [Harmonic {
            harmonic: 0,
            sine_nm: 0.0,
            cosine_nm: 0.0,
            sine_share: 0.0,
            cosine_share: 0.0,
        }; LINES],
        count: 0,
    };

    /// Returns a table of these harmonics; `None` for more than [`LINES`], a harmonic of 0, an amplitude that
    /// is not finite, or a share beyond [`MAX_SHARE`].
    pub fn new(harmonics: &[Harmonic]) -> Option<RippleTable> {
        let valid = |h: &Harmonic| {
            h.harmonic > 0
                && h.sine_nm.is_finite()
                && h.cosine_nm.is_finite()
                && abs(h.sine_share) <= MAX_SHARE
                && abs(h.cosine_share) <= MAX_SHARE
        };
        if harmonics.len() > LINES || !harmonics.iter().all(valid) {
            return None;
        }
        let mut table = RippleTable::NONE;
        table.lines[..harmonics.len()].copy_from_slice(harmonics);
        table.count = harmonics.len();
        Some(table)
    }

    /// Returns the harmonics.
    pub fn harmonics(&self) -> &[Harmonic] {
        &self.lines[..self.count]
    }

    /// Returns whether a part of the ripple is in proportion to the motor's torque.
    pub fn scales_with_torque(&self) -> bool {
        let scales = |line: &Harmonic| line.sine_share != 0.0 || line.cosine_share != 0.0;
        self.harmonics().iter().any(scales)
    }

    /// Returns the torque that the motor adds at its angle when `motor_nm` is commanded, at the motor \[N m\].
    pub fn torque_nm(&self, motor_rad: f64, motor_nm: f64) -> f64 {
        let mut torque = 0.0;
        for line in self.harmonics() {
            let (s, c) = sin_cos(f64::from(line.harmonic) * motor_rad);
            torque += (line.sine_nm + line.sine_share * motor_nm) * s
                + (line.cosine_nm + line.cosine_share * motor_nm) * c;
        }
        torque
    }
}

/// Joint torque that cancels the ripple of all motors at joint angles `q` when `motor_nm` is commanded at the motors \[N m\].
pub fn compensation_nm<const N: usize>(
    tables: &[RippleTable; N],
    motor_from_joint: &Matrix<N, N>,
    q: &Vector<N>,
    motor_nm: &Vector<N>,
) -> Vector<N> {
    if tables.iter().all(|table| table.harmonics().is_empty()) {
        return Vector::zeros();
    }
    let angle = motor_from_joint * q;
    let motor = Vector::<N>::from_fn(|m, _| -tables[m].torque_nm(angle[m], motor_nm[m]));
    motor_from_joint.tr_mul(&motor)
}
