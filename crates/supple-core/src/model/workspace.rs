//! Workspace limits of the tip: borders that the tip must not cross, and boxes (zones) with their own
//! speed and force limits.
//!
//! Before each border a margin with a spring-damper pushes the tip back. A violation faults only
//! while the tip is beyond the border and moves further out. A tip that is already outside when the
//! arm is switched on may be moved back.

use crate::math::{Vector3, abs, sqrt};

/// Maximum number of borders, and of zones.
pub const MAX_BORDERS_OR_ZONES: usize = 8;

/// Speed beyond a border that counts as moving outwards \[m/s\].
const OUTWARD_SPEED_M_PER_S: f64 = 0.01;
/// Fraction of a zone's speed limit above which the tip is damped.
const SOFT_SPEED_SHARE: f64 = 0.8;

/// A border. Base axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Border {
    /// The tip stays where `normal . x <= offset_m`; the normal is of length one.
    Wall {
        /// Unit vector out of the allowed side.
        normal: Vector3<f64>,
        /// Distance of the wall from the base's origin along the normal \[m\].
        offset_m: f64,
    },
    /// The tip stays out of a box; its edges are parallel to the axes.
    KeepOut {
        /// Corner of the smallest coordinates \[m\].
        lower_m: Vector3<f64>,
        /// Corner of the largest coordinates \[m\].
        upper_m: Vector3<f64>,
    },
}

/// A box with its own limits. Base axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Zone {
    /// Corner of the smallest coordinates \[m\].
    pub lower_m: Vector3<f64>,
    /// Corner of the largest coordinates \[m\].
    pub upper_m: Vector3<f64>,
    /// Tip speed in the zone that causes a fault \[m/s\], positive; above 0.8 times this speed the tip is damped.
    pub tip_speed_m_per_s: f64,
    /// Observed force on the tip in the zone that causes a fault \[N\], positive; it also limits the law's spring
    /// force.
    pub tip_force_n: f64,
}

/// All borders and zones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Workspace {
    /// Borders, the used entries first.
    pub borders: [Option<Border>; MAX_BORDERS_OR_ZONES],
    /// Zones, the used entries first.
    pub zones: [Option<Zone>; MAX_BORDERS_OR_ZONES],
    /// Width of the margin before each border \[m\], positive.
    pub margin_m: f64,
    /// Stiffness in the margin \[N/m\], zero or more.
    pub stiffness_n_per_m: f64,
    /// Damping in the margin, against motion towards the border, and of a tip that is too fast for its zone
    /// \[N s/m\], zero or more.
    pub damping_n_s_per_m: f64,
}

/// Violation of the workspace by the tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WorkspaceViolation {
    /// The tip is beyond a border and moves outwards.
    Border {
        /// Index of the border.
        index: usize,
        /// Distance beyond the border \[m\].
        penetration_m: f64,
    },
    /// The tip exceeds the speed limit of a zone.
    Speed {
        /// Speed \[m/s\].
        value_m_per_s: f64,
        /// The zone's limit \[m/s\].
        limit_m_per_s: f64,
    },
    /// The external force exceeds the limit of a zone.
    Force {
        /// Observed force \[N\].
        value_n: f64,
        /// The zone's limit \[N\].
        limit_n: f64,
    },
}

impl Border {
    /// Returns the distance to the border, negative beyond it \[m\], and the direction towards it. The distance to a box
    /// is measured along the axis on which the tip is furthest from the box.
    pub fn distance(&self, tip_m: &Vector3<f64>) -> (f64, Vector3<f64>) {
        match self {
            Border::Wall { normal, offset_m } => (offset_m - normal.dot(tip_m), *normal),
            Border::KeepOut { lower_m, upper_m } => {
                let mut nearest = (f64::NEG_INFINITY, Vector3::zeros());
                for axis in 0..3 {
                    let below = lower_m[axis] - tip_m[axis];
                    let above = tip_m[axis] - upper_m[axis];
                    let (gap, towards) = if below > above {
                        (below, 1.0)
                    } else {
                        (above, -1.0)
                    };
                    if gap > nearest.0 {
                        nearest = (gap, Vector3::zeros());
                        nearest.1[axis] = towards;
                    }
                }
                nearest
            }
        }
    }
}

impl Zone {
    /// Returns whether the tip is in the zone.
    pub fn contains(&self, tip_m: &Vector3<f64>) -> bool {
        (0..3).all(|axis| (self.lower_m[axis]..=self.upper_m[axis]).contains(&tip_m[axis]))
    }
}

impl Workspace {
    /// No border and no zone.
    pub const UNBOUNDED: Workspace = Workspace {
        borders: [None; MAX_BORDERS_OR_ZONES],
        zones: [None; MAX_BORDERS_OR_ZONES],
        margin_m: 0.05,
        stiffness_n_per_m: 0.0,
        damping_n_s_per_m: 0.0,
    };

    /// Returns whether there are no borders and no zones.
    pub fn is_unbounded(&self) -> bool {
        self.borders[0].is_none() && self.zones[0].is_none()
    }

    /// Returns the index of the first border that a point is beyond, and the distance beyond it \[m\].
    pub fn violated_border(&self, point_m: &Vector3<f64>) -> Option<(usize, f64)> {
        let borders = self.borders.iter().flatten().enumerate();
        let mut beyond = borders.map(|(index, border)| (index, -border.distance(point_m).0));
        beyond.find(|(_, by_m)| *by_m > 0.0)
    }

    /// Returns the first violation by the tip, if any.
    pub fn violation(
        &self,
        tip_m: &Vector3<f64>,
        velocity_m_per_s: &Vector3<f64>,
        force_n: &Vector3<f64>,
    ) -> Option<WorkspaceViolation> {
        for (index, border) in self.borders.iter().flatten().enumerate() {
            let (distance_m, towards) = border.distance(tip_m);
            if distance_m < 0.0 && velocity_m_per_s.dot(&towards) > OUTWARD_SPEED_M_PER_S {
                return Some(WorkspaceViolation::Border {
                    index,
                    penetration_m: -distance_m,
                });
            }
        }
        let zones = self.zones.iter().flatten();
        for zone in zones.filter(|zone| zone.contains(tip_m)) {
            let value_m_per_s = sqrt(velocity_m_per_s.dot(velocity_m_per_s));
            let limit_m_per_s = zone.tip_speed_m_per_s;
            if value_m_per_s > limit_m_per_s {
                return Some(WorkspaceViolation::Speed {
                    value_m_per_s,
                    limit_m_per_s,
                });
            }
            let value_n = sqrt(force_n.dot(force_n));
            let limit_n = zone.tip_force_n;
            if value_n > limit_n {
                return Some(WorkspaceViolation::Force { value_n, limit_n });
            }
        }
        None
    }

    /// Returns the depth of a point in the margin of a border \[m\], which is zero outside of the margin and exceeds the margin's
    /// width beyond the border; and the direction towards the border.
    pub fn margin_depth_m(&self, border: &Border, tip_m: &Vector3<f64>) -> (f64, Vector3<f64>) {
        let (distance_m, towards) = border.distance(tip_m);
        ((self.margin_m - distance_m).max(0.0), towards)
    }

    /// Returns the spring-damper force of the border margins plus the damping in zones \[N\], base axes. The spring of each
    /// border acts beyond the given depth in its margin \[m\].
    pub fn soft_force(
        &self,
        tip_m: &Vector3<f64>,
        velocity_m_per_s: &Vector3<f64>,
        margin_from_m: &[f64; MAX_BORDERS_OR_ZONES],
    ) -> Vector3<f64> {
        let mut force = Vector3::zeros();
        for (border, from_m) in self.borders.iter().zip(margin_from_m) {
            let Some(border) = border else {
                continue;
            };
            let (depth_m, towards) = self.margin_depth_m(border, tip_m);
            if depth_m > 0.0 {
                let closing = velocity_m_per_s.dot(&towards).max(0.0);
                let share = (depth_m / self.margin_m).min(1.0);
                let pressed_m = (depth_m - from_m).clamp(0.0, self.margin_m);
                force -= towards
                    * (self.stiffness_n_per_m * pressed_m
                        + self.damping_n_s_per_m * share * closing);
            }
        }
        let speed = sqrt(velocity_m_per_s.dot(velocity_m_per_s));
        let zones = self.zones.iter().flatten();
        for zone in zones.filter(|zone| zone.contains(tip_m)) {
            let over = speed - SOFT_SPEED_SHARE * zone.tip_speed_m_per_s;
            if over > 0.0 {
                force -= velocity_m_per_s * (self.damping_n_s_per_m * over / speed);
            }
        }
        force
    }

    /// Returns the maximum force of the law's spring at a point \[N\].
    pub fn spring_limit_n(&self, tip_m: &Vector3<f64>) -> f64 {
        let zones = self.zones.iter().flatten();
        let here = zones.filter(|zone| zone.contains(tip_m));
        here.fold(f64::MAX, |limit, zone| limit.min(zone.tip_force_n))
    }

    /// Returns the first invalid entry: its name, its value and the requirement.
    pub fn first_invalid(&self) -> Option<(&'static str, f64, &'static str)> {
        let finite = |v: &Vector3<f64>| v.iter().all(|x| x.is_finite() && abs(*x) <= 100.0);
        if !(self.margin_m > 0.0 && self.margin_m <= 1.0) {
            return Some(("workspace margin_m", self.margin_m, "above 0, at most 1"));
        }
        for (entry, value, most) in [
            ("workspace stiffness_n_per_m", self.stiffness_n_per_m, 1e4),
            ("workspace damping_n_s_per_m", self.damping_n_s_per_m, 1e3),
        ] {
            if !(0.0..=most).contains(&value) {
                return Some((
                    entry,
                    value,
                    "0 to 10,000 N/m of stiffness, to 1,000 N s/m of damping",
                ));
            }
        }
        let boxed = |lower: &Vector3<f64>, upper: &Vector3<f64>| {
            finite(lower) && finite(upper) && (0..3).all(|axis| lower[axis] < upper[axis])
        };
        for border in self.borders.iter().flatten() {
            let bad = match border {
                Border::Wall { normal, offset_m } => {
                    let length = sqrt(normal.dot(normal));
                    if abs(length - 1.0) > 1e-6 || !length.is_finite() {
                        return Some(("workspace wall normal", length, "of length 1"));
                    }
                    (abs(*offset_m) > 100.0 || offset_m.is_nan()).then_some(*offset_m)
                }
                Border::KeepOut { lower_m, upper_m } => {
                    (!boxed(lower_m, upper_m)).then_some(lower_m[0])
                }
            };
            if let Some(value) = bad {
                let must = "within 100 m, a box's lower corner below its upper corner";
                return Some(("workspace border", value, must));
            }
        }
        for zone in self.zones.iter().flatten() {
            if !boxed(&zone.lower_m, &zone.upper_m) {
                let must = "within 100 m, the lower corner below the upper corner";
                return Some(("workspace zone", zone.lower_m[0], must));
            }
            let positive = |value: f64| value > 0.0;
            if !positive(zone.tip_speed_m_per_s) {
                return Some(("zone tip_speed_m_per_s", zone.tip_speed_m_per_s, "positive"));
            }
            if !positive(zone.tip_force_n) {
                return Some(("zone tip_force_n", zone.tip_force_n, "positive"));
            }
        }
        None
    }
}
