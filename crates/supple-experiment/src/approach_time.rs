//! Duration of a joint-space move that stays below every limit of joints and tip.

use supple_core::dynamics::jacobian;
use supple_core::nalgebra::Vector3;
use supple_core::trajectory::{MINIMUM_JERK_ACCELERATION, MINIMUM_JERK_JERK, MINIMUM_JERK_SPEED};
use supple_core::{Config, Vector};

/// Minimum duration of a move \[s\].
const MOVE_S: f64 = 1.0;
/// Share of each joint's speed limit that a move may reach.
const JOINT_SPEED_SHARE: f64 = 0.5;
/// Share of the tip's speed limit that a move may reach.
const TIP_SPEED_SHARE: f64 = 0.85;
/// Share of the limits of acceleration and jerk.
const ACCELERATION_SHARE: f64 = 0.95;
/// Points at which the tip's speed is computed.
const POINTS: u32 = 64;

/// Returns the duration of a minimum-jerk move on a straight line in joint space \[s\]. The move takes at least one second, and
/// reaches at most half of the joint speed limits, 85 % of the tip's speed limit, and the limits of acceleration and jerk. The
/// duration is rounded up to 0.01 s, so that equal moves give equal logs.
pub fn approach_s<const N: usize>(
    config: &Config<N>,
    from_rad: &Vector<N>,
    to_rad: &Vector<N>,
) -> f64 {
    let needed = within_limits_s(config, from_rad, to_rad).max(MOVE_S);
    (needed * 100.0).ceil() / 100.0
}

/// Returns the shortest duration of a minimum-jerk move on a straight line in joint space that reaches at most half of the joint
/// speed limits, 85 % of the tip's speed limit, and the limits of acceleration and jerk \[s\]; zero if the arm is at the target.
pub(crate) fn within_limits_s<const N: usize>(
    config: &Config<N>,
    from_rad: &Vector<N>,
    to_rad: &Vector<N>,
) -> f64 {
    let limits = &config.limits;
    let way = to_rad - from_rad;
    let needed = (0..N).map(|i| {
        let distance_rad = way[i].abs();
        let speed = JOINT_SPEED_SHARE * limits.joint_speed_rad_per_s[i];
        let acceleration = ACCELERATION_SHARE * limits.joint_acceleration_rad_per_s2[i];
        let jerk = ACCELERATION_SHARE * limits.joint_jerk_rad_per_s3[i];
        let by_speed = MINIMUM_JERK_SPEED * distance_rad / speed;
        let by_acceleration = (MINIMUM_JERK_ACCELERATION * distance_rad / acceleration).sqrt();
        let by_jerk = (MINIMUM_JERK_JERK * distance_rad / jerk).cbrt();
        by_speed.max(by_acceleration).max(by_jerk)
    });
    let needed = needed.fold(0.0, f64::max);
    let tip_limit = TIP_SPEED_SHARE * limits.tip_speed_m_per_s;
    // Speed of the tip times the duration of the move.
    let peak_m = (0..=POINTS).map(|k| {
        let x = f64::from(k) / f64::from(POINTS);
        let (share, rate, _) = supple_core::math::smooth_step(x);
        let rows = jacobian(&config.arm, &(from_rad + way * share));
        let velocity: Vector3<f64> = rows.fixed_rows::<3>(0) * (way * rate);
        velocity.norm()
    });
    needed.max(peak_m.fold(0.0, f64::max) / tip_limit)
}
