//! Tests of motors without misbehaviour.

use super::host::{Host, MS, host, host_with_options};
use supple_bus::Bus;
use supple_core::{Vector, dynamics};
use supple_damiao::{Request, SpecialCommand, Status, flash, register};
use supple_emu::damiao::MotorEvent;
use supple_plant::PlantOptions;

fn tip_m<const N: usize>(host: &Host<N>) -> [f64; 3] {
    host.emulated().truth().tip_position_m.into()
}

fn distance_m(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b) * (a - b))
        .sum::<f64>()
        .sqrt()
}

fn starts_and_holds<const N: usize>(name: &str, period_ns: u64) {
    let mut host = host::<N>(name, |_| {}, None);
    let before = tip_m(&host);
    host.start().unwrap_or_else(|refusal| panic!("{refusal}"));
    let enabled = host
        .emulated()
        .motors()
        .iter()
        .all(|motor| motor.status() == Status::Enabled);
    assert!(enabled);
    let busy_ns = host.emulated().bus_busy_ns();
    let cycles = (500 * MS / period_ns) as u32;
    host.hold(cycles, period_ns);
    // Every motor replied to every command within the period.
    assert_eq!(host.answers, [1; N]);
    let load =
        (host.emulated().bus_busy_ns() - busy_ns) as f64 / (f64::from(cycles) * period_ns as f64);
    assert!((0.5..0.8).contains(&load), "{name}: bus load {load}");
    let sag_m = distance_m(before, tip_m(&host));
    assert!(sag_m < 2e-3, "{name} sags by {sag_m} m");
}

/// With gravity torque from the first frame on, the arm sags by less than 2 mm. Seven motors use FD at 1 kHz, six use
/// classic CAN at 400 Hz; a fifth of the bus time is free.
#[test]
fn an_arm_is_enabled_without_a_sag() {
    starts_and_holds::<7>("openarm", MS);
    starts_and_holds::<6>("yam", 5 * MS / 2);
}

/// Start-up sets registers in RAM only, and requests neither a flash write nor a zero position.
#[test]
fn start_up_does_not_write_flash() {
    let mut host = host::<7>("openarm", |config| config.allow_flash = true, None);
    host.start().unwrap();
    host.hold(100, MS);
    let flash = |event: &&(u64, MotorEvent)| matches!(event.1, MotorEvent::Flash(..));
    assert_eq!(host.emulated().events().iter().filter(flash).count(), 0);
    for motor in host.emulated().motors() {
        let timeout = u32::from_le_bytes(motor.register(supple_damiao::Register::TIMEOUT));
        assert_eq!(timeout, 400);
    }
}

#[test]
#[should_panic(expected = "write its flash: SetZero")]
fn a_set_zero_request_ends_the_emulation() {
    let mut host = host::<7>("openarm", |_| {}, None);
    host.exchange(flash::set_zero(2));
}

#[test]
#[should_panic(expected = "write its flash: StoreAll")]
fn a_store_request_ends_the_emulation() {
    let mut host = host::<7>("openarm", |_| {}, None);
    host.exchange(flash::store_all(3));
}

#[test]
fn flash_is_written_where_it_is_allowed() {
    let mut host = host::<7>("openarm", |config| config.allow_flash = true, None);
    host.exchange(flash::set_zero(2));
    assert!(
        host.emulated()
            .events()
            .iter()
            .any(|(_, event)| *event == MotorEvent::Flash(1, Request::SetZero))
    );
    let feedback = host.exchange(register::request_feedback(2));
    let found = supple_damiao::Feedback::parse(&feedback[0]).unwrap();
    assert!(found.position_rad(&host.ranges[1]).abs() < 1e-3);
}

/// If the host stops, the watchdog of each motor ends the torque within 20 ms, and the arm falls, because it has no brakes.
#[test]
fn the_watchdog_ends_the_torque_of_a_lost_host() {
    let mut host = host::<7>("openarm", |_| {}, None);
    host.start().unwrap();
    host.hold(100, MS);
    let before = tip_m(&host);
    let lost_ns = host.bus.now_ns();
    host.receive(lost_ns + 300 * MS);
    let mut ended = Vec::new();
    for (time_ns, event) in host.emulated().events() {
        if let MotorEvent::Status(motor, Status::CommunicationLost) = event {
            ended.push((*motor, time_ns - lost_ns));
        }
    }
    assert_eq!(ended.len(), 7);
    assert!(
        ended.iter().all(|(_, after_ns)| *after_ns <= 20 * MS),
        "{ended:?}"
    );
    assert_eq!(host.emulated().motor_torque_nm(), Vector::<7>::zeros());
    assert!(distance_m(before, tip_m(&host)) > 0.05);
    // An error stays until the host clears it; enabling does not clear it.
    host.exchange(SpecialCommand::Enable.emit(1));
    assert_eq!(
        host.emulated().motors()[0].status(),
        Status::CommunicationLost
    );
    host.exchange(SpecialCommand::ClearError.emit(1));
    assert_eq!(host.emulated().motors()[0].status(), Status::Disabled);
}

/// Positions have steps of 381 urad, rounded down; the motor applies the torque of the received code.
#[test]
fn positions_and_torques_have_the_steps_of_the_frames() {
    let mut host = host::<7>("openarm", |_| {}, None);
    host.start().unwrap();
    host.hold(50, MS);
    let truth_rad = host.emulated().truth().position_rad;
    for i in 0..7 {
        let error_rad = host.joints_rad()[i] - truth_rad[i];
        assert!(
            (-4.5e-4..=6e-5).contains(&error_rad),
            "joint {i}: {error_rad}"
        );
        let step_nm = host.ranges[i].torque().step();
        let code = host.emulated().motor_torque_nm()[i] / step_nm;
        assert!((code.fract().abs() - 0.5).abs() < 1e-6, "joint {i}: {code}");
    }
}

/// Returns the distance that the tip of an arm with disabled motors moves in 0.4 s from a pose \[m\].
fn fall_m<const N: usize>(name: &str, start_rad: Option<Vector<N>>) -> f64 {
    let mut host = host::<N>(name, |config| config.supported = false, start_rad);
    let before = tip_m(&host);
    host.receive(400 * MS);
    distance_m(before, tip_m(&host))
}

/// Without a support a disabled arm falls; in its stow pose it stays.
#[test]
fn a_disabled_arm_falls_unless_it_is_stowed() {
    assert!(fall_m::<7>("openarm", None) > 0.05);
    assert!(fall_m::<6>("yam", None) > 0.05);
    let stays_m = fall_m::<7>("openarm", Some(Vector::zeros()));
    assert!(stays_m < 2e-3, "openarm moves {stays_m} m in its stow pose");
    let stow_rad = Vector::from([0.0, 0.0, 0.0, -1.69297, 0.0, 0.0]);
    let stays_m = fall_m::<6>("yam", Some(stow_rad));
    assert!(stays_m < 2e-3, "yam moves {stays_m} m in its stow pose");
}

/// The applied torque is the commanded torque times the torque scale of the motor.
#[test]
fn the_plant_applies_the_torque_scale_of_the_motor() {
    let options = PlantOptions {
        torque_constant_fraction: Some(0.3),
        ..PlantOptions::default()
    };
    let mut host = host_with_options::<7>("openarm", |_| {}, None, &options);
    host.start().unwrap();
    host.hold(20, MS);
    let scale = host.emulated().plant().config().actuators.torque_constant;
    let believed_nm = host.emulated().motor_torque_nm();
    let true_nm = host.emulated().truth().motor_torque_nm;
    let gravity_nm = dynamics::gravity(&host.arm, &host.joints_rad());
    for i in 0..7 {
        assert!((scale[i] - 1.0).abs() > 0.29);
        if gravity_nm[i].abs() > 1.0 {
            assert!(
                (true_nm[i] / believed_nm[i] - scale[i]).abs() < 0.02,
                "joint {i}"
            );
        }
    }
}
