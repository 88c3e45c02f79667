//! Holding an arm that falls without torque, and laying it down.
//!
//! While the arm is held, its torque is gravity compensation at the measured pose, and the motors damp. While it is
//! laid down, a reference moves from the pose at which that began to the rest pose, at a low joint speed, and a weak
//! spring of each joint pulls towards it: `tau = g(q) + k (q_ref - q)`. A joint without an angle keeps its last one
//! for gravity and has no spring. When the reference has arrived, the torque fades to zero while the motors still damp:
//! the arm settles on its support, and disabling the motors takes no torque away. Where that torque drives the arm, the
//! safe action ends it (`guard.rs`). Source: own derivation; the reference is the quintic `10 s^3 - 15 s^4 + 6 s^5`.

use supple_core::dynamics::gravity;
use supple_core::{Arm, Vector};

/// How an arm is held and laid down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StowConfig<const N: usize> {
    /// Rest pose \[rad\]; `None` if there is none: the arm is held, and disabled where it is.
    pub stow_rad: Option<Vector<N>>,
    /// Damping that the motors add while they hold and lay down \[N m s/rad\].
    pub damping_nm_s_per_rad: Vector<N>,
    /// Stiffness towards the reference \[N m/rad\].
    pub stiffness_nm_per_rad: Vector<N>,
    /// Largest joint speed of the reference \[rad/s\].
    pub speed_rad_per_s: f64,
    /// Time for which the arm is held before it is laid down \[s\].
    pub hold_s: f64,
}

/// Time in which the torque fades after the reference has arrived, and time without torque until the motors are
/// disabled \[s\].
const FADE_S: f64 = 1.0;
const SETTLE_S: f64 = 0.5;
/// Largest error that the spring sees \[rad\]: a blocked arm is not pushed harder and harder.
const MAX_ERROR_RAD: f64 = 0.2;
/// Peak of the speed of the quintic, times duration over distance.
const QUINTIC_PEAK: f64 = 1.875;

/// Progress of holding and laying down.
#[derive(Clone, Copy, Debug)]
pub struct Stowing<const N: usize> {
    arm: Arm<N>,
    config: StowConfig<N>,
    /// Last known angles \[rad\].
    pose_rad: Vector<N>,
    present: [bool; N],
    /// Pose in which laying down began \[rad\], and its duration \[s\].
    begin: Option<(Vector<N>, f64)>,
}

impl<const N: usize> Stowing<N> {
    /// An arm that is not being laid down.
    pub fn new(arm: Arm<N>, config: StowConfig<N>) -> Stowing<N> {
        Stowing {
            arm,
            config,
            pose_rad: Vector::zeros(),
            present: [false; N],
            begin: None,
        }
    }

    /// The configuration.
    pub fn config(&self) -> &StowConfig<N> {
        &self.config
    }

    /// Takes the angles of a cycle \[rad\].
    pub fn observe(&mut self, position_rad: &[Option<f64>; N]) {
        for (joint, angle) in position_rad.iter().enumerate() {
            self.present[joint] = angle.is_some_and(f64::is_finite);
            if let Some(angle) = angle.filter(|angle| angle.is_finite()) {
                self.pose_rad[joint] = angle;
            }
        }
    }

    /// Ends laying down; the next call of [`Stowing::stow_nm`] begins anew.
    pub fn reset(&mut self) {
        self.begin = None;
    }

    /// Torque that holds the arm \[N m\].
    pub fn hold_nm(&self) -> Vector<N> {
        gravity(&self.arm, &self.pose_rad)
    }

    /// Torque that lays the arm down, `elapsed_s` after that began \[N m\].
    pub fn stow_nm(&mut self, elapsed_s: f64) -> Vector<N> {
        let hold_nm = self.hold_nm();
        let Some(stow_rad) = self.config.stow_rad else {
            return hold_nm;
        };
        let (from_rad, duration_s) = *self.begin.get_or_insert_with(|| {
            let way = (stow_rad - self.pose_rad).amax();
            let duration_s = QUINTIC_PEAK * way / self.config.speed_rad_per_s;
            (self.pose_rad, duration_s)
        });
        let s = if duration_s > 0.0 {
            (elapsed_s / duration_s).clamp(0.0, 1.0)
        } else {
            1.0
        };
        let share = s * s * s * (10.0 + s * (6.0 * s - 15.0));
        let reference_rad = from_rad + (stow_rad - from_rad) * share;
        let torque_nm = Vector::from_fn(|joint, _| {
            let error_rad = reference_rad[joint] - self.pose_rad[joint];
            let error_rad = error_rad.clamp(-MAX_ERROR_RAD, MAX_ERROR_RAD);
            let spring = self.config.stiffness_nm_per_rad[joint] * error_rad;
            hold_nm[joint] + if self.present[joint] { spring } else { 0.0 }
        });
        torque_nm * (1.0 - (elapsed_s - duration_s) / FADE_S).clamp(0.0, 1.0)
    }

    /// Whether the arm lies, `elapsed_s` after laying down began.
    pub fn has_ended(&self, elapsed_s: f64) -> bool {
        match (self.config.stow_rad, self.begin) {
            (None, _) => true,
            (Some(_), Some((_, duration_s))) => elapsed_s > duration_s + FADE_S + SETTLE_S,
            (Some(_), None) => false,
        }
    }
}
