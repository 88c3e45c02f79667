//! Tests of the safety module: causes of idle and of the emergency stop, rejected requests, and the state of the pendant.

use crate::support::*;
use supple_core::dynamics::{joint_poses, tip_pose};
use supple_core::nalgebra::Vector3;
use supple_emu::{ButtonPress, Cause, EmulatorConfig};
use supple_model::Description;
use supple_puck::status::MotorMode;

fn cause(host: &Host) -> Cause {
    host.arm().safety().cause()
}

fn motors_in(host: &Host, mode: MotorMode) -> bool {
    host.arm().pucks().iter().all(|puck| puck.mode() == mode)
}

/// The default limits are 4731 and 5204: a torque above the first causes a warning, a torque above the second
/// switches the arm to idle.
#[test]
fn torque_faults_follow_the_commanded_torque() {
    for (torque, lamp, mode) in [
        (4731, SAFE, ACTIVE),
        (-4731, SAFE, ACTIVE),
        (4732, WARNING, ACTIVE),
        (-5204, WARNING, ACTIVE),
        (5205, FAULT, IDLE),
        (-5205, FAULT, IDLE),
        (-8191, FAULT, IDLE),
    ] {
        let mut host = Host::active();
        host.send(0x401, &packed([0, 0, torque, 0]));
        host.listen(MS);
        assert_eq!(host.lamps()[1], lamp, "{torque}");
        assert_eq!(host.module_mode(), mode, "{torque}");
        if mode == IDLE {
            assert_eq!(cause(&host), Cause::Torque);
            assert!(motors_in(&host, MotorMode::Idle));
        }
    }
}

/// The module sends the motors their mode in a frame to all actuators.
#[test]
fn a_change_of_mode_is_sent_on_the_bus() {
    let mut host = Host::awake();
    host.listen(MS);
    host.press(ButtonPress::Activate);
    assert_eq!(host.receive_frames(MS), [(0x540, vec![0x88, 0, 2, 0])]);
    assert!(motors_in(&host, MotorMode::Torque));
    host.set(MODULE, MODE, IDLE);
    assert!(motors_in(&host, MotorMode::Idle));
}

#[test]
fn host_can_only_lower_the_mode() {
    let mut host = Host::active();
    host.set(MODULE, MODE, IDLE);
    assert_eq!((host.module_mode(), cause(&host)), (IDLE, Cause::Host));
    host.set(MODULE, MODE, ACTIVE);
    assert_eq!(host.module_mode(), IDLE);
    host.set(MODULE, MODE, E_STOP);
    assert_eq!(host.module_mode(), E_STOP);
    host.set(MODULE, MODE, IDLE);
    host.set(MODULE, MODE, ACTIVE);
    assert_eq!(host.module_mode(), E_STOP);
}

/// Missing positions switch the arm to idle after the configured time, and not before.
#[test]
fn missing_positions_cause_a_heartbeat_fault() {
    for heartbeat_ns in [100 * MS, 50 * MS] {
        let mut config = EmulatorConfig {
            zeroed: true,
            ..EmulatorConfig::wam(4)
        };
        config.safety.heartbeat_ns = heartbeat_ns;
        let mut host = Host::new(config);
        host.press(ButtonPress::Activate);
        host.cycles(5);
        // The last replies end within the millisecond of their request.
        host.listen(heartbeat_ns - 2 * MS);
        assert!(motors_in(&host, MotorMode::Torque));
        host.listen(2 * MS);
        assert!(motors_in(&host, MotorMode::Idle));
        assert_eq!(cause(&host), Cause::Heartbeat);
        assert_eq!(host.lamps(), [SAFE, SAFE, SAFE, FAULT, SAFE]);
    }
}

/// Faults are below 30 V and above 57 V, warnings below 36 V and above 54 V.
#[test]
fn the_bus_voltage_is_monitored() {
    for (volts, lamp, mode) in [
        (48, SAFE, ACTIVE),
        (36, SAFE, ACTIVE),
        (35, WARNING, ACTIVE),
        (30, WARNING, ACTIVE),
        (29, FAULT, IDLE),
        (54, SAFE, ACTIVE),
        (55, WARNING, ACTIVE),
        (57, WARNING, ACTIVE),
        (58, FAULT, IDLE),
    ] {
        let mut host = Host::active();
        host.arm_mut().safety_mut().set_voltage(volts);
        host.cycles(2);
        assert_eq!(host.lamps()[2], lamp, "{volts} V");
        assert_eq!(host.module_mode(), mode, "{volts} V");
    }
}

/// A fault stays on the pendant and blocks activation until Shift-Idle.
#[test]
fn a_fault_is_cleared_only_on_the_pendant() {
    let mut host = Host::active();
    host.send(0x401, &packed([8191, 0, 0, 0]));
    host.listen(MS);
    host.press(ButtonPress::Activate);
    assert_eq!(host.module_mode(), IDLE);
    assert_eq!(host.lamps()[1], FAULT);
    host.press(ButtonPress::Idle);
    assert_eq!(host.lamps()[1], SAFE);
    host.press(ButtonPress::Activate);
    assert_eq!(host.module_mode(), ACTIVE);
}

/// Speed that the module monitors, from the kinematics of the arm's description \[m/s\]: the larger one of the elbow
/// and of the point 350 mm beyond it, 10 mm behind the tip.
fn monitored_speed(before: &[f64; 4], after: &[f64; 4], elapsed_s: f64) -> f64 {
    let config = Description::asset("wam4").unwrap().config::<4>().unwrap();
    let points = |q: &[f64; 4]| {
        let elbow = joint_poses(&config.arm, &(*q).into())[3].translation;
        let tip = tip_pose(&config.arm, &(*q).into());
        let behind = tip.rotation * Vector3::new(0.0, 0.0, -0.01);
        [elbow, tip.translation + behind]
    };
    let moved = points(after).into_iter().zip(points(before));
    moved.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max) / elapsed_s
}

/// A falling arm is switched to idle as soon as its speed, computed over five cycles of positions, exceeds VL2.
#[test]
fn a_falling_arm_is_stopped_at_the_limit() {
    let mut host = Host::active();
    host.set(MODULE, VL1, 1024);
    host.set(MODULE, VL2, 2048);
    let pose = |host: &Host| -> [f64; 4] { host.arm().truth().position_rad.into() };
    let (mut speed, mut before) = (0.0, pose(&host));
    let mut warned = false;
    for _ in 0..2000 {
        host.cycles(1);
        if motors_in(&host, MotorMode::Idle) {
            break;
        }
        let after = pose(&host);
        speed = monitored_speed(&before, &after, 1e-3);
        before = after;
        warned |= host.arm().safety().pendant().velocity == supple_puck::safety::Level::Warning;
    }
    assert_eq!(cause(&host), Cause::Velocity);
    // The speed of a falling arm increases by 5 cm/s in the five milliseconds over which the module computes it.
    assert!((0.5..0.56).contains(&speed), "{speed} m/s");
    assert!(warned);
    assert_eq!(host.lamps()[0], FAULT);
}

#[test]
fn a_limit_of_zero_disables_the_limit() {
    let mut host = Host::active();
    host.set(MODULE, VL1, 0);
    host.set(MODULE, VL2, 0);
    host.cycles(300);
    assert_eq!(host.module_mode(), ACTIVE);
    assert_eq!(host.lamps()[0], SAFE);
}

/// Changes the reported position of motor 1 by `step` counts in each of `cycles` milliseconds.
fn shift_position(host: &mut Host, step: i32, cycles: usize) {
    for _ in 0..cycles {
        let counts = host.arm().pucks()[0].counts();
        host.set(1, P, counts + step);
        host.cycles(1);
    }
}

/// A jump of the counts is a velocity fault unless IFAULT makes the module ignore it. IFAULT counts down in each cycle
/// whose history contains the jump.
#[test]
fn redefined_positions_are_faults_unless_ignored() {
    let mut host = Host::active();
    host.set(MODULE, VL2, 4096);
    shift_position(&mut host, 5000, 1);
    host.cycles(5);
    assert_eq!(host.module_mode(), IDLE);
    assert_eq!(cause(&host), Cause::Velocity);

    let mut host = Host::active();
    host.set(MODULE, VL2, 4096);
    host.set(MODULE, IFAULT, 5);
    shift_position(&mut host, 5000, 1);
    host.cycles(10);
    assert_eq!(host.module_mode(), ACTIVE);
    assert_eq!(host.value(MODULE, IFAULT), 0);
}

/// Half a second after a velocity fault the arm must be slower than VL2.
#[test]
fn an_arm_that_does_not_slow_down_enters_the_emergency_stop() {
    for (keeps_moving, mode) in [(true, E_STOP), (false, IDLE)] {
        let mut host = Host::active();
        host.set(MODULE, VL2, 4096);
        shift_position(&mut host, 500, 20);
        assert_eq!(host.module_mode(), IDLE);
        shift_position(&mut host, 500, 350);
        assert_eq!(host.module_mode(), IDLE, "half a second has not passed");
        shift_position(&mut host, if keeps_moving { 500 } else { 0 }, 100);
        assert_eq!(host.module_mode(), mode);
    }
}
