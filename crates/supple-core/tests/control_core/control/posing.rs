//! The pose mode with the arm in the loop: it follows positions and orientations, removes energy, stops near singular poses,
//! and refuses requests that it cannot perform.

use crate::support::configs::{four, seven, seven_active, unlimited};
use crate::support::plant::{Plant, nothing, push};
use crate::support::property::{check, per_joint};
use crate::support::rig::{Rig, bent_wrist};
use crate::support::size;
use proptest::prelude::*;
use std::f64::consts::PI;
use supple_core::config::{Config, Gains, Role, RotationalGains};
use supple_core::controller::{
    CycleRecord, Fault, Mode, Refusal, Request, SafeAction, check_motion,
};
use supple_core::dynamics::{jacobian, kinetic_energy, tip_pose};
use supple_core::math::{Matrix3, Vector3};
use supple_core::nalgebra::{Rotation3, Unit};
use supple_core::trajectory::{Line, Rotation, Sinusoid, Trajectory};
use supple_core::{Arm, Input, Output, Vector};

const AXIS: [f64; 3] = [0.48, -0.6, 0.64];

pub(super) fn turn(angle_rad: f64, duration_s: f64) -> Rotation {
    Rotation {
        axis: Vector3::from(AXIS),
        angle_rad,
        duration_s,
    }
}

pub(super) fn pose(trajectory: Trajectory, rotation: Rotation) -> Request<7> {
    Request::TrackPose {
        trajectory,
        rotation,
    }
}

/// A configuration without limits that a large error would exceed, and with a loop that is fast compared with the arm's motion.
pub(super) fn free() -> Config<7> {
    let mut config = seven_active();
    unlimited(&mut config);
    config.limits.joint_speed_rad_per_s.fill(50.0);
    config.limits.tip_speed_m_per_s = 50.0;
    config.limits.tracking_error_m = 5.0;
    config.pose.rotation_error_rad = 3.2;
    config.pose.angular_speed_rad_per_s = 1e6;
    config.period_s = 2e-4;
    config.estimator_rad_per_s = 5000.0;
    config
}

pub(super) fn in_mode(config: Config<7>, q: Vector<7>, request: Request<7>) -> (Rig<7>, Plant<7>) {
    let mut rig = Rig::holding(config, q);
    let mut plant = Plant::at_rest(config.arm, q);
    let output = rig.drive(&mut plant, Some(request), nothing);
    assert_eq!((output.refusal, output.fault), (None, None));
    (rig, plant)
}

pub(super) fn run(
    rig: &mut Rig<7>,
    plant: &mut Plant<7>,
    cycles: usize,
    external: impl Fn(&Arm<7>, &Vector<7>, &Vector<7>) -> Vector<7> + Copy,
) -> Output<7> {
    let mut output = rig.drive(plant, None, external);
    for _ in 1..cycles {
        output = rig.drive(plant, None, external);
        assert_eq!(output.fault, None);
    }
    output
}

fn matrix(axis: Vector3<f64>, angle_rad: f64) -> Matrix3<f64> {
    *Rotation3::from_axis_angle(&Unit::new_normalize(axis), angle_rad).matrix()
}

fn angle_between(a: &Matrix3<f64>, b: &Matrix3<f64>) -> f64 {
    Rotation3::from_matrix_unchecked(a * b.transpose()).angle()
}

/// The arm rests at the requested point and orientation, independent of the path.
#[test]
fn an_exact_model_reaches_position_and_orientation() {
    let config = seven_active();
    let start = tip_pose(&config.arm, &bent_wrist());
    let from_m = start.translation;
    let to_m = from_m + Vector3::new(0.06, -0.08, 0.05);
    let line = Trajectory::Line(Line {
        from_m,
        to_m,
        duration_s: 3.0,
    });
    for angle_rad in [0.5, -0.4] {
        let request = pose(line, turn(angle_rad, 2.5));
        assert_eq!(
            check_motion(
                &Rig::new(config, bent_wrist()).controller,
                &bent_wrist(),
                &request
            ),
            Ok(())
        );
        let (mut rig, mut plant) = in_mode(config, bent_wrist(), request);
        let output = run(&mut rig, &mut plant, 5000, nothing);
        assert_eq!(output.mode, Mode::TrackPose);
        let tip = tip_pose(&plant.arm, &plant.q);
        let wanted = matrix(Vector3::from(AXIS), angle_rad) * start.rotation;
        let (distance_m, angle) = (
            (tip.translation - to_m).norm(),
            angle_between(&wanted, &tip.rotation),
        );
        assert!(distance_m < 1e-3, "{distance_m} m");
        assert!(angle < 1e-2, "{angle} rad");
        let recorded = output.orientation.expect("a reference");
        assert!((recorded.base_from_tip - wanted).norm() < 1e-12);
        assert!((recorded.error_rad.norm() - angle).abs() < 1e-6);
    }
}

/// Along the whole way, not only at its end.
#[test]
fn an_exact_model_follows_a_sinusoid_while_the_tip_turns() {
    let mut config = seven_active();
    config.estimator_rad_per_s = 500.0;
    let start = tip_pose(&config.arm, &bent_wrist());
    let sinusoid = Trajectory::Sinusoid(Sinusoid {
        centre_m: start.translation,
        amplitude_m: Vector3::new(0.0, 0.08, 0.0),
        angular_frequency_rad_per_s: 1.5,
        ramp_s: 1.0,
    });
    let (mut rig, mut plant) = in_mode(config, bent_wrist(), pose(sinusoid, turn(0.4, 3.0)));
    let mut furthest = 0.0_f64;
    for _ in 0..6000 {
        let output = rig.run(&mut plant);
        assert_eq!(output.fault, None);
        let tip = tip_pose(&plant.arm, &plant.q);
        let reference = output.reference.expect("a reference");
        let distance_m = (tip.translation - reference.position).norm();
        assert!(distance_m < 2e-3, "{distance_m} m");
        let angle = output.orientation.expect("a reference").error_rad.norm();
        furthest = furthest.max(angle);
    }
    assert!(furthest < 3e-2, "{furthest} rad");
}

/// The tip yields to a force and to a moment like springs, also with unequal stiffness of the axes.
#[test]
fn the_tip_yields_as_springs() {
    let mut config = seven_active();
    config.pose.gains.stiffness_nm_per_rad = Vector3::new(2.0, 3.0, 4.0);
    let start = tip_pose(&config.arm, &bent_wrist());
    let (mut rig, mut plant) = in_mode(
        config,
        bent_wrist(),
        pose(Trajectory::Hold(start.translation), Rotation::NONE),
    );
    let (force_n, moment_nm) = (
        Vector3::new(1.0, 2.0, -1.5),
        Vector3::new(0.03, -0.02, 0.04),
    );
    let hand = move |arm: &Arm<7>, q: &Vector<7>, qd: &Vector<7>| {
        let jacobian = jacobian(arm, q);
        push(arm, q, &force_n) + jacobian.fixed_rows::<3>(3).tr_mul(&moment_nm)
            - qd.component_mul(&Vector::from([1.0, 1.0, 1.0, 1.0, 0.05, 0.05, 0.02]))
    };
    run(&mut rig, &mut plant, 12_000, hand);
    let tip = tip_pose(&plant.arm, &plant.q);
    let stiffness = config.law.gains.stiffness_n_per_m;
    let moved = tip.translation - start.translation;
    assert!((stiffness.component_mul(&moved) - force_n).norm() < 0.02 * force_n.norm());
    let turned = Rotation3::from_matrix_unchecked(tip.rotation * start.rotation.transpose());
    let torque = config
        .pose
        .gains
        .stiffness_nm_per_rad
        .component_mul(&turned.scaled_axis());
    assert!(
        (torque - moment_nm).norm() < 0.02 * moment_nm.norm(),
        "{torque}"
    );
}

/// Energy of the arm and of both springs \[J\]; gravity is compensated.
fn energy_j(
    plant: &Plant<7>,
    gains: &Gains,
    rotational: &RotationalGains,
    output: &Output<7>,
) -> f64 {
    let tip = tip_pose(&plant.arm, &plant.q);
    let error = output.reference.expect("one").position - tip.translation;
    let wanted = output.orientation.expect("one").base_from_tip;
    let turn = Rotation3::from_matrix_unchecked(wanted * tip.rotation.transpose());
    let spring = turn.axis().map_or(0.0, |axis| {
        let pull = rotational.stiffness_nm_per_rad.component_mul(&axis);
        (1.0 - turn.angle().cos()) * axis.dot(&pull)
    });
    kinetic_energy(&plant.arm, &plant.q, &plant.qd)
        + 0.5 * error.dot(&gains.stiffness_n_per_m.component_mul(&error))
        + spring
}

/// With the reference at rest the energy falls, from any error, also with unequal stiffness: the reference rotates within a
/// cycle, the tip follows. The law sets accelerations, and the inertia of the tip changes with the pose, so that the energy
/// oscillates, by at most a hundredth of its initial value.
#[test]
fn the_energy_of_a_resting_reference_only_falls() {
    let mut config = free();
    config.law.gains = Gains::isotropic(20.0, 20.0);
    for stiffness in [Vector3::repeat(0.5), Vector3::new(0.2, 0.5, 0.9)] {
        let rotational = RotationalGains {
            stiffness_nm_per_rad: stiffness,
            damping_nm_s_per_rad: Vector3::repeat(0.3),
        };
        config.pose.gains = rotational;
        for degrees in [20.0_f64, 60.0, 100.0, 170.0] {
            let tip = tip_pose(&config.arm, &bent_wrist()).translation;
            let rotation = turn(degrees.to_radians(), 1e-4);
            let request = pose(Trajectory::Hold(tip), rotation);
            let (mut rig, mut plant) = in_mode(config, bent_wrist(), request);
            let output = run(&mut rig, &mut plant, 1, nothing);
            let start = energy_j(&plant, &config.law.gains, &rotational, &output);
            let mut before = start;
            for _ in 0..200 {
                let output = run(&mut rig, &mut plant, 50, nothing);
                let now = energy_j(&plant, &config.law.gains, &rotational, &output);
                assert!(
                    now <= before + 0.01 * start,
                    "{degrees} degrees: {before} J, then {now} J of {start} J"
                );
                before = now;
            }
            assert!(before < 0.9 * start, "{before} J of {start} J after 2 s");
        }
    }
}

/// Pushed to a singular pose, the arm stops with a fault before the task is damped, and its torque stays bounded.
#[test]
fn a_singular_pose_is_a_fault() {
    let mut config = free();
    config.law.gains = Gains::isotropic(5.0, 20.0);
    config.pose.gains = RotationalGains::isotropic(0.5, 0.3);
    check(6, per_joint::<7>(0.3), |bend| {
        let from = bent_wrist() + bend * 0.3;
        let tip = tip_pose(&config.arm, &from).translation;
        let request = pose(Trajectory::Hold(tip), Rotation::NONE);
        let (mut rig, mut plant) = in_mode(config, from, request);
        // The push stretches the elbow and aligns the wrist against the springs; both poses are singular.
        let hand = move |_: &Arm<7>, q: &Vector<7>, qd: &Vector<7>| {
            let stiffness = Vector::from([30.0, 30.0, 20.0, 30.0, 2.0, 2.0, 0.5]);
            (-q).component_mul(&stiffness) - qd.component_mul(&stiffness)
        };
        let gravity = |q: &Vector<7>| supple_core::dynamics::gravity(&config.arm, q);
        for _ in 0..20_000 {
            let output = rig.drive(&mut plant, None, hand);
            if let Some(fault) = output.fault {
                prop_assert_eq!(fault, Fault::Singular);
                return Ok(());
            }
            let beyond = size(&(output.torques.total() - gravity(&plant.q)));
            prop_assert!(beyond < 60.0, "{beyond} N m");
        }
        prop_assert!(false, "no fault");
        Ok(())
    });
}

/// A hand, modelled as a spring and a damper, pulls the arm into a singular pose, through the fault and the stop. The controller
/// adds no energy: the energy of the arm, of the law's springs until the fault, and of the hand never exceeds its initial value,
/// and then falls.
#[test]
fn energy_stays_bounded_into_a_singular_pose() {
    let mut config = free();
    let rotational = RotationalGains::isotropic(0.5, 0.3);
    config.law.gains = Gains::isotropic(5.0, 20.0);
    config.pose.gains = rotational;
    let gains = config.law.gains;
    let stiffness = Vector::from([30.0, 30.0, 20.0, 30.0, 2.0, 2.0, 0.5]);
    let hand = move |_: &Arm<7>, q: &Vector<7>, qd: &Vector<7>| {
        (-q).component_mul(&stiffness) - qd.component_mul(&stiffness)
    };
    let pulled_j = |q: &Vector<7>| 0.5 * q.dot(&q.component_mul(&stiffness));
    check(6, per_joint::<7>(0.3), |bend| {
        let from = bent_wrist() + bend * 0.3;
        let tip = tip_pose(&config.arm, &from).translation;
        let request = pose(Trajectory::Hold(tip), Rotation::NONE);
        let (mut rig, mut plant) = in_mode(config, from, request);
        let start = pulled_j(&plant.q);
        let (mut fault, mut max, mut now) = (None, start, start);
        for _ in 0..30_000 {
            let output = rig.drive(&mut plant, None, hand);
            fault = fault.or(output.fault);
            let of_arm = match output.mode {
                Mode::TrackPose => energy_j(&plant, &gains, &rotational, &output),
                _ => kinetic_energy(&plant.arm, &plant.q, &plant.qd),
            };
            now = of_arm + pulled_j(&plant.q);
            max = now.max(max);
            if output.safe_action == Some(SafeAction::Brake) {
                break;
            }
        }
        prop_assert_eq!(fault, Some(Fault::Singular));
        prop_assert!(max < 1.02 * start, "{start} J, then {max} J");
        prop_assert!(now < 0.9 * start, "{start} J, at last {now} J");
        Ok(())
    });
}

/// The posture acts on the elbow, and neither on position nor orientation of the tip.
#[test]
fn a_posture_brings_the_elbow_back() {
    let swing = |posture: bool| {
        let mut config = seven_active();
        if posture {
            config.pose.posture_stiffness_nm_per_rad.fill(3.0);
            config.pose.posture_torque_nm.fill(0.5);
        }
        let tip = tip_pose(&config.arm, &bent_wrist());
        let request = pose(Trajectory::Hold(tip.translation), Rotation::NONE);
        let (mut rig, mut plant) = in_mode(config, bent_wrist(), request);
        let elbow = |_: &Arm<7>, _: &Vector<7>, _: &Vector<7>| {
            Vector::from([0.0, 0.0, 0.6, 0.0, 0.0, 0.0, 0.0])
        };
        run(&mut rig, &mut plant, 700, elbow);
        let away = plant.q - bent_wrist();
        run(&mut rig, &mut plant, 9000, nothing);
        let at = tip_pose(&plant.arm, &plant.q);
        assert!((at.translation - tip.translation).norm() < 2e-3);
        assert!(angle_between(&at.rotation, &tip.rotation) < 2e-2);
        (size(&away), size(&(plant.q - bent_wrist())))
    };
    let (away, back) = swing(true);
    let (_, stays) = swing(false);
    assert!(away > 0.02 && back < 0.3 * away, "{away}, {back} rad");
    assert!(stays > 2.0 * back, "{stays}, {back} rad");
}

#[test]
fn requests_that_the_pose_mode_cannot_perform_are_refused() {
    let config = seven_active();
    let rig = Rig::holding(config, bent_wrist());
    let here = Trajectory::Hold(rig.tip());
    let refused = |request| rig.clone().request(request).refusal.expect("refused");
    let value = |request, name: &str| match refused(request) {
        Refusal::Value { entry, .. } => assert!(entry.contains(name), "{entry}"),
        Refusal::Trajectory(error) => assert!(error.entry.contains(name), "{error}"),
        other => panic!("{other:?}"),
    };
    let with = |change: fn(&mut Rotation)| {
        let mut rotation = turn(0.2, 1.0);
        change(&mut rotation);
        pose(here, rotation)
    };
    value(with(|r| r.axis *= 1.1), "axis");
    value(with(|r| r.axis.fill(0.0)), "axis");
    value(with(|r| r.axis.y = f64::NAN), "axis");
    value(with(|r| r.angle_rad = 3.15), "angle");
    value(with(|r| r.angle_rad = f64::NAN), "angle");
    value(with(|r| r.duration_s = 0.0), "duration");
    value(with(|r| r.duration_s = f64::INFINITY), "duration");
    value(with(|r| r.angle_rad = PI), "angular speed");
    value(with(|r| r.duration_s = 0.1), "angular speed");
    let away = Trajectory::Hold(rig.tip() + Vector3::new(0.06, 0.0, 0.0));
    assert!(matches!(
        refused(pose(away, turn(0.2, 1.0))),
        Refusal::FarFromStart { .. }
    ));
    let garbage = Trajectory::Hold(Vector3::repeat(f64::NAN));
    assert!(matches!(
        refused(pose(garbage, turn(0.2, 1.0))),
        Refusal::Trajectory(_)
    ));
    // Damping that the delay does not allow.
    let mut stiff = seven_active();
    stiff.pose.gains.damping_nm_s_per_rad.fill(1.5);
    let rig = Rig::holding(stiff, bent_wrist());
    match rig.clone().request(rig.turn(0.2)).refusal {
        Some(Refusal::Value { entry, .. }) => assert!(entry.contains("delay"), "{entry}"),
        other => panic!("{other:?}"),
    }
    // A stretched arm cannot move its tip outwards.
    let rig = Rig::holding(config, Vector::zeros());
    assert_eq!(
        rig.clone().request(rig.turn(0.2)).refusal,
        Some(Refusal::Singular)
    );
}

#[test]
fn fewer_than_six_active_joints_have_no_pose() {
    fn refused<const N: usize>(config: Config<N>, q: Vector<N>) -> bool {
        let rig = Rig::holding(config, q);
        let request = rig.turn(0.1);
        let six = |refusal: Option<Refusal>| matches!(refusal, Some(Refusal::Value { limit, .. }) if limit == 6.0);
        six(rig.clone().request(request).refusal)
            && six(check_motion(&rig.controller, &q, &request).err())
    }
    assert!(refused(four(), crate::support::rig::bent()));
    assert!(refused(seven(), bent_wrist()));
    // Six are enough: the roll is held.
    let mut config = seven_active();
    config.roles[2] = Role::Held {
        position_rad: 0.2,
        stiffness_nm_per_rad: 600.0,
        damping_nm_s_per_rad: 10.0,
    };
    assert!(!refused(config, bent_wrist()));
    let start = tip_pose(&config.arm, &bent_wrist());
    let request = pose(Trajectory::Hold(start.translation), turn(0.3, 2.0));
    let (mut rig, mut plant) = in_mode(config, bent_wrist(), request);
    run(&mut rig, &mut plant, 4000, nothing);
    let tip = tip_pose(&plant.arm, &plant.q);
    let wanted = matrix(Vector3::from(AXIS), 0.3) * start.rotation;
    assert!((tip.translation - start.translation).norm() < 1e-3);
    assert!(angle_between(&wanted, &tip.rotation) < 1e-2);
}

/// A whole motion is checked before it begins: a rotation beyond a joint limit is refused.
#[test]
fn a_rotation_beyond_the_joint_limits_is_refused_before_it_begins() {
    let mut config = seven_active();
    config.limits.position_upper_rad[5] = 0.9;
    let rig = Rig::holding(config, bent_wrist());
    let axis = supple_core::math::Vector3::from(
        jacobian(&config.arm, &bent_wrist())
            .fixed_view::<3, 1>(3, 5)
            .into_owned(),
    );
    let request = pose(
        Trajectory::Hold(rig.tip()),
        Rotation {
            axis,
            angle_rad: 1.5,
            duration_s: 10.0,
        },
    );
    let refusal = check_motion(&rig.controller, &bent_wrist(), &request);
    assert!(
        matches!(refusal, Err(Refusal::BeyondJointStop { joint: 5, .. })),
        "{refusal:?}"
    );
}

#[test]
fn a_tip_that_is_rotated_away_from_its_reference_faults_and_stops() {
    let mut config = seven_active();
    config.pose.rotation_error_rad = 0.1;
    let mut rig = Rig::holding(config, bent_wrist());
    rig.accept(rig.turn(0.0));
    for _ in 0..200 {
        rig.q[6] += 1e-3;
        let output = rig.cycle();
        if let Some(fault) = output.fault {
            match fault {
                Fault::RotationError {
                    value_rad,
                    limit_rad,
                } => assert!(value_rad > limit_rad && limit_rad == 0.1 && value_rad < 0.11),
                other => panic!("{other}"),
            }
            assert_eq!(output.mode, Mode::Fault);
            assert_eq!((output.reference, output.orientation), (None, None));
            assert_eq!(size(&output.torques.stiffness), 0.0);
            return;
        }
    }
    panic!("no fault");
}

#[test]
fn rotational_gains_are_limited_and_ramped() {
    let mut rig = Rig::holding(seven_active(), bent_wrist());
    rig.accept(rig.turn(0.1));
    let ask = |stiffness: f64, damping: f64| Request::RotationalGains {
        gains: RotationalGains::isotropic(stiffness, damping),
        ramp_s: 0.1,
    };
    for (request, name) in [
        (ask(20.1, 0.01), "stiffness"),
        (ask(-0.1, 0.01), "stiffness"),
        (ask(f64::NAN, 0.01), "stiffness"),
        (ask(1.0, -1.0), "damping"),
        (ask(1.0, 3.0), "damping"),
        (ask(1.0, 1.9), "delay"),
    ] {
        match rig.request(request).refusal {
            Some(Refusal::Value { entry, .. }) => assert!(entry.contains(name), "{entry}"),
            other => panic!("{other:?}"),
        }
    }
    let before = rig.cycle().rotational_gains;
    rig.accept(ask(1.5, 0.01));
    let half = rig.cycles(50).rotational_gains;
    let end = rig.cycles(60).rotational_gains;
    assert_eq!(end, RotationalGains::isotropic(1.5, 0.01));
    let mean = (before.stiffness_nm_per_rad + end.stiffness_nm_per_rad) * 0.5;
    assert!((half.stiffness_nm_per_rad - mean).amax() < 0.05 * mean.amax());
}

/// The record of a cycle contains the reference as axis times angle, and the error.
#[test]
fn the_record_has_reference_and_error_of_the_orientation() {
    let mut rig = Rig::holding(seven_active(), bent_wrist());
    rig.accept(rig.turn(0.2));
    rig.cycles(700);
    rig.q[6] += 1e-3;
    let input: Input<7> = rig.input();
    let output = rig.step(&input);
    let record = CycleRecord::new(1, &input, &output);
    let orientation = output.orientation.expect("a reference");
    assert!(record.has_orientation_reference);
    let recorded = Rotation3::new(Vector3::from(record.reference_rotation_rad));
    assert!((recorded.matrix() - orientation.base_from_tip).norm() < 1e-12);
    assert_eq!(
        Vector3::from(record.rotation_error_rad),
        orientation.error_rad
    );
    let tip = tip_pose(&rig.controller.config().arm, &rig.q).rotation;
    let turned = Rotation3::new(orientation.error_rad).matrix() * tip;
    assert!((turned - orientation.base_from_tip).norm() < 1e-12);
    let rest = Rig::holding(seven_active(), bent_wrist()).cycle();
    assert!(rest.orientation.is_none());
}
