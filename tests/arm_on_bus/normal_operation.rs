//! Tests of normal operation: activation, trajectory tracking, and bus load.

use crate::rig::{MS, PERIOD_NS, Rig};
use supple_bus::virtual_time::EmulatedNodes;
use supple_can::BusTime;
use supple_core::Vector;
use supple_core::controller::{Mode, Request};
use supple_drive::{Drives, Stage};
use supple_emu::{ButtonPress, Cause};
use supple_experiment::{scenario, start_pose};
use supple_puck::safety::SafetyMode;
use supple_puck::status::MotorMode;

#[test]
fn torque_mode_is_entered_only_from_the_pendant() {
    let mut rig = Rig::<4>::new();
    rig.request(Request::GravityHold);
    rig.run(500);
    assert!(rig.motors_in(MotorMode::Idle));
    assert_eq!(rig.cycle.drives(), Drives::Idle);
    rig.emulator_mut().press(ButtonPress::Activate);
    rig.run(50);
    assert!(rig.motors_in(MotorMode::Torque));
    assert_eq!(rig.cycle.drives(), Drives::Active);
}

/// The weight is compensated from the activation on: no joint moves.
#[test]
fn activation_is_bumpless() {
    let mut rig = Rig::<4>::new();
    rig.request(Request::GravityHold);
    rig.run(100);
    let before = rig.emulator().truth().position_rad;
    rig.emulator_mut().press(ButtonPress::Activate);
    rig.run(500);
    let moved = rig.emulator().truth().position_rad - before;
    assert!(moved.amax() < 2e-3, "{moved}");
}

/// If the controller is idle, activating the arm leaves it idle.
#[test]
fn an_idle_controller_sets_activated_motors_to_idle() {
    let mut rig = Rig::<4>::new();
    rig.run(20);
    rig.emulator_mut().press(ButtonPress::Activate);
    rig.run(30);
    assert_eq!(rig.emulator().safety().mode(), SafetyMode::Idle);
    assert_eq!(rig.emulator().safety().cause(), Cause::Host);
    assert!(rig.motors_in(MotorMode::Idle));
}

#[test]
fn reported_positions_and_force_match_the_arm() {
    let mut rig = Rig::<4>::holding();
    rig.run(200);
    let report = rig.cycle.link_mut().report.unwrap();
    let truth = rig.emulator().truth().position_rad;
    for (measured, truth) in report.position_rad.iter().zip(truth.iter()) {
        // The tolerance is half a count of each motor of the joint, plus the motion within a cycle.
        assert!((measured.unwrap() - truth).abs() < 2e-4);
    }
    let force_n = report.tip_force_n.unwrap();
    assert!(force_n.norm() < 0.1, "no contact at the tip: {force_n}");
}

/// Request, four replies and torques take 450 us without bit stuffing and 540 us with the maximum; the auxiliary polls
/// add a few per cent of the period.
#[test]
fn bus_load_is_the_sum_of_the_frames() {
    let mut rig = Rig::<4>::holding();
    let (begin_ns, busy_ns) = (rig.now_ns(), rig.emulator().bus_busy_ns());
    let mut reported = 0.0;
    for _ in 0..400 {
        rig.step();
        reported += rig.cycle.counters().bus_load / 400.0;
    }
    let busy = (rig.emulator().bus_busy_ns() - busy_ns) as f64;
    let actual_load = busy / (rig.now_ns() - begin_ns) as f64;
    assert!(
        (reported - actual_load).abs() < 0.01,
        "{reported} {actual_load}"
    );
    assert!((0.45..0.64).contains(&actual_load), "{actual_load}");
    assert_eq!(rig.cycle.counters().tx_lost, 0);
    assert_eq!(rig.cycle.counters().missed, 0);
    assert_eq!(rig.cycle.counters().replies_lost, 0);
}

#[test]
fn a_period_beyond_the_bus_bandwidth_is_rejected_with_the_frame_times() {
    let answer_ns = 100_000;
    assert!(BusTime::new(4, 0, true, answer_ns).check(MS).is_ok());
    let seven = BusTime::new(7, 0, true, answer_ns);
    let error = seven.check(MS).unwrap_err().to_string();
    // Positions 65 + 7 x 85, torques 2 x 135, sensor 65 + 115 + 125, the answer, their sum and its inverse.
    for part in ["660 us", "270 us", "305 us", "100 us", "1335 us", "749 Hz"] {
        assert!(error.contains(part), "{part} in: {error}");
    }
    assert!(seven.check(1_335_000).is_ok());
    assert!(BusTime::new(4, 4, true, answer_ns).check(MS).is_err());
}

/// Checks the bus time of every cycle, whether it polls the module's mode, the pendant or the sensor.
fn assert_within_budget<const N: usize>(period_ns: u64) {
    let mut rig = Rig::<N>::at(crate::rig::description(N).home::<N>().unwrap(), period_ns);
    rig.activate();
    let budget = BusTime::new(N, 0, true, crate::rig::ANSWER_NS);
    assert!(budget.min_period_ns() <= period_ns);
    let mut max_ns = 0;
    for _ in 0..1000 {
        let busy_ns = rig.emulator().bus_busy_ns();
        rig.step();
        max_ns = max_ns.max(rig.emulator().bus_busy_ns() - busy_ns);
    }
    let allowed_ns = budget.min_period_ns() - budget.answer_ns;
    assert!(max_ns <= allowed_ns, "{max_ns} {allowed_ns}");
    // The cycles also polled the sensor.
    assert!(rig.cycle.link_mut().report.unwrap().tip_force_n.is_some());
    assert_eq!(rig.cycle.counters().tx_lost, 0);
}

#[test]
fn four_joints_keep_the_budget_at_1_khz() {
    assert_within_budget::<4>(PERIOD_NS);
}

#[test]
fn seven_joints_keep_the_budget_at_700_hz() {
    assert_within_budget::<7>(1_428_000);
}

/// Frame durations with maximum bit stuffing: 65 us for a request, 85 for a reply, 135 for torques, 65 + 115 + 125 for
/// the sensor.
#[test]
fn the_budget_is_printed_frame_by_frame() {
    let four = BusTime::new(4, 0, true, 100_000).budget(MS).to_string();
    for line in [
        "1 x  65 us =   65 us",
        "4 x  85 us =  340 us",
        "1 x 135 us =  135 us",
        " 305 us",
        " 945 us",
        "1058 Hz",
    ] {
        assert!(four.contains(line), "{line} in: {four}");
    }
    let seven = BusTime::new(7, 4, false, 100_000).budget(MS).to_string();
    for line in [
        "3 x  85 us =  255 us",
        "4 x 115 us =  460 us",
        "2 x 135 us =  270 us",
    ] {
        assert!(seven.contains(line), "{line} in: {seven}");
    }
}

/// Tracks the sinusoid over the bus; returns the root mean square of the tip's position error \[m\].
fn tracking_error_m<const N: usize>(period_ns: u64) -> f64 {
    let (trajectory, _) = scenario::sinusoid(1.0);
    let config = crate::rig::description(N).config::<N>().unwrap();
    let start = start_pose(&config, "sinusoid", &trajectory, 1.0).unwrap();
    let mut rig = Rig::<N>::at(start, period_ns);
    rig.activate();
    let cycles = |seconds: f64| (seconds * 1e9 / period_ns as f64) as usize;
    rig.request(Request::Move {
        target_rad: start,
        duration_s: 0.5,
    });
    rig.run(cycles(0.8));
    rig.request(Request::Track(trajectory));
    let (mut sum, count) = (0.0, cycles(4.0));
    for _ in 0..count {
        rig.step();
        let tip = rig.emulator().truth().tip_position_m;
        let output = rig.cycle.link_mut().output.unwrap();
        assert_eq!(output.mode, Mode::Track, "{:?}", output.fault);
        sum += (output.reference.unwrap().position - tip).norm_squared();
    }
    assert_eq!(rig.cycle.guard().stage(), Stage::Active);
    assert_eq!(rig.cycle.counters().tx_lost, 0);
    (sum / count as f64).sqrt()
}

/// Without a bus and with an exact model the tip tracks within millimetres. Here the bus delays the torques by half a
/// cycle, and the emulated arm delays them further.
#[test]
fn four_joints_track_at_1_khz() {
    let rms_m = tracking_error_m::<4>(PERIOD_NS);
    assert!(rms_m < 4e-3, "{rms_m}");
}

#[test]
fn seven_joints_track_at_700_hz() {
    let rms_m = tracking_error_m::<7>(1_428_000);
    assert!(rms_m < 8e-3, "{rms_m}");
}

#[test]
fn identical_runs_are_bit_identical() {
    let run = || {
        let mut rig = Rig::<4>::holding();
        rig.request(Request::Move {
            target_rad: Vector::from([0.2, -1.6, 0.0, 2.7]),
            duration_s: 0.6,
        });
        rig.run(700);
        (rig.history.clone(), rig.emulator().now_ns())
    };
    let (first, second) = (run(), run());
    assert_eq!(first, second);
}
