//! Duration of a joint-space move that stays below every limit of joints and tip.

use supple_core::dynamics::{gravity, jacobian, rnea};
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
/// Share of a torque limit that a move may need. Where gravity and dry friction leave less of it, acceleration takes at most
/// [`LEAST_SHARE`].
const TORQUE_SHARE: f64 = 0.9;
const LEAST_SHARE: f64 = 0.05;
/// Points at which the tip's speed and the torques are computed.
const POINTS: u32 = 64;

/// Returns the duration of a minimum-jerk move on a straight line in joint space \[s\]. The move takes at least one second, and
/// reaches at most half of the joint speed limits, 85 % of the tip's speed limit, 90 % of the torque limits, and the limits of
/// acceleration and jerk. The duration is rounded up to 0.01 s, so that equal moves give equal logs.
pub fn approach_s<const N: usize>(
    config: &Config<N>,
    from_rad: &Vector<N>,
    to_rad: &Vector<N>,
) -> f64 {
    let needed = within_limits_s(config, from_rad, to_rad).max(MOVE_S);
    (needed * 100.0).ceil() / 100.0
}

/// Returns the shortest duration of a minimum-jerk move on a straight line in joint space that reaches at most half of the joint
/// speed limits, 85 % of the tip's speed limit, 90 % of the torque limits, and the limits of acceleration and jerk \[s\]; zero if the arm
/// is at the target.
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
    needed
        .max(peak_m.fold(0.0, f64::max) / tip_limit)
        .max(within_torques_s(config, from_rad, &way))
}

/// Returns the shortest duration for which the torque limits suffice, with [`TORQUE_SHARE`] of them \[s\].
fn within_torques_s<const N: usize>(
    config: &Config<N>,
    from_rad: &Vector<N>,
    way_rad: &Vector<N>,
) -> f64 {
    let limits_nm = &config.limits.joint_torque_nm;
    let at = |k: u32| {
        let (share, rate, acceleration) =
            supple_core::math::smooth_step(f64::from(k) / f64::from(POINTS));
        let q = from_rad + way_rad * share;
        let gravity_nm = gravity(&config.arm, &q);
        // Torque of the motion times the square of its duration.
        let moving = rnea(
            &config.arm,
            &q,
            &(way_rad * rate),
            &(way_rad * acceleration),
        ) - gravity_nm;
        let squares = (0..N).map(|i| {
            let resting_nm = gravity_nm[i].abs() + config.friction[i].breakaway_nm;
            let left_nm = TORQUE_SHARE * limits_nm[i] - resting_nm;
            moving[i].abs() / left_nm.max(LEAST_SHARE * limits_nm[i])
        });
        squares.fold(0.0, f64::max)
    };
    (0..=POINTS).map(at).fold(0.0, f64::max).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use supple_core::math::smooth_step;
    use supple_model::Description;

    /// Returns the greatest share of a torque limit along the move, without viscous friction.
    fn torque_share(config: &Config<6>, from: &Vector<6>, way: &Vector<6>, duration_s: f64) -> f64 {
        let at = |k: u32| {
            let (share, rate, acceleration) = smooth_step(f64::from(k) / 1000.0);
            let torque_nm = rnea(
                &config.arm,
                &(from + way * share),
                &(way * (rate / duration_s)),
                &(way * (acceleration / duration_s.powi(2))),
            );
            let needed = |i: usize| torque_nm[i].abs() + config.friction[i].breakaway_nm;
            (0..6)
                .map(|i| needed(i) / config.limits.joint_torque_nm[i])
                .fold(0.0, f64::max)
        };
        (0..=1000).map(at).fold(0.0, f64::max)
    }

    /// With torque limits that gravity almost takes, a move is as slow as they require, and no slower.
    #[test]
    fn a_move_stays_within_the_torque_limits() {
        let yam = Description::asset("yam").expect("built in");
        let mut config = yam.config::<6>().expect("six joints");
        let from = yam.home::<6>().expect("six joints");
        let way = Vector::<6>::from_column_slice(&[0.6, 0.8, 0.5, -0.4, 0.3, 0.2]);
        let within = within_limits_s(&config, &from, &(from + way));
        let slow = torque_share(&config, &from, &way, 100.0);
        for (share, by_torque) in [(0.5, false), (0.85, true)] {
            let mut limited = config;
            for limit_nm in &mut limited.limits.joint_torque_nm {
                *limit_nm *= slow / share;
            }
            let duration_s = within_limits_s(&limited, &from, &(from + way));
            let found = torque_share(&limited, &from, &way, duration_s);
            assert!(
                found < 0.905,
                "{found} of the torque limit in {duration_s} s"
            );
            if by_torque {
                assert!(
                    duration_s > 1.05 * within,
                    "{duration_s} s, {within} s without limits"
                );
                let faster = torque_share(&limited, &from, &way, 0.8 * duration_s);
                assert!(
                    faster > 0.88,
                    "{faster} of the torque limit in a shorter time"
                );
            }
        }
        config.limits.joint_torque_nm *= 1e3;
        let unlimited = within_limits_s(&config, &from, &(from + way));
        assert!(unlimited <= within);
    }
}
