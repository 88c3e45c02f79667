//! The current activity of the controller: a mode with its data.

use super::fault::SafeAction;
use super::mode::{Breakaway, Mode};
use crate::math::{Matrix3, Vector};
use crate::trajectory::{Fourier, Rotation, Segment, Trajectory};

/// A mode with its data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Activity<const N: usize> {
    Idle,
    GravityHold,
    Move {
        from_rad: Vector<N>,
        to_rad: Vector<N>,
        duration_s: f64,
    },
    Track(Trajectory),
    /// Follows set-points; times of the segment count from the start of the activity.
    SetPoints(Segment),
    Excite(Fourier<N>),
    Breakaway {
        ramp: Breakaway,
        /// Angles at which the position loops hold the other joints; for the ramped joint its angle at the start of the ramp \[rad\].
        from_rad: Vector<N>,
        /// Torque of the position loop that held the ramped joint when the mode was entered, plus the constant part of its friction
        /// feed-forward; 0 if no loop held it. The ramp is added to it \[N m\].
        held_nm: f64,
    },
    Float,
    JointImpedance {
        from_rad: Vector<N>,
        to_rad: Vector<N>,
        duration_s: f64,
    },
    TrackPose {
        trajectory: Trajectory,
        rotation: Rotation,
        /// Orientation of the tip when the mode was entered.
        from_base_from_tip: Matrix3<f64>,
        /// Joint angles when the mode was entered, towards which the posture stiffness pulls \[rad\].
        posture_rad: Vector<N>,
    },
    Fault(SafeAction),
}

impl<const N: usize> Activity<N> {
    pub fn mode(&self) -> Mode {
        match self {
            Activity::Idle => Mode::Idle,
            Activity::GravityHold => Mode::GravityHold,
            Activity::Move { .. } => Mode::Move,
            Activity::Track(Trajectory::Probe(_)) => Mode::Probe,
            Activity::Track(_) | Activity::SetPoints(_) => Mode::Track,
            Activity::Excite(_) => Mode::Excite,
            Activity::Breakaway { .. } => Mode::Breakaway,
            Activity::Float => Mode::Float,
            Activity::JointImpedance { .. } => Mode::JointImpedance,
            Activity::TrackPose { .. } => Mode::TrackPose,
            Activity::Fault(_) => Mode::Fault,
        }
    }

    /// Returns whether this activity itself moves or holds every joint, active or held, by a stiff position loop; `false` for gravity
    /// hold, even with `hold_pose`.
    pub fn has_joint_loops(&self) -> bool {
        matches!(
            self,
            Activity::Move { .. } | Activity::Excite(_) | Activity::Breakaway { .. }
        )
    }

    /// Returns whether joints follow a reference of their own, by stiff loops or compliant springs.
    pub fn has_joint_reference(&self) -> bool {
        self.has_joint_loops() || matches!(self, Activity::JointImpedance { .. })
    }

    /// Returns whether the activity commands no torque at all.
    pub fn is_torque_off(&self) -> bool {
        matches!(self, Activity::Idle | Activity::Fault(SafeAction::Brake))
    }
}
