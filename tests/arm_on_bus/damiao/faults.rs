//! Tests of every error code and every loss: the plant loop reports the fault within two cycles, holds the arm, lays it down
//! and disables the motors.

use super::rig::{MS, Rig};
use supple_bus::{FaultKind, FaultRule, TrafficDirection};
use supple_core::controller::Request;
use supple_damiao::Status;
use supple_drive::{Drive, LossReason, MotorFault, Stage};

/// Time of the misbehaviours after the enabling of the motors.
const AT: &str = "at-s=0.4";

/// Runs until normal operation ends; returns the reason.
fn until_lost(rig: &mut Rig<7>) -> LossReason {
    for _ in 0..1000 {
        rig.step();
        if rig.plant.guard().stage() != Stage::Active {
            break;
        }
    }
    rig.plant.guard().last_loss().expect("a loss").0
}

/// Returns the number of cycles between the start of the misbehaviour and the end of normal operation.
fn delay_cycles(rig: &Rig<7>) -> u64 {
    let began = rig.arm().events().iter().find_map(|(ns, event)| {
        matches!(event, supple_emu::damiao::MotorEvent::Misbehaves(_)).then_some(*ns)
    });
    let lost_ns = rig.plant.guard().last_loss().unwrap().1;
    lost_ns.saturating_sub(began.expect("it began")) / rig.period_ns
}

#[test]
fn every_error_code_is_reported_as_its_fault_within_two_cycles() {
    for (code, fault) in [
        ("8", MotorFault::OverVoltage),
        ("9", MotorFault::UnderVoltage),
        ("A", MotorFault::OverCurrent),
        ("B", MotorFault::HotDriver),
        ("C", MotorFault::HotWinding),
        ("D", MotorFault::CommunicationLost),
        ("E", MotorFault::Overload),
        ("5", MotorFault::Unknown(5)),
    ] {
        // The fault is at the last motor of the wrist, which does not carry the arm.
        let spec = format!("error:motor=7,code={code},{AT}");
        let mut rig = Rig::<7>::new("openarm", &[&spec]);
        rig.without_motor = Some(6);
        rig.activate();
        assert_eq!(until_lost(&mut rig), LossReason::Motor(6, fault), "{code}");
        assert!(delay_cycles(&rig) <= 2, "{code}: {}", delay_cycles(&rig));
        rig.run_s(15.0);
        assert_eq!(
            rig.stage_names(),
            [
                "resting", "active", "holding", "stowing", "lowering", "resting"
            ],
            "{code}"
        );
        let enabled = rig
            .arm()
            .motors()
            .iter()
            .any(|motor| motor.status() == Status::Enabled);
        assert!(!enabled, "{code}");
        assert!(
            rig.max_speed_rad_per_s < 0.5,
            "{code}: {} {:?}",
            rig.max_speed_rad_per_s,
            rig.fastest
        );
        // The motor is not enabled again without the operator: the error stays.
        rig.request(Request::Reset);
        rig.run(10);
        rig.request(Request::GravityHold);
        rig.run_s(0.3);
        let enabled = rig
            .arm()
            .motors()
            .iter()
            .any(|motor| motor.status() == Status::Enabled);
        assert!(!enabled, "{code}");
    }
}

#[test]
fn silent_restarted_and_hot_motors_are_reported() {
    for (spec, expected) in [
        (format!("silent:motor=7,{AT}"), LossReason::EncoderLost(6)),
        (
            format!("reappears:motor=7,{AT}"),
            LossReason::Motor(6, MotorFault::Disabled),
        ),
        (
            format!("hot:motor=7,celsius=110,{AT}"),
            LossReason::Motor(6, MotorFault::Hot),
        ),
    ] {
        let mut rig = Rig::<7>::new("openarm", &[&spec]);
        rig.without_motor = Some(6);
        rig.activate();
        assert_eq!(until_lost(&mut rig), expected, "{spec}");
        assert!(delay_cycles(&rig) <= 2, "{spec}: {}", delay_cycles(&rig));
        rig.run_s(15.0);
        let healthy = &rig.arm().motors()[..6];
        assert!(
            healthy.iter().all(|m| m.status() == Status::Disabled),
            "{spec}"
        );
        assert!(
            rig.max_speed_rad_per_s < 0.5,
            "{spec}: {} {:?}",
            rig.max_speed_rad_per_s,
            rig.fastest
        );
    }
}

/// Expected: a motor at 75 degrees warns and keeps its torque limit; at 88 degrees its limit falls, and the arm is still held.
#[test]
fn a_warm_motor_warns_before_its_limit_falls() {
    let spec = format!("hot:motor=2,celsius=75,{AT}");
    let hotter = "hot:motor=2,celsius=88,at-s=1.2".to_owned();
    let mut rig = Rig::<7>::new("openarm", &[&spec, &hotter]);
    rig.activate();
    assert_eq!(rig.plant.drive().temperature_warning(1), None);
    rig.run_s(0.5);
    let warning = rig.plant.drive().temperature_warning(1).unwrap();
    assert_eq!(rig.plant.drive().temperature_warning(2), None);
    assert!((70..=75).contains(&warning.celsius), "{warning:?}");
    assert_eq!(warning.torque_share, 1.0);
    rig.run_s(1.0);
    let warning = rig.plant.drive().temperature_warning(1).unwrap();
    assert!((81..=88).contains(&warning.celsius), "{warning:?}");
    assert!((0.5..1.0).contains(&warning.torque_share), "{warning:?}");
    assert_eq!(rig.plant.guard().stage(), Stage::Active);
    assert!(rig.all(Status::Enabled));
}

/// The controller is lost during a motion: the plant loop stops the arm, lays it down and disables the motors.
#[test]
fn a_controller_lost_in_motion_ends_with_the_arm_at_rest() {
    for track in [false, true] {
        let mut rig = Rig::<7>::new("openarm", &[]);
        rig.activate();
        rig.begin(track);
        rig.discard_measurements();
        rig.plant.link_mut().dead = true;
        rig.run_s(16.0);
        assert_eq!(
            rig.plant.guard().last_loss().unwrap().0,
            LossReason::NoAnswer
        );
        assert!(rig.all(Status::Disabled), "tracking: {track}");
        // The limit of the arm's joints is 2 rad/s.
        let speed = rig.max_speed_rad_per_s;
        assert!(speed < 1.5, "tracking: {track}: {speed} {:?}", rig.fastest);
    }
}

/// The controller is lost: the plant loop holds the arm, lays it down and disables the motors.
#[test]
fn a_lost_controller_ends_with_the_arm_at_rest() {
    let mut rig = Rig::<7>::new("openarm", &[]);
    rig.activate();
    let tip_m = rig.tip_m();
    rig.plant.link_mut().dead = true;
    rig.run_s(0.4);
    assert!(tip_m - rig.min_tip_m < 0.03, "{}", tip_m - rig.min_tip_m);
    rig.run_s(15.0);
    assert_eq!(
        rig.plant.guard().last_loss().unwrap().0,
        LossReason::NoAnswer
    );
    assert!(rig.all(Status::Disabled));
    assert!(rig.max_speed_rad_per_s < 0.5, "{}", rig.max_speed_rad_per_s);
}

/// The host is lost: within 20 ms and one period, no motor has torque.
#[test]
fn a_lost_host_ends_the_torque_within_the_watchdog() {
    use supple_bus::Bus;
    let mut rig = Rig::<7>::new("openarm", &[]);
    rig.activate();
    let bus = rig.plant.drive_mut().bus_mut();
    let until_ns = bus.now_ns() + 22 * MS;
    while bus.receive_until(until_ns).unwrap().is_some() {}
    assert!(rig.all(Status::CommunicationLost));
    assert_eq!(rig.arm().motor_torque_nm().amax(), 0.0);
}

/// A wedged adapter and a bus-off are reported, and the watchdogs of the motors end the torque.
#[test]
fn a_dead_bus_is_reported_and_the_watchdogs_end_the_torque() {
    for (spec, expected) in [
        (format!("wedged:{AT}"), LossReason::NotTransmitted),
        (format!("bus-off:{AT}"), LossReason::BusOff),
    ] {
        let mut rig = Rig::<7>::new("openarm", &[&spec]);
        rig.activate();
        assert_eq!(until_lost(&mut rig), expected, "{spec}");
        rig.run_s(0.03);
        assert!(rig.all(Status::CommunicationLost), "{spec}");
    }
}

/// Occasional lost replies are tolerated; a state is never used twice.
#[test]
fn single_lost_replies_are_tolerated() {
    let mut rig = Rig::<7>::new("openarm", &[]);
    rig.activate();
    let rule = FaultRule::always(TrafficDirection::Received, FaultKind::Loss)
        .only(|id| id.raw() == 0x13)
        .with_probability(0.02);
    rig.plant.drive_mut().bus_mut().add(rule);
    let mut missing = 0;
    for _ in 0..300 {
        rig.step();
        let report = rig.plant.link_mut().report.unwrap();
        missing += report.position_rad.iter().filter(|q| q.is_none()).count();
    }
    assert!(missing > 0);
    assert_eq!(rig.plant.counters().replies_lost, missing as u64);
}

/// Runs every row of the fault table while the arm moves and while it tracks: the same faults are reported in the same time, no
/// joint exceeds its allowed speed, and the motors are disabled at the end.
#[test]
fn the_fault_table_holds_while_moving_and_tracking() {
    let motor = |fault| LossReason::Motor(6, fault);
    let rows = [
        ("error:motor=7,code=8", motor(MotorFault::OverVoltage)),
        ("error:motor=7,code=9", motor(MotorFault::UnderVoltage)),
        ("error:motor=7,code=A", motor(MotorFault::OverCurrent)),
        ("error:motor=7,code=B", motor(MotorFault::HotDriver)),
        ("error:motor=7,code=C", motor(MotorFault::HotWinding)),
        ("error:motor=7,code=D", motor(MotorFault::CommunicationLost)),
        ("error:motor=7,code=E", motor(MotorFault::Overload)),
        ("silent:motor=7", LossReason::EncoderLost(6)),
        ("reappears:motor=7", motor(MotorFault::Disabled)),
        ("hot:motor=7,celsius=110", motor(MotorFault::Hot)),
        ("wedged", LossReason::NotTransmitted),
        ("bus-off", LossReason::BusOff),
    ];
    for track in [false, true] {
        for (kind, expected) in rows {
            let separator = if kind.contains(':') { ',' } else { ':' };
            // The fault is in the middle of each motion.
            let at_s = if track { 3 } else { 1 };
            let spec = format!("{kind}{separator}at-s={at_s}");
            let mut rig = Rig::<7>::new("openarm", &[&spec]);
            rig.without_motor = Some(6);
            rig.activate();
            rig.begin(track);
            rig.discard_measurements();
            for _ in 0..2000 {
                if rig.plant.guard().stage() != Stage::Active {
                    break;
                }
                rig.step();
            }
            let (reason, _) = rig.plant.guard().last_loss().expect("a loss");
            assert_eq!(reason, expected, "{spec}, tracking: {track}");
            let within = if expected == LossReason::NotTransmitted {
                12
            } else {
                2
            };
            let delay = delay_cycles(&rig);
            assert!(delay <= within, "{spec}, tracking: {track}: {delay} cycles");
            let powered = !matches!(expected, LossReason::NotTransmitted | LossReason::BusOff);
            rig.run_s(if powered { 12.0 } else { 0.03 });
            let enabled = rig.arm().motors()[..6]
                .iter()
                .any(|motor| motor.status() == Status::Enabled);
            assert!(!enabled, "{spec}, tracking: {track}");
            if powered {
                // The limit of the arm's joints is 2 rad/s.
                let speed = rig.max_speed_rad_per_s;
                assert!(
                    speed < 1.5,
                    "{spec}, tracking: {track}: {speed} {:?}",
                    rig.fastest
                );
                assert_eq!(rig.plant.guard().stage(), Stage::Resting, "{spec}");
            }
        }
    }
}
