//! Checks of the supervision in each cycle, before the torque is limited, and the soft stops of the joints. A NaN
//! counts as exceeding a speed limit or a tracking limit.

use super::fault::Fault;
use super::position_limits::PositionLimits;
use crate::config::Limits;
use crate::law::impedance::Torques;
use crate::math::{Vector, Vector3, abs, all_finite, sqrt};

/// Fraction of the speed limits that applies in float and joint impedance. In these modes little resists a fall if the model is
/// wrong, and a hand guides the arm slowly.
pub(super) const COMPLIANT_SPEED_SHARE: f64 = 0.5;

/// Fraction of a speed limit above which a joint or the tip counts as moving.
pub(super) const MOVING_SHARE: f64 = 0.2;

fn exceeds(value: f64, limit: f64) -> bool {
    value > limit || value.is_nan()
}

/// Stability margin for damping with a delayed velocity: `B delay / mass` must not exceed this,
/// half of the stability limit pi/2.
pub(super) const DAMPING_MARGIN: f64 = core::f64::consts::FRAC_PI_4;

/// Checks joint positions, joint speeds and tip speed; `speed_share` of the speed limits applies.
pub(super) fn motion<const N: usize>(
    limits: &Limits<N>,
    positions: &PositionLimits<N>,
    speed_share: f64,
    position_rad: &Vector<N>,
    velocity_rad_per_s: &Vector<N>,
    tip_velocity: &Vector3<f64>,
) -> Result<(), Fault> {
    for joint in 0..N {
        let value_rad = position_rad[joint];
        for (limit_rad, outside) in [
            (
                positions.lower_rad[joint],
                value_rad < positions.lower_rad[joint],
            ),
            (
                positions.upper_rad[joint],
                value_rad > positions.upper_rad[joint],
            ),
        ] {
            if outside {
                return Err(Fault::JointPosition {
                    joint,
                    value_rad,
                    limit_rad,
                });
            }
        }
        let value_rad_per_s = abs(velocity_rad_per_s[joint]);
        let limit_rad_per_s = speed_share * limits.joint_speed_rad_per_s[joint];
        if exceeds(value_rad_per_s, limit_rad_per_s) {
            return Err(Fault::JointSpeed {
                joint,
                value_rad_per_s,
                limit_rad_per_s,
            });
        }
    }
    let value_m_per_s = sqrt(tip_velocity.dot(tip_velocity));
    let limit_m_per_s = speed_share * limits.tip_speed_m_per_s;
    if exceeds(value_m_per_s, limit_m_per_s) {
        return Err(Fault::TipSpeed {
            value_m_per_s,
            limit_m_per_s,
        });
    }
    Ok(())
}

/// Checks the tracking error of the tip.
#[inline]
pub(super) fn tracking(limit_m: f64, error: &Vector3<f64>) -> Result<(), Fault> {
    let value_m = sqrt(error.dot(error));
    if exceeds(value_m, limit_m) {
        return Err(Fault::TrackingError { value_m, limit_m });
    }
    Ok(())
}

/// Checks the angle between the tip and the reference of its orientation.
#[inline]
pub(super) fn rotation(limit_rad: f64, error: &Vector3<f64>) -> Result<(), Fault> {
    let value_rad = sqrt(error.dot(error));
    if exceeds(value_rad, limit_rad) {
        return Err(Fault::RotationError {
            value_rad,
            limit_rad,
        });
    }
    Ok(())
}

/// Checks the tracking error of each joint with a position loop.
pub(super) fn joint_tracking<const N: usize>(
    limits: &Limits<N>,
    setpoint_rad: &[Option<f64>; N],
    position_rad: &Vector<N>,
) -> Result<(), Fault> {
    let limit_rad = limits.joint_tracking_error_rad;
    for (joint, setpoint) in setpoint_rad.iter().enumerate() {
        let value_rad = setpoint.map_or(0.0, |setpoint| abs(setpoint - position_rad[joint]));
        if exceeds(value_rad, limit_rad) {
            return Err(Fault::JointTrackingError {
                joint,
                value_rad,
                limit_rad,
            });
        }
    }
    Ok(())
}

/// Returns the sum of all terms; a fault if a term or the sum is not finite.
#[inline(always)]
pub(super) fn total<const N: usize>(torques: &Torques<N>) -> Result<Vector<N>, Fault> {
    let total = torques.total();
    if all_finite(&total) {
        return Ok(total);
    }
    let named = torques.named();
    let wrong = named.iter().find(|(_, torque)| !all_finite(torque));
    let term = wrong.map_or("total", |(term, _)| term);
    Err(Fault::TorqueNotFinite { term })
}

/// Spring-dampers over the last `soft_zone_rad` before each hard stop. The damping coefficient grows from zero with the
/// depth into this range, and only motion towards the stop is damped, so that the torque is continuous and never
/// pulls towards the stop. Beyond the hard stop the spring torque stays constant.
pub(super) struct SoftStop<const N: usize> {
    /// Depth of each joint in its soft zone, -1 to 1; the sign is the direction away from the stop.
    depth: Vector<N>,
    /// Torque of the springs \[N m\].
    pub spring_nm: Vector<N>,
    /// Damping of motion towards the stop \[N m s/rad\].
    pub damping_nm_s_per_rad: Vector<N>,
}

impl<const N: usize> SoftStop<N> {
    /// Returns the soft stops of the configuration at these depths in their zones.
    pub fn new(limits: &Limits<N>, depth: &Vector<N>) -> SoftStop<N> {
        SoftStop {
            depth: *depth,
            spring_nm: limits.soft_stiffness_nm_per_rad.component_mul(depth) * limits.soft_zone_rad,
            damping_nm_s_per_rad: limits.soft_damping_nm_s_per_rad.component_mul(&depth.abs()),
        }
    }

    /// Returns the torques at these joint velocities.
    pub fn torque_nm(&self, velocity_rad_per_s: &Vector<N>) -> Vector<N> {
        Vector::from_fn(|joint, _| {
            let velocity = velocity_rad_per_s[joint];
            let towards_stop = velocity * self.depth[joint] < 0.0;
            let damping = self.damping_nm_s_per_rad[joint];
            self.spring_nm[joint]
                - if towards_stop {
                    damping * velocity
                } else {
                    0.0
                }
        })
    }
}
