//! Streams of set-points of the tip, at any rate up to one per cycle.
//!
//! Each set-point carries the cycle in which the reference passes it, so that jitter of its arrival has no effect. The
//! reference moves from its present position, velocity and acceleration to the set-point along a quintic polynomial, and then
//! comes to rest: if no further set-point arrives, the tip is held. A newer set-point replaces the remaining motion.

use super::Controller;
use super::activity::Activity;
use super::mode::{Refusal, SetPoint};
use super::state::State;
use crate::config::Config;
use crate::math::all_finite;
use crate::trajectory::{Reference, Segment, Trajectory, TrajectoryError};

/// Longest time from a request to its set-point \[s\].
pub const MAX_SET_POINT_AHEAD_S: f64 = 1.0;

impl SetPoint {
    /// Returns the reference of the tip at the set-point.
    pub(super) fn reference(&self) -> Reference {
        Reference {
            position: self.position_m,
            velocity: self.velocity_m_per_s,
            acceleration: self.acceleration_m_per_s2,
        }
    }

    /// Rejects values that are not finite.
    pub(super) fn validate(&self) -> Result<(), Refusal> {
        for (entry, vector) in [
            ("position_m", &self.position_m),
            ("velocity_m_per_s", &self.velocity_m_per_s),
            ("acceleration_m_per_s2", &self.acceleration_m_per_s2),
        ] {
            if !all_finite(vector) {
                let value = vector.iter().copied().find(|x| !x.is_finite());
                return Err(Refusal::Trajectory(TrajectoryError {
                    entry,
                    value: value.unwrap_or(f64::NAN),
                    must: "finite",
                }));
            }
        }
        Ok(())
    }
}

impl<const N: usize> State<N> {
    /// Continues the reference to a set-point, or returns the reason for a refusal. The impedance law must already hold the tip,
    /// by a track request of a hold or by earlier set-points. Set-points that arrive late thus cannot restart a motion that
    /// another client has ended with another mode.
    #[inline(never)]
    pub(super) fn apply_set_point(
        &mut self,
        controller: &Controller<N>,
        set_point: &SetPoint,
    ) -> Result<(), Refusal> {
        let config = controller.config();
        let (Activity::Track(Trajectory::Hold(_)) | Activity::SetPoints(_), Some(from)) =
            (&self.activity, self.reference(config))
        else {
            return Err(Refusal::Mode { mode: self.mode() });
        };
        set_point.validate()?;
        let duration_s = check_time(config, self.cycle.unwrap_or(0), set_point.at_cycle)?;
        let segment = Segment::new(
            from,
            self.activity_s(config),
            set_point.reference(),
            duration_s,
            config.limits.tip_acceleration_m_per_s2,
        );
        check_segment(config, &segment)?;
        self.activity = Activity::SetPoints(segment);
        Ok(())
    }
}

/// Returns the time from this cycle to the cycle of the set-point \[s\], or refuses a time that is negative or too long.
fn check_time<const N: usize>(
    config: &Config<N>,
    cycle: u64,
    at_cycle: u64,
) -> Result<f64, Refusal> {
    let period_s = config.period_s;
    let ahead_s = match at_cycle.checked_sub(cycle) {
        Some(cycles) => cycles as f64 * period_s,
        None => -((cycle - at_cycle) as f64) * period_s,
    };
    let refuse = |entry, limit| {
        Err(Refusal::Value {
            entry,
            value: ahead_s,
            limit,
        })
    };
    if ahead_s <= 0.0 {
        return refuse(
            "time left to the set-point [s], which came too late,",
            period_s,
        );
    }
    if ahead_s > MAX_SET_POINT_AHEAD_S {
        return refuse("time to the set-point [s]", MAX_SET_POINT_AHEAD_S);
    }
    Ok(ahead_s)
}

fn check_segment<const N: usize>(config: &Config<N>, segment: &Segment) -> Result<(), Refusal> {
    let peaks = segment.peaks();
    for (entry, value, limit) in [
        (
            "peak speed on the way to the set-point [m/s]",
            peaks.speed_m_per_s,
            config.limits.tip_speed_m_per_s,
        ),
        (
            "peak acceleration on the way to the set-point [m/s^2]",
            peaks.acceleration_m_per_s2,
            config.limits.tip_acceleration_m_per_s2,
        ),
    ] {
        if value > limit || value.is_nan() {
            return Err(Refusal::Value {
                entry,
                value,
                limit,
            });
        }
    }
    if !config.workspace.is_unbounded() {
        for point_m in segment.points_m() {
            if let Some((border, value_m)) = config.workspace.violated_border(&point_m) {
                return Err(Refusal::Workspace { border, value_m });
            }
        }
    }
    Ok(())
}
