//! Tests of normal operation: enabling, holding, laying down, rates.

use super::rig::Rig;
use supple_bus::{FaultKind, FaultRule, TrafficDirection};
use supple_core::controller::Request;
use supple_damiao::Status;
use supple_drive::{Drives, LossReason, Stage};
use supple_model::Description;

/// The motors are enabled with gravity torque from the first command on: the tip sags less than 2 mm, and no joint moves 0.01
/// rad.
#[test]
fn enabling_in_gravity_hold_moves_nothing() {
    fn check<const N: usize>(name: &str) {
        let mut rig = Rig::<N>::new(name, &[]);
        let (pose, tip_m) = (rig.arm().truth().position_rad, rig.tip_m());
        rig.activate();
        rig.run_s(0.5);
        let moved = (rig.arm().truth().position_rad - pose).amax();
        assert!(moved < 0.01, "{name}: {moved} rad");
        let sag_m = tip_m - rig.min_tip_m;
        assert!(sag_m < 0.002, "{name}: {sag_m} m");
        assert!(
            rig.max_speed_rad_per_s < 0.05,
            "{name}: {}",
            rig.max_speed_rad_per_s
        );
        assert_eq!(rig.plant.counters().tx_lost, 0);
        assert_eq!(rig.plant.counters().replies_lost, 0);
    }
    check::<7>("openarm");
    check::<6>("yam");
}

/// Expected: a motor has no torque for two cycles at most after it was enabled, until its first command; from that on, its torque
/// is that of gravity within the rounding of two frames (the shoulder's step is 26 mN m) and 0.02 N m of the loop.
#[test]
fn enabling_makes_no_step_in_torque() {
    fn check<const N: usize>(name: &str) {
        let mut rig = Rig::<N>::new(name, &[]);
        let config = rig.description.config::<N>().unwrap();
        rig.run(5);
        rig.request(Request::GravityHold);
        let (mut checked, mut waiting) = (0, [0; N]);
        for _ in 0..200 {
            rig.step();
            let truth = rig.arm().truth();
            let gravity_nm = supple_core::dynamics::gravity(&config.arm, &truth.position_rad);
            let torque_nm = rig.arm().motor_torque_nm();
            for (joint, motor) in rig.arm().motors().iter().enumerate() {
                if motor.status() != Status::Enabled {
                    continue;
                }
                let step_nm = (torque_nm[joint] - gravity_nm[joint]).abs();
                // Half a step of the code is as close to zero as a command comes.
                if torque_nm[joint].abs() < 0.014 && step_nm > 0.07 {
                    waiting[joint] += 1;
                    assert!(waiting[joint] <= 2, "{name} joint {joint}: {torque_nm}");
                    continue;
                }
                checked += 1;
                assert!(
                    step_nm < 0.07,
                    "{name} joint {joint}: {torque_nm} against {gravity_nm}"
                );
            }
        }
        assert!(checked > 100 * N, "{name}: {checked}");
    }
    check::<7>("openarm");
    check::<6>("yam");
}

/// The motors stay disabled in every mode except gravity hold, and without a controller that requests torque.
#[test]
fn motors_are_enabled_in_gravity_hold_only() {
    let mut rig = Rig::<7>::new("openarm", &[]);
    rig.run(100);
    assert!(rig.all(Status::Disabled));
    assert_eq!(rig.plant.drives(), Drives::Idle);
    rig.activate();
}

/// If the controller ends its torque request while the motors are being enabled, the motors are disabled and the arm is not laid
/// down. The replies of one motor are lost, so that enabling takes longer.
#[test]
fn ending_the_torque_request_while_motors_are_being_enabled_disables_them() {
    let cycles_until_enabled = |rig: &mut Rig<7>| {
        rig.run(5);
        rig.request(Request::GravityHold);
        let mut cycles = 0;
        while rig.all(Status::Disabled) {
            rig.step();
            cycles += 1;
        }
        cycles
    };
    let cycles = cycles_until_enabled(&mut Rig::<7>::new("openarm", &[]));
    let mut rig = Rig::<7>::new("openarm", &[]);
    rig.run(5);
    rig.request(Request::GravityHold);
    rig.run(cycles - 1);
    let rule =
        FaultRule::always(TrafficDirection::Received, FaultKind::Loss).only(|id| id.raw() == 0x17);
    rig.plant.drive_mut().bus_mut().add(rule);
    rig.step();
    assert!(rig.all(Status::Enabled));
    assert_eq!(rig.plant.drives(), Drives::Idle);
    rig.request(Request::Idle);
    rig.run(4);
    assert!(rig.all(Status::Disabled));
    rig.run_s(1.0);
    assert!(rig.all(Status::Disabled));
    let stages = rig.stage_names();
    assert!(!stages.contains(&"stowing"), "{stages:?}");
}

/// After an idle request, the arm is held, laid down and disabled, each with its reason, and no joint exceeds 0.5 rad/s.
#[test]
fn idle_lays_the_arm_down_before_the_motors_are_disabled() {
    fn check<const N: usize>(name: &str) {
        let mut rig = Rig::<N>::new(name, &[]);
        rig.activate();
        rig.request(Request::Idle);
        rig.run_s(20.0);
        assert_eq!(
            rig.stage_names(),
            [
                "resting", "active", "holding", "stowing", "lowering", "resting"
            ],
            "{name}"
        );
        for stage in &rig.stages[2..5] {
            let (Stage::Holding(reason, _)
            | Stage::Stowing(reason, _)
            | Stage::Lowering(reason, _)) = stage
            else {
                panic!("{stage:?}");
            };
            assert_eq!(*reason, LossReason::TorqueNotWanted);
        }
        assert!(rig.all(Status::Disabled), "{name}");
        assert!(
            rig.max_speed_rad_per_s < 0.5,
            "{name}: {} {:?}",
            rig.max_speed_rad_per_s,
            rig.fastest
        );
        let stow = rig.description.stow_rad().unwrap().to_vec();
        let off = rig.arm().truth().position_rad.iter().zip(&stow);
        let off = off.map(|(q, stow)| (q - stow).abs()).fold(0.0, f64::max);
        assert!(off < 0.1, "{name}: {off} rad from the rest pose");
        // No loss is latched: the operator may continue.
        rig.activate();
    }
    check::<7>("openarm");
    check::<6>("yam");
}

/// A shutdown during operation also lays the arm down.
#[test]
fn a_shutdown_lays_the_arm_down() {
    let mut rig = Rig::<7>::new("openarm", &[]);
    rig.activate();
    rig.plant.begin_shutdown();
    rig.run_s(15.0);
    assert!(rig.all(Status::Disabled));
    assert_eq!(
        rig.plant.guard().last_loss().unwrap().0,
        LossReason::ShuttingDown
    );
    assert_eq!(rig.plant.guard().stage(), Stage::Resting);
    assert!(rig.max_speed_rad_per_s < 0.5, "{}", rig.max_speed_rad_per_s);
}

/// Expected: a shutdown in any mode that applies torque, also during a motion, lays the arm down and disables its motors, and no
/// joint exceeds its speed limit.
#[test]
fn a_shutdown_in_every_mode_lays_the_arm_down() {
    type Begin = fn(&mut Rig<7>);
    let modes: [(&str, Begin); 5] = [
        ("gravity hold", |_| ()),
        ("float", |rig| rig.request(Request::Float)),
        ("move", |rig| rig.begin(false)),
        ("track", |rig| rig.begin(true)),
        ("while motors are being enabled", |rig| {
            *rig = Rig::new("openarm", &[]);
            rig.run(5);
            rig.request(Request::GravityHold);
            rig.run(3);
        }),
    ];
    for (mode, begin) in modes {
        let mut rig = Rig::<7>::new("openarm", &[]);
        rig.activate();
        begin(&mut rig);
        rig.run_s(0.2);
        rig.discard_measurements();
        rig.plant.begin_shutdown();
        rig.run_s(20.0);
        assert!(rig.all(Status::Disabled), "{mode}");
        assert_eq!(rig.plant.guard().stage(), Stage::Resting, "{mode}");
        let names = rig.stage_names();
        assert!(!names.contains(&"damping"), "{mode}: {names:?}");
        assert!(
            rig.max_speed_rad_per_s < 1.0,
            "{mode}: {}",
            rig.max_speed_rad_per_s
        );
    }
}

/// Expected, if asked: a shutdown holds the arm for as long as nobody supports it, within 10 mrad; then its torque fades and the
/// motors are disabled. A shutdown while the arm is being laid down after a loss holds it too.
#[test]
fn a_shutdown_holds_the_arm_until_it_is_supported() {
    let mut rig = Rig::<7>::new("openarm", &[]);
    rig.plant.hold_until_supported();
    rig.activate();
    let held_rad = rig.arm().truth().position_rad;
    rig.plant.begin_shutdown();
    rig.run_s(30.0);
    assert_eq!(rig.stage_names(), ["resting", "active", "holding"]);
    assert!(rig.plant.guard().waits_for_support());
    assert!(rig.all(Status::Enabled));
    let moved = (rig.arm().truth().position_rad - held_rad).amax();
    assert!(moved < 0.01, "{moved} rad");
    rig.plant.declare_supported();
    rig.run_s(1.0);
    assert!(rig.all(Status::Enabled));
    rig.run_s(1.0);
    assert!(rig.all(Status::Disabled));
    // Nobody supported this arm: it sank against the damping of its motors.
    assert!(rig.max_speed_rad_per_s < 2.0, "{}", rig.max_speed_rad_per_s);
    let names = rig.stage_names();
    assert_eq!(names[3..], ["releasing", "lowering", "resting"]);

    let mut rig = Rig::<7>::new("openarm", &[]);
    rig.plant.hold_until_supported();
    rig.activate();
    rig.request(Request::Idle);
    rig.run_s(1.5);
    assert!(matches!(rig.plant.guard().stage(), Stage::Stowing(..)));
    rig.plant.begin_shutdown();
    rig.run_s(10.0);
    assert!(rig.plant.guard().waits_for_support());
    assert!(rig.all(Status::Enabled));
}

/// Expected: a motor that reaches its fault temperature while the arm is held at shutdown ends the holding: the arm is laid down.
#[test]
fn a_hot_motor_ends_the_holding_at_a_shutdown() {
    let mut rig = Rig::<7>::new("openarm", &["hot:motor=2,celsius=97,at-s=3"]);
    rig.plant.hold_until_supported();
    rig.activate();
    rig.plant.begin_shutdown();
    rig.run_s(1.5);
    assert!(rig.plant.guard().waits_for_support());
    rig.run_s(20.0);
    assert!(rig.stage_names().contains(&"stowing"));
    assert_eq!(rig.plant.guard().stage(), Stage::Resting);
    let states: Vec<Status> = rig.arm().motors().iter().map(|m| m.status()).collect();
    assert!(rig.all(Status::Disabled), "{states:?}");
    assert!(rig.max_speed_rad_per_s < 0.5, "{}", rig.max_speed_rad_per_s);
}

/// Returns the OpenArm with motors that use classic frames.
fn classic_openarm() -> Description {
    let from = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/assets/openarm"));
    let folder = tempfile::tempdir().unwrap();
    let toml = std::fs::read_to_string(from.join("arm.toml")).unwrap();
    let toml = toml.replace("format = \"fd\"", "format = \"classic\"");
    std::fs::write(folder.path().join("arm.toml"), toml).unwrap();
    std::fs::copy(from.join("arm.urdf"), folder.path().join("arm.urdf")).unwrap();
    let path = folder.path().join("arm.toml");
    Description::find_at_rate(path.to_str().unwrap(), None).unwrap()
}

/// Gravity hold works at each rate that the bus allows.
#[test]
fn every_rate_that_the_bus_carries_holds_the_arm() {
    for (rate_hz, classic) in [
        (250, true),
        (400, true),
        (500, true),
        (500, false),
        (1000, false),
    ] {
        let description = if classic {
            classic_openarm()
        } else {
            Description::asset("openarm").unwrap()
        };
        let description = description.at_rate(f64::from(rate_hz)).unwrap();
        let mut rig = Rig::<7>::try_new(description, |_| (), None, &[]).unwrap();
        let pose = rig.arm().truth().position_rad;
        rig.activate();
        rig.run_s(1.0);
        let moved = (rig.arm().truth().position_rad - pose).amax();
        assert!(moved < 0.01, "{rate_hz} Hz: {moved} rad");
        assert_eq!(rig.plant.counters().replies_lost, 0, "{rate_hz} Hz");
        let load = rig.plant.counters().bus_load;
        assert!(load < 0.95, "{rate_hz} Hz: {load}");
    }
}
