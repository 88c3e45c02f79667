//! Upper limits of TOML values, far above any real arm: they catch wrong units and misplaced digits before the arm
//! moves. The core itself accepts any finite number.

use supple_core::Config;
use supple_core::controller::ConfigError;

/// Returns the first entry above its upper limit, if any.
pub(crate) fn first_out_of_range<const N: usize>(config: &Config<N>) -> Option<ConfigError> {
    let limits = &config.limits;
    let one = |entry: &'static str, value: f64, max: f64, must: &'static str| {
        (value > max).then_some(ConfigError {
            entry,
            joint: None,
            value,
            must,
        })
    };
    let hundred_k = "at most 100,000";
    let ones = [
        one("period_s", config.period_s, 0.1, "at most 0.1"),
        one(
            "estimator_rad_per_s",
            config.estimator_rad_per_s,
            1e5,
            hundred_k,
        ),
        one(
            "[latch] observer_rad_per_s",
            config.latch.observer_rad_per_s,
            1e5,
            hundred_k,
        ),
        one("handover_s", config.handover_s, 60.0, "at most 60"),
        one(
            "[pose] max_stiffness_nm_per_rad",
            config.pose.max_stiffness_nm_per_rad,
            1e4,
            "at most 10,000",
        ),
        one(
            "[pose] max_damping_nm_s_per_rad",
            config.pose.max_damping_nm_s_per_rad,
            1e3,
            "at most 1000",
        ),
        one(
            "[pose] angular_speed_rad_per_s",
            config.pose.angular_speed_rad_per_s,
            100.0,
            "at most 100",
        ),
        one(
            "[pose] rotation_error_rad",
            config.pose.rotation_error_rad,
            6.3,
            "at most 6.3",
        ),
        one(
            "[limits] soft_zone_rad",
            limits.soft_zone_rad,
            6.3,
            "at most 6.3",
        ),
        one(
            "[limits] joint_tracking_error_rad",
            limits.joint_tracking_error_rad,
            6.3,
            "at most 6.3",
        ),
        one(
            "[limits] start_error_m",
            limits.start_error_m,
            1.0,
            "at most 1",
        ),
        one(
            "[limits] tracking_error_m",
            limits.tracking_error_m,
            10.0,
            "at most 10",
        ),
        one(
            "[limits] tip_speed_m_per_s",
            limits.tip_speed_m_per_s,
            20.0,
            "at most 20",
        ),
        one(
            "[limits] tip_acceleration_m_per_s2",
            limits.tip_acceleration_m_per_s2,
            1e3,
            "at most 1,000",
        ),
        one(
            "[limits] max_stiffness_n_per_m",
            limits.stiffness_n_per_m,
            1e5,
            hundred_k,
        ),
        one(
            "[limits] max_damping_n_s_per_m",
            limits.damping_n_s_per_m,
            1e4,
            "at most 10,000",
        ),
        one(
            "[limits] stale_cycles",
            f64::from(limits.stale_cycles),
            20.0,
            "at most 20",
        ),
        one(
            "[collision] tip_force_n",
            config.collision.tip_force_n,
            1e5,
            hundred_k,
        ),
        one(
            "[plausible] load_n",
            config.plausible.load_n,
            1e5,
            hundred_k,
        ),
        one(
            "[plausible] stuck_rad",
            config.plausible.stuck_rad,
            6.3,
            "at most 6.3",
        ),
        one(
            "[plausible] lost_replies",
            f64::from(config.plausible.lost_replies),
            1000.0,
            "at most 1,000",
        ),
    ];
    let each = |entry, values: &supple_core::Vector<N>, max: f64, must| {
        let joint = (0..N).find(|joint| values[*joint] > max)?;
        Some(ConfigError {
            entry,
            joint: Some(joint),
            value: values[joint],
            must,
        })
    };
    let million = "at most 1,000,000";
    let joints = [
        each(
            "speed_rad_per_s",
            &limits.joint_speed_rad_per_s,
            100.0,
            "at most 100",
        ),
        each("torque_nm", &limits.joint_torque_nm, 1e5, hundred_k),
        each("motor torque_nm", &limits.motor_torque_nm, 1e5, hundred_k),
        each(
            "torque_rate_nm_per_s",
            &limits.torque_rate_nm_per_s,
            1e7,
            "at most 10,000,000",
        ),
        each(
            "acceleration_rad_per_s2",
            &limits.joint_acceleration_rad_per_s2,
            1e4,
            "at most 10,000",
        ),
        each(
            "jerk_rad_per_s3",
            &limits.joint_jerk_rad_per_s3,
            1e6,
            million,
        ),
        each(
            "soft_stiffness_nm_per_rad",
            &limits.soft_stiffness_nm_per_rad,
            1e6,
            million,
        ),
        each(
            "soft_damping_nm_s_per_rad",
            &limits.soft_damping_nm_s_per_rad,
            1e5,
            hundred_k,
        ),
        each(
            "move_stiffness_nm_per_rad",
            &config.move_gains.stiffness_nm_per_rad,
            1e6,
            million,
        ),
        each(
            "move_damping_nm_s_per_rad",
            &config.move_gains.damping_nm_s_per_rad,
            1e5,
            hundred_k,
        ),
        each(
            "impedance_stiffness_nm_per_rad",
            &config.joint_gains.stiffness_nm_per_rad,
            1e6,
            million,
        ),
        each(
            "impedance_damping_nm_s_per_rad",
            &config.joint_gains.damping_nm_s_per_rad,
            1e5,
            hundred_k,
        ),
        each(
            "posture_stiffness_nm_per_rad",
            &config.pose.posture_stiffness_nm_per_rad,
            1e6,
            million,
        ),
        each(
            "posture_torque_nm",
            &config.pose.posture_torque_nm,
            1e5,
            hundred_k,
        ),
        each(
            "hold_damping_nm_s_per_rad",
            &config.hold_damping_nm_s_per_rad,
            1e5,
            hundred_k,
        ),
    ];
    ones.into_iter().chain(joints).flatten().next()
}
