//! Valid configurations of the WAM's size. No friction unless a test adds it.

use super::arms::{wam3, wam4, wam7};
use supple_core::config::{
    ApparentInertia, Collision, ContactLatch, FrictionVelocity, Gains, JointGains, JointNames, Law,
    Limits, PlausibilityLimits, PoseLaw, Role, Workspace,
};
use supple_core::learned::LearnedTerms;
use supple_core::{Arm, Config, Friction, Matrix, RippleTable, Vector};

/// Held with the gains of the shoulder roll.
pub fn held(position_rad: f64) -> Role {
    Role::Held {
        position_rad,
        stiffness_nm_per_rad: 600.0,
        damping_nm_s_per_rad: 10.0,
    }
}

pub fn three() -> Config<3> {
    config(
        wam3(),
        [Role::Active; 3],
        Matrix::from_diagonal(&Vector::<3>::new(-1.0 / 42.0, 1.0 / 28.25, -1.0 / 18.0)),
        [2.6, 2.0, 3.1],
    )
}

/// The shoulder roll held at zero.
pub fn four() -> Config<4> {
    let (pitch, roll) = (1.0 / 56.5, 1.68 / 56.5);
    #[rustfmt::skip]
    let joint_from_motor = Matrix::<4, 4>::new(
        -1.0 / 42.0, 0.0, 0.0, 0.0,
        0.0, pitch, -pitch, 0.0,
        0.0, -roll, -roll, 0.0,
        0.0, 0.0, 0.0, -1.0 / 18.0,
    );
    let roles = [Role::Active, Role::Active, held(0.0), Role::Active];
    config(wam4(), roles, joint_from_motor, [2.6, 2.0, 2.8, 3.1])
}

/// Four joints active, the wrist held.
pub fn seven() -> Config<7> {
    let mut roles = [Role::Active; 7];
    for role in &mut roles[4..] {
        *role = Role::Held {
            position_rad: 0.0,
            stiffness_nm_per_rad: 30.0,
            damping_nm_s_per_rad: 0.5,
        };
    }
    let mut joint_from_motor = Matrix::<7, 7>::identity() / 10.0;
    joint_from_motor
        .fixed_view_mut::<4, 4>(0, 0)
        .copy_from(&four().joint_from_motor);
    #[rustfmt::skip]
    joint_from_motor.fixed_view_mut::<2, 2>(4, 4).copy_from(
        &(Matrix::<2, 2>::new(1.0, 1.0, -1.0, 1.0) / (2.0 * 9.7)),
    );
    let reach = [2.6, 2.0, 2.8, 3.1, 1.2, 1.5, 3.0];
    Config {
        // For the small inertia of a wrist and the delay of the loop.
        move_gains: JointGains {
            stiffness_nm_per_rad: Vector::repeat(600.0),
            damping_nm_s_per_rad: Vector::from([5.0, 5.0, 5.0, 5.0, 0.05, 0.05, 0.005]),
        },
        joint_gains: JointGains {
            stiffness_nm_per_rad: Vector::from([20.0, 20.0, 20.0, 20.0, 1.0, 1.0, 0.2]),
            damping_nm_s_per_rad: Vector::from([1.0, 1.0, 1.0, 1.0, 0.02, 0.02, 0.005]),
        },
        ..config(wam7(), roles, joint_from_motor, reach)
    }
}

/// All seven joints active.
pub fn seven_active() -> Config<7> {
    Config {
        roles: [Role::Active; 7],
        // For the small inertia of a wrist and the delay of the loop.
        hold_damping_nm_s_per_rad: Vector::from([2.0, 2.0, 2.0, 2.0, 0.05, 0.05, 0.005]),
        ..seven()
    }
}

fn config<const N: usize>(
    arm: Arm<N>,
    roles: [Role; N],
    joint_from_motor: Matrix<N, N>,
    reach_rad: [f64; N],
) -> Config<N> {
    let all = Vector::<N>::repeat;
    let reach = Vector::from(reach_rad);
    Config {
        arm,
        friction: [Friction::NONE; N],
        roles,
        joint_from_motor,
        ripple: [RippleTable::NONE; N],
        learned: LearnedTerms::zero(),
        compliance_rad_per_nm: Vector::zeros(),
        period_s: 1e-3,
        estimator_rad_per_s: 200.0,
        law: Law {
            gains: Gains::isotropic(100.0, 20.0),
            inertia: ApparentInertia::Own,
            friction_velocity: FrictionVelocity::Reference,
            measured_stribeck: false,
            presliding_share: 1.0,
            inertial_feedforward: true,
            nullspace_damping_nm_s_per_rad: 2.0,
        },
        latch: latch(),
        move_gains: JointGains {
            stiffness_nm_per_rad: all(600.0),
            damping_nm_s_per_rad: all(5.0),
        },
        joint_gains: JointGains {
            stiffness_nm_per_rad: all(10.0),
            damping_nm_s_per_rad: all(1.0),
        },
        pose: PoseLaw::default(),
        float_friction_share: 0.5,
        hold_pose: false,
        hold_damping_nm_s_per_rad: all(2.0),
        handover_s: 0.1,
        limits: Limits {
            position_lower_rad: -reach,
            position_upper_rad: reach,
            soft_zone_rad: 0.1,
            soft_stiffness_nm_per_rad: all(300.0),
            soft_damping_nm_s_per_rad: all(10.0),
            joint_speed_rad_per_s: all(2.0),
            tip_speed_m_per_s: 1.5,
            tip_acceleration_m_per_s2: 20.0,
            joint_acceleration_rad_per_s2: all(100.0),
            joint_jerk_rad_per_s3: all(1e4),
            tracking_error_m: 0.25,
            joint_tracking_error_rad: 0.2,
            joint_torque_nm: all(80.0),
            motor_torque_nm: all(1.8),
            torque_rate_nm_per_s: all(1000.0),
            stale_cycles: 2,
            start_error_m: 0.05,
            stiffness_n_per_m: 1000.0,
            damping_n_s_per_m: 100.0,
        },
        collision: Collision::disabled(),
        plausible: PlausibilityLimits::disabled(),
        workspace: Workspace::UNBOUNDED,
        joint_names: JointNames::NONE,
    }
}

/// Smallest index of the joints that share motors, for each joint of these configurations.
pub fn motor_groups<const N: usize>() -> [usize; N] {
    let differential_and_wrist = [0, 1, 1, 3, 4, 4, 6];
    std::array::from_fn(|i| if N == 3 { i } else { differential_and_wrist[i] })
}

/// The rate-limited torque after `last_nm` towards `target_nm`: the steps of joints that share motors are
/// scaled together, so that none exceeds its limit.
pub fn rate_limited<const N: usize>(
    config: &Config<N>,
    last_nm: &Vector<N>,
    target_nm: &Vector<N>,
) -> Vector<N> {
    limited_step(
        &(config.limits.torque_rate_nm_per_s * config.period_s),
        last_nm,
        target_nm,
    )
}

/// The same in a fault, where a joint's full torque may be removed in 5 ms.
pub fn stop_limited<const N: usize>(
    config: &Config<N>,
    last_nm: &Vector<N>,
    target_nm: &Vector<N>,
) -> Vector<N> {
    let fast = config.limits.joint_torque_nm / 5e-3;
    let rate = fast.sup(&config.limits.torque_rate_nm_per_s);
    limited_step(&(rate * config.period_s), last_nm, target_nm)
}

/// The torque after one step of at most `max_nm` in each joint.
fn limited_step<const N: usize>(
    max_nm: &Vector<N>,
    last_nm: &Vector<N>,
    target_nm: &Vector<N>,
) -> Vector<N> {
    let step = target_nm - last_nm;
    let groups = motor_groups::<N>();
    Vector::from_fn(|i, _| {
        let share = (0..N)
            .filter(|j| groups[*j] == groups[i])
            .fold(1.0, |share: f64, j| share.min(max_nm[j] / step[j].abs()));
        last_nm[i] + step[i] * share
    })
}

/// Contact latch with round numbers.
pub fn latch() -> ContactLatch {
    ContactLatch {
        fade: true,
        observer_rad_per_s: 40.0,
        threshold_n: 3.0,
        friction_error: 0.05,
        contact_share: 0.0,
        reversal_s: 0.2,
        fade_s: 0.01,
        restore_s: 0.05,
        settle_s: 0.0,
        hold_friction: false,
        false_alarms_per_hour: f64::INFINITY,
        release_s: f64::INFINITY,
    }
}

/// Friction of the WAM's size, with Stribeck effect and offset.
pub fn friction<const N: usize>() -> [Friction; N] {
    std::array::from_fn(|i| Friction {
        viscous_nm_s_per_rad: 1.6 / (1.0 + i as f64),
        coulomb_nm: 1.2 / (1.0 + i as f64),
        breakaway_nm: 1.4 / (1.0 + i as f64),
        stribeck_rad_per_s: 0.05,
        offset_nm: 0.1 - 0.05 * i as f64,
        band_rad_per_s: 0.01,
        ..Friction::NONE
    })
}

/// Sets joint, motor and rate limits that no test reaches.
pub fn unlimited<const N: usize>(config: &mut Config<N>) {
    config.limits.joint_torque_nm.fill(1e6);
    config.limits.motor_torque_nm.fill(1e6);
    config.limits.torque_rate_nm_per_s.fill(1e12);
}
