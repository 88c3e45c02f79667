//! The position limits in force: where a joint faults, where its soft stop begins, and where the margins of the
//! workspace begin.
//!
//! They are those of the configuration, except after a time without them: the drives were idle, or a fault has ended
//! the motion, and a joint has come to rest in its soft zone or beyond its limit. The whole spring of its soft stop
//! would accelerate it, and the fault beyond the limit would recur at every reset. Therefore the limits begin where the
//! joint is: its soft stop pushes only beyond an edge that starts at the joint and returns to its place at
//! [`EDGE_RAD_PER_S`], or at once as far as somebody moves the joint back, so that the joint follows it at that speed; and it
//! faults where it moves out by more than
//! [`OUTWARD_RAD`], or leaves its limit again once it has come back. The margins of the workspace likewise.

use crate::config::Limits;
use crate::math::{Vector, Vector3, abs};
use crate::model::workspace::{MAX_BORDERS_OR_ZONES, Workspace};

/// Speed at which the edge of a soft zone returns to its place \[rad/s\]: 50 mm/s at 1 m.
const EDGE_RAD_PER_S: f64 = 0.05;
/// The same of a workspace margin \[m/s\].
const EDGE_M_PER_S: f64 = 0.05;
/// Angle by which a joint that is beyond its limit, or just before it, may move further out when its motors take over
/// its weight \[rad\].
const OUTWARD_RAD: f64 = 0.02;

/// Fraction of its speed limit up to which a joint rests: a braked one sinks.
const REST_SHARE: f64 = 0.1;
/// Angle beyond its limit up to which a resting joint may return \[rad\]; further out its angle is more likely wrong, and it
/// faults.
const MAX_BEYOND_RAD: f64 = 0.1;

/// Limits of positions that are in force.
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
    /// Some limit is not that of the configuration.
    pub relaxed: bool,
}

impl<const N: usize> PositionLimits<N> {
    /// The limits of the configuration.
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

    /// Depth of each joint into its soft zone as a share of it, from 0 outside to 1 or -1 at its far end and beyond, with
    /// the sign of the torque that pushes the joint back; `None` outside all soft zones.
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

    /// The limits that begin where the arm is. Those of the configuration hold for a joint that moves, or is further out than
    /// [`MAX_BEYOND_RAD`].
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

    /// Brings the limits back: the edges with their speed, all of them as far as the arm has come back.
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
