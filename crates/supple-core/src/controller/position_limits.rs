//! The position limits in force: the angles beyond which a joint faults, the angles at which its soft stop begins, and the
//! positions at which the margins of the workspace begin.
//!
//! They equal the configured limits, except after a time in which no limits applied: the drives were idle, or a fault ended
//! the motion, and a joint came to rest in its soft zone or beyond its limit. With the configured limits the full spring of the
//! soft stop would accelerate the joint, and the fault would recur at every reset. Therefore the limits are relaxed to the
//! joint's angle. The soft stop acts beyond an edge that starts at the joint and returns to its configured angle at
//! [`EDGE_RAD_PER_S`], so that the joint follows at that speed; if somebody moves the joint back, the edge follows at once. The
//! joint faults if it moves outwards by more than [`OUTWARD_RAD`], or exceeds its limit again after it has returned. The
//! margins of the workspace are relaxed in the same way.

use crate::config::Limits;
use crate::math::{Vector, Vector3, abs};
use crate::model::workspace::{MAX_BORDERS_OR_ZONES, Workspace};

/// Speed at which the edge of a soft zone returns to its configured angle \[rad/s\]: 50 mm/s at 1 m.
const EDGE_RAD_PER_S: f64 = 0.05;
/// Speed at which the edge of a workspace margin returns \[m/s\].
const EDGE_M_PER_S: f64 = 0.05;
/// Angle by which a joint beyond or near its limit may move further outwards when its motors start to carry
/// its weight \[rad\].
const OUTWARD_RAD: f64 = 0.02;

/// Fraction of its speed limit up to which a joint counts as resting; a joint with braked motors sinks slowly.
const REST_SHARE: f64 = 0.1;
/// Maximum angle beyond its limit from which a resting joint may return \[rad\]. Further out the measured angle is more likely
/// wrong, and the joint faults.
const MAX_BEYOND_RAD: f64 = 0.1;

/// Position limits in force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PositionLimits<const N: usize> {
    /// Angles beyond which a joint faults \[rad\].
    pub lower_rad: Vector<N>,
    pub upper_rad: Vector<N>,
    /// Angles beyond which a soft stop pushes \[rad\].
    pub soft_lower_rad: Vector<N>,
    pub soft_upper_rad: Vector<N>,
    /// Depth in the margin of each border from which its spring pushes \[m\]: zero or more.
    pub margin_from_m: [f64; MAX_BORDERS_OR_ZONES],
    /// Whether any limit differs from the configuration.
    pub relaxed: bool,
}

impl<const N: usize> PositionLimits<N> {
    /// Returns the limits of the configuration.
    pub fn new(limits: &Limits<N>) -> PositionLimits<N> {
        PositionLimits {
            lower_rad: limits.position_lower_rad,
            upper_rad: limits.position_upper_rad,
            soft_lower_rad: limits.position_lower_rad.add_scalar(limits.soft_zone_rad),
            soft_upper_rad: limits.position_upper_rad.add_scalar(-limits.soft_zone_rad),
            margin_from_m: [0.0; MAX_BORDERS_OR_ZONES],
            relaxed: false,
        }
    }

    /// Returns the depth of each joint in its soft zone as a fraction of the zone's width, from 0 outside to 1 at its end and
    /// beyond, with the sign of the torque that pushes the joint back; `None` if no joint is in a soft zone.
    #[inline(always)]
    pub fn soft_zone_depths(&self, zone_rad: f64, position_rad: &Vector<N>) -> Option<Vector<N>> {
        let outside = (0..N).all(|joint| {
            let angle = position_rad[joint];
            angle >= self.soft_lower_rad[joint] && angle <= self.soft_upper_rad[joint]
        });
        match outside {
            true => None,
            false => Some(self.depths(zone_rad, position_rad)),
        }
    }

    #[cold]
    #[inline(never)]
    fn depths(&self, zone_rad: f64, position_rad: &Vector<N>) -> Vector<N> {
        Vector::from_fn(|joint, _| {
            let below = self.soft_lower_rad[joint] - position_rad[joint];
            let above = position_rad[joint] - self.soft_upper_rad[joint];
            if below > 0.0 {
                (below / zone_rad).min(1.0)
            } else if above > 0.0 {
                -(above / zone_rad).min(1.0)
            } else {
                0.0
            }
        })
    }

    /// Returns limits relaxed to contain the present pose. The configured limits apply to a joint that moves, or that is further
    /// out than [`MAX_BEYOND_RAD`].
    pub fn around(
        limits: &Limits<N>,
        workspace: &Workspace,
        position_rad: &Vector<N>,
        velocity_rad_per_s: &Vector<N>,
        tip_m: &Vector3<f64>,
    ) -> PositionLimits<N> {
        let configured = PositionLimits::new(limits);
        let position_rad = &Vector::<N>::from_fn(|joint, _| {
            let angle = position_rad[joint];
            let (lower, upper) = (configured.lower_rad[joint], configured.upper_rad[joint]);
            let near = angle >= lower - MAX_BEYOND_RAD && angle <= upper + MAX_BEYOND_RAD;
            let slow = REST_SHARE * limits.joint_speed_rad_per_s[joint];
            match near && abs(velocity_rad_per_s[joint]) <= slow {
                true => angle,
                false => 0.5 * (lower + upper),
            }
        });
        let mut around = PositionLimits {
            lower_rad: position_rad
                .add_scalar(-OUTWARD_RAD)
                .inf(&configured.lower_rad),
            upper_rad: position_rad
                .add_scalar(OUTWARD_RAD)
                .sup(&configured.upper_rad),
            soft_lower_rad: position_rad.inf(&configured.soft_lower_rad),
            soft_upper_rad: position_rad.sup(&configured.soft_upper_rad),
            ..configured
        };
        for (from_m, border) in around.margin_from_m.iter_mut().zip(&workspace.borders) {
            if let Some(border) = border {
                *from_m = workspace.margin_depth_m(border, tip_m).0;
            }
        }
        around.relaxed = around != configured;
        around
    }

    /// Tightens relaxed limits towards the configured ones: the edges at their speed, and all limits as far as the arm has moved
    /// back.
    pub fn restore(
        &mut self,
        limits: &Limits<N>,
        workspace: &Workspace,
        position_rad: &Vector<N>,
        tip_m: &Vector3<f64>,
        elapsed_s: f64,
    ) {
        let configured = PositionLimits::new(limits);
        let step_rad = EDGE_RAD_PER_S * elapsed_s;
        let lower_rad = position_rad
            .add_scalar(-OUTWARD_RAD)
            .inf(&configured.lower_rad);
        let upper_rad = position_rad
            .add_scalar(OUTWARD_RAD)
            .sup(&configured.upper_rad);
        self.lower_rad = self.lower_rad.sup(&lower_rad);
        self.upper_rad = self.upper_rad.inf(&upper_rad);
        let soft_lower_rad = self.soft_lower_rad.add_scalar(step_rad);
        let soft_upper_rad = self.soft_upper_rad.add_scalar(-step_rad);
        self.soft_lower_rad = soft_lower_rad
            .sup(position_rad)
            .inf(&configured.soft_lower_rad);
        self.soft_upper_rad = soft_upper_rad
            .inf(position_rad)
            .sup(&configured.soft_upper_rad);
        for (from_m, border) in self.margin_from_m.iter_mut().zip(&workspace.borders) {
            let depth_m = border
                .as_ref()
                .map_or(0.0, |border| workspace.margin_depth_m(border, tip_m).0);
            *from_m = (*from_m - EDGE_M_PER_S * elapsed_s).min(depth_m).max(0.0);
        }
        let unflagged = PositionLimits {
            relaxed: configured.relaxed,
            ..*self
        };
        self.relaxed = unflagged != configured;
    }
}
