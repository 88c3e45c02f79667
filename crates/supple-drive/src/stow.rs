//! Torques that hold an arm that falls without torque, and lay it down.
//!
//! While the arm is held, the torque is gravity compensation at the measured pose, and the motors damp. While the arm is
//! laid down, a reference moves from the pose at that time to the rest pose at a low joint speed, and a weak spring pulls
//! each joint towards it: `tau = g(q) + k (q_ref - q)`. For a joint whose angle is missing, gravity is computed from its
//! last angle, and the spring is off. When the reference has arrived, the torque fades to zero while the motors still damp:
//! the arm settles on its support, and disabling the motors does not change the torque. If this torque accelerates the
//! arm, the safe action ends it (`guard.rs`). Source: own derivation; the reference is the quintic `10 s^3 - 15 s^4 + 6 s^5`.

use supple_core::dynamics::gravity;
use supple_core::{Arm, Vector};

/// Configuration of holding an arm and laying it down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StowConfig<const N: usize> {
    /// Rest pose \[rad\]; if `None`, the arm is held and then disabled in its pose.
    pub stow_rad: Option<Vector<N>>,
    /// Damping that the motors add while they hold and lay down \[N m s/rad\].
    pub damping_nm_s_per_rad: Vector<N>,
    /// Stiffness towards the reference \[N m/rad\].
    pub stiffness_nm_per_rad: Vector<N>,
    /// Maximum joint speed of the reference \[rad/s\].
    pub speed_rad_per_s: f64,
    /// Time for which the arm is held before it is laid down \[s\].
    pub hold_s: f64,
}

/// Time in which the torque fades after the reference has arrived \[s\].
const FADE_S: f64 = 1.0;
const SETTLE_S: f64 = 0.5;
/// Maximum position error of the spring \[rad\], which limits its torque on a blocked arm.
const MAX_ERROR_RAD: f64 = 0.2;
/// Peak speed of the quintic, as a multiple of distance over duration.
const QUINTIC_PEAK: f64 = 1.875;

/// Progress of holding and laying down.
#[derive(Clone, Copy, Debug)]
pub struct Stowing<const N: usize> {
    arm: Arm<N>,
    config: StowConfig<N>,
    /// Last known angles \[rad\].
    pose_rad: Vector<N>,
    present: [bool; N],
    /// Pose at the start of laying down \[rad\], and duration of the reference \[s\].
    begin: Option<(Vector<N>, f64)>,
}

impl<const N: usize> Stowing<N> {
    /// Creates the state of an arm that is not being laid down.
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

    /// Processes the angles of a cycle \[rad\].
    pub fn observe(&mut self, position_rad: &[Option<f64>; N]) {
        for (joint, angle) in position_rad.iter().enumerate() {
            self.present[joint] = angle.is_some_and(f64::is_finite);
            if let Some(angle) = angle.filter(|angle| angle.is_finite()) {
                self.pose_rad[joint] = angle;
            }
        }
    }

    /// Ends laying down; the next call of [`Stowing::stow_nm`] starts it from the current pose.
    pub fn reset(&mut self) {
        self.begin = None;
    }

    /// Computes the torque that holds the arm \[N m\].
    pub fn hold_nm(&self) -> Vector<N> {
        gravity(&self.arm, &self.pose_rad)
    }

    /// Computes the torque that lays the arm down, `elapsed_s` after the start of laying down \[N m\].
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

    /// Computes the torque of a supported arm, which fades from the holding torque to zero, `elapsed_s` after its support was
    /// declared \[N m\].
    pub fn release_nm(&self, elapsed_s: f64) -> Vector<N> {
        self.hold_nm() * (1.0 - elapsed_s / FADE_S).clamp(0.0, 1.0)
    }

    /// Whether the torque of a supported arm has faded and the arm has settled, `elapsed_s` after its support was declared.
    pub fn has_released(&self, elapsed_s: f64) -> bool {
        elapsed_s > FADE_S + SETTLE_S
    }

    /// Whether laying down has ended, `elapsed_s` after its start.
    pub fn has_ended(&self, elapsed_s: f64) -> bool {
        match (self.config.stow_rad, self.begin) {
            (None, _) => true,
            (Some(_), Some((_, duration_s))) => elapsed_s > duration_s + FADE_S + SETTLE_S,
            (Some(_), None) => false,
        }
    }
}
