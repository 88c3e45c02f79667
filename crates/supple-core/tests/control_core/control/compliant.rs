//! Float and joint impedance with the arm in the loop: their torques, that the arm stays at rest, and that neither
//! adds energy to the arm.

use crate::support::configs::{four, friction, seven, three, unlimited};
use crate::support::plant::{Plant, nothing, push};
use crate::support::property::{check, per_joint};
use crate::support::rig::{Rig, bent};
use crate::support::{assert_close, size};
use proptest::prelude::*;
use supple_core::config::{Config, JointGains, Role};
use supple_core::controller::{Fault, Mode, Refusal, Request};
use supple_core::dynamics::{aba, gravity, kinetic_energy, tip_pose};
use supple_core::math::Vector3;
use supple_core::{Arm, Output, Vector};

/// A configuration without limits that a person who pushes the arm would exceed.
fn free<const N: usize>(mut config: Config<N>) -> Config<N> {
    unlimited(&mut config);
    config.limits.joint_speed_rad_per_s.fill(50.0);
    config.limits.tip_speed_m_per_s = 50.0;
    config.collision = supple_core::config::Collision::disabled();
    config
}

/// An arm at rest that has entered the mode.
fn in_mode<const N: usize>(
    config: Config<N>,
    q: Vector<N>,
    request: Request<N>,
) -> (Rig<N>, Plant<N>) {
    let mut rig = Rig::holding(config, q);
    let mut plant = Plant::at_rest(config.arm, q);
    rig.drive(&mut plant, Some(request), nothing);
    (rig, plant)
}

fn run<const N: usize>(
    rig: &mut Rig<N>,
    plant: &mut Plant<N>,
    cycles: usize,
    external: impl Fn(&Arm<N>, &Vector<N>, &Vector<N>) -> Vector<N> + Copy,
) -> Output<N> {
    let mut output = rig.drive(plant, None, external);
    for _ in 1..cycles {
        output = rig.drive(plant, None, external);
        assert_eq!(output.fault, None);
    }
    output
}

/// Seven active joints.
fn seven_active() -> Config<7> {
    let mut config = free(seven());
    config.roles = [Role::Active; 7];
    config
}

fn active<const N: usize>(config: &Config<N>, vector: Vector<N>) -> Vector<N> {
    Vector::from_fn(|i, _| match config.roles[i] {
        Role::Active => vector[i],
        Role::Held { .. } => 0.0,
    })
}

fn float_drifts<const N: usize>(config: Config<N>) {
    let config = free(config);
    check(20, per_joint::<N>(0.8), |share| {
        let reach = config.limits.position_upper_rad - Vector::repeat(config.limits.soft_zone_rad);
        let q = active(&config, reach.component_mul(&share));
        let (mut rig, mut plant) = in_mode(config, q, Request::Float);
        let output = run(&mut rig, &mut plant, 10_000, nothing);
        prop_assert_eq!(output.mode, Mode::Float);
        let moved =
            tip_pose(&plant.arm, &plant.q).translation - tip_pose(&plant.arm, &q).translation;
        prop_assert!(moved.norm() < 1e-3, "{} m", moved.norm());
        Ok(())
    });
}

#[test]
fn an_exact_model_floats_without_drift() {
    float_drifts(three());
    float_drifts(four());
    float_drifts(seven_active());
}

/// The controller compensates half of the arm's friction, so the energy from a hand only decreases.
#[test]
fn float_removes_energy() {
    let mut config = seven_active();
    config.friction = friction();
    for friction in &mut config.friction {
        friction.offset_nm = 0.0;
    }
    let arm_friction = |_: &Arm<7>, _: &Vector<7>, qd: &Vector<7>| {
        // The friction is smooth, and nowhere smaller than that of the model.
        Vector::from_fn(|i, _| {
            let model = config.friction[i];
            -(model.breakaway_nm * (qd[i] / 0.005).tanh() + model.viscous_nm_s_per_rad * qd[i])
        })
    };
    check(10, per_joint::<7>(0.7), |speed| {
        let (mut rig, mut plant) = in_mode(config, bent(), Request::Float);
        run(&mut rig, &mut plant, 300, arm_friction);
        plant.qd = speed;
        let mut before = kinetic_energy(&plant.arm, &plant.q, &plant.qd);
        let start = before;
        for _ in 0..80 {
            run(&mut rig, &mut plant, 50, arm_friction);
            let now = kinetic_energy(&plant.arm, &plant.q, &plant.qd);
            // A cycle of delay in gravity and Coriolis terms makes the energy oscillate slightly.
            prop_assert!(now <= before + 0.01 * start, "{before} J, then {now} J");
            before = now;
        }
        prop_assert!(before < 0.05 * start, "{before} J of {start} J after 4 s");
        Ok(())
    });
}

/// A hand pushes the tip: the acceleration of the arm is that of the push alone.
#[test]
fn float_does_not_resist_a_push() {
    let config = free(four());
    let (mut rig, mut plant) = in_mode(config, bent(), Request::Float);
    run(&mut rig, &mut plant, 400, nothing);
    let hand = Vector3::new(6.0, -4.0, 5.0);
    let at = plant.q;
    let output = run(&mut rig, &mut plant, 1, move |arm, q, _| {
        push(arm, q, &hand)
    });
    let push_nm = push(&plant.arm, &at, &hand);
    let expected = aba(
        &plant.arm,
        &at,
        &Vector::zeros(),
        &(gravity(&plant.arm, &at) + push_nm),
    ) * 1e-3;
    assert_close(&plant.qd, &expected, 1e-3 * size(&expected));
    assert_eq!(size(&output.torques.stiffness), 0.0);
}

#[test]
fn joint_impedance_yields_as_a_spring() {
    let config = free(four());
    let (mut rig, mut plant) = in_mode(
        config,
        bent(),
        Rig::holding(config, bent()).joint_impedance_request(),
    );
    let load = Vector3::new(2.0, 1.0, -3.0);
    // Long enough for the softest joint to come to rest.
    let hand = move |arm: &Arm<4>, q: &Vector<4>, qd: &Vector<4>| push(arm, q, &load) - qd * 5.0;
    let output = run(&mut rig, &mut plant, 12_000, hand);
    let wanted = active(&config, push(&plant.arm, &plant.q, &load));
    let spring = config
        .joint_gains
        .stiffness_nm_per_rad
        .component_mul(&(plant.q - bent()));
    assert_close(&active(&config, spring), &wanted, 0.02 * size(&wanted));
    assert_close(
        &output.torques.stiffness,
        &-active(&config, spring),
        0.01 * size(&wanted),
    );
    // A held joint keeps its own stiff loop.
    let held = (0..4)
        .find(|i| config.roles[*i] != Role::Active)
        .expect("one");
    assert!((plant.q[held] - bent::<4>()[held]).abs() < 0.02);
}

#[test]
fn joint_impedance_follows_its_line_with_an_exact_model() {
    let config = seven_active();
    let target_rad = active(&config, bent::<7>() + Vector::repeat(0.3));
    let request = Request::JointImpedance {
        target_rad,
        duration_s: 2.0,
    };
    let (mut rig, mut plant) = in_mode(config, bent(), request);
    let output = run(&mut rig, &mut plant, 4000, nothing);
    assert_eq!(output.mode, Mode::JointImpedance);
    let error = active(&config, plant.q - target_rad);
    assert!(size(&error) < 5e-3, "{error}");
    assert!(
        size(&output.torques.stiffness) < 0.1,
        "{}",
        output.torques.stiffness
    );
}

#[test]
fn the_spring_torque_is_bounded() {
    let mut config = free(four());
    config.limits.joint_torque_nm.fill(40.0);
    config.joint_gains.stiffness_nm_per_rad.fill(100.0);
    config.move_gains.stiffness_nm_per_rad.fill(100.0);
    let mut rig = Rig::holding(config, bent());
    rig.accept(rig.joint_impedance_request());
    rig.rest();
    for _ in 0..900 {
        rig.q[1] += 1e-3;
        rig.cycle();
    }
    let output = rig.rest();
    assert_eq!((output.mode, output.fault), (Mode::JointImpedance, None));
    assert_eq!(output.torques.stiffness[1], -10.0);
}

/// An arm that is faster than the limit of a compliant mode does not change to that mode and continues; a slower arm changes.
#[test]
fn compliant_modes_begin_below_their_speed_limits() {
    let config = four();
    let half = 0.5 * config.limits.joint_speed_rad_per_s[0];
    for share in [1.2, 0.8] {
        for compliant in 0..2 {
            let mut rig = Rig::holding(free_of_collisions(config), bent());
            for _ in 0..300 {
                rig.q[0] += share * half * config.period_s;
                assert_eq!(rig.cycle().fault, None);
            }
            let request = match compliant {
                0 => Request::Float,
                _ => Request::JointImpedance {
                    target_rad: rig.q,
                    duration_s: 1.0,
                },
            };
            rig.q[0] += share * half * config.period_s;
            let output = rig.request(request);
            match output.refusal {
                Some(Refusal::Value { value, limit, .. }) => {
                    assert!(
                        share > 1.0 && value > limit && limit == half,
                        "{value}, {limit}"
                    );
                    assert_eq!((output.mode, output.fault), (Mode::GravityHold, None));
                }
                other => assert!(share < 1.0 && other.is_none(), "{share}: {other:?}"),
            }
        }
    }
}

/// The speed limits are halved: a request for a faster motion is refused, and a faster joint is a fault.
#[test]
fn compliant_joints_have_half_of_the_speed_limits() {
    let config = four();
    let half = 0.5 * config.limits.joint_speed_rad_per_s[0];
    let mut rig = Rig::holding(config, bent());
    let distance_rad = 0.3;
    // The peak speed of a minimum-jerk motion is 15/8 of its mean.
    let line = |share: f64| Request::JointImpedance {
        target_rad: bent::<4>() + Vector::<4>::new(distance_rad, 0.0, 0.0, 0.0),
        duration_s: 1.875 * distance_rad / (half * share),
    };
    match rig.request(line(1.01)).refusal {
        Some(Refusal::TooFast {
            joint,
            limit_rad_per_s,
            ..
        }) => assert_eq!((joint, limit_rad_per_s), (0, half)),
        other => panic!("{other:?}"),
    }
    for (request, faults) in [
        (Request::GravityHold, false),
        (rig.joint_impedance_request(), true),
    ] {
        let mut rig = Rig::holding(free_of_collisions(config), bent());
        rig.accept(request);
        let output = (0..300)
            .map(|_| {
                rig.q[0] += 1.1 * half * config.period_s;
                rig.cycle()
            })
            .last();
        let fault = output.and_then(|output| output.fault);
        assert_eq!(
            matches!(fault, Some(Fault::JointSpeed { joint: 0, .. })),
            faults,
            "{request:?}: {fault:?}"
        );
    }
}

fn free_of_collisions(config: Config<4>) -> Config<4> {
    Config {
        collision: supple_core::config::Collision::disabled(),
        ..config
    }
}

#[test]
fn gains_are_limited_and_ramped() {
    let config = four();
    let mut rig = Rig::holding(config, bent());
    rig.accept(rig.joint_impedance_request());
    let stiffest = config.move_gains.stiffness_nm_per_rad;
    let gains_request = |stiffness: Vector<4>, damping: f64| Request::JointGains {
        gains: JointGains {
            stiffness_nm_per_rad: stiffness,
            damping_nm_s_per_rad: Vector::repeat(damping),
        },
        ramp_s: 0.1,
    };
    for (request, name) in [
        (gains_request(stiffest * 1.01, 1.0), "stiffness"),
        (gains_request(-stiffest * 0.01, 1.0), "stiffness"),
        (gains_request(stiffest * f64::NAN, 1.0), "stiffness"),
        (gains_request(stiffest * 0.01, -1.0), "damping"),
        (gains_request(stiffest * 0.01, 1e4), "at the delay"),
    ] {
        match rig.request(request).refusal {
            Some(Refusal::Value { entry, .. }) => assert!(entry.contains(name), "{entry}"),
            other => panic!("{other:?}"),
        }
    }
    let before = rig.cycle().joint_gains;
    rig.accept(gains_request(stiffest * 0.05, 0.6));
    let half = rig.cycles(50).joint_gains;
    let end = rig.cycles(60).joint_gains;
    assert_eq!(end.stiffness_nm_per_rad, stiffest * 0.05);
    let mean = (before.stiffness_nm_per_rad + end.stiffness_nm_per_rad) * 0.5;
    assert!((half.stiffness_nm_per_rad - mean).amax() < 0.05 * mean.amax());
}
