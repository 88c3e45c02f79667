//! Tests of the effect of every injected fault on the emulated motors: which torque acts, and after what time. The arm never
//! becomes stiffer.

use crate::rig::{MS, Rig, TestBus};
use supple_bus::virtual_time::EmulatedNodes;
use supple_bus::{FaultKind, FaultRule, TrafficDirection};
use supple_can_frame::CanId;
use supple_core::Vector;
use supple_core::controller::{Fault, Mode, Request};
use supple_core::dynamics::gravity;
use supple_drive::{Drives, LossReason, Stage, Torque};
use supple_emu::{ArmEvent, ButtonPress, Cause};
use supple_puck::safety::SafetyMode;
use supple_puck::status::MotorMode;

/// Time limit of every safe action.
const MAX_SAFE_ACTION_NS: u64 = 20 * MS;
/// Torque resolution of a motor puck \[N m\].
const QUANTUM_NM: f64 = 1.0 / 2700.0;

fn is_torque_frame(id: CanId) -> bool {
    id.raw() == 0x401
}

fn is_reply_of_puck_2(id: CanId) -> bool {
    id.raw() == 0x443
}

fn is_request_to_module(id: CanId) -> bool {
    id.raw() == 0x00a
}

fn fault_injector(rig: &mut Rig<4>) -> &mut TestBus<4> {
    rig.cycle.drive_mut().bus_mut()
}

/// Returns the time from `begin_ns` until the motors became idle \[ns\].
fn idle_after_ns(rig: &Rig<4>, begin_ns: u64) -> Option<u64> {
    let arm_events = rig.emulator().arm_events().iter();
    let mut idle =
        arm_events.filter(|(_, event)| matches!(event, ArmEvent::Motor(_, MotorMode::Idle)));
    let first = idle.find(|(time_ns, _)| *time_ns >= begin_ns);
    first.map(|(time_ns, _)| time_ns - begin_ns)
}

fn assert_idle_in_time(rig: &Rig<4>, begin_ns: u64) {
    assert!(rig.motors_in(MotorMode::Idle));
    let after_ns = idle_after_ns(rig, begin_ns);
    assert!(
        after_ns.is_some_and(|ns| ns <= MAX_SAFE_ACTION_NS),
        "{after_ns:?}"
    );
}

/// Returns the motor torques that hold the arm's weight in its current pose.
fn weight_nm(rig: &Rig<4>) -> Vector<4> {
    let config = crate::rig::description(4).config::<4>().unwrap();
    let q = rig.emulator().truth().position_rad;
    config.joint_from_motor.transpose() * gravity(&config.arm, &q)
}

/// An answer that is not finite is treated like a missing one: the torque does not drop to zero in one cycle.
#[test]
fn nonfinite_torques_lead_to_the_fallback_torque_and_then_to_braking() {
    let mut rig = Rig::<4>::holding();
    rig.run(500);
    rig.cycle.link_mut().not_finite = true;
    let begin_ns = rig.now_ns();
    assert_eq!(rig.step().torque, Torque::Fallback);
    let held_nm = rig.history.last().unwrap().1;
    assert!((held_nm - weight_nm(&rig)).amax() < 2.0 * QUANTUM_NM);
    rig.run(30);
    assert_idle_in_time(&rig, begin_ns);
    assert_eq!(
        rig.cycle.guard().last_loss().map(|(loss, _)| loss),
        Some(LossReason::NoAnswer)
    );
    assert!(rig.cycle.counters().unusable >= 10);
}

#[test]
fn a_dead_controller_leads_to_the_fallback_torque_and_then_to_braking() {
    let mut rig = Rig::<4>::holding();
    rig.run(500);
    rig.cycle.link_mut().dead = true;
    let begin_ns = rig.now_ns();
    // The fallback torque acts from the first cycle without an answer on.
    assert_eq!(rig.step().torque, Torque::Fallback);
    let held_nm = rig.history.last().unwrap().1;
    assert!((held_nm - weight_nm(&rig)).amax() < 2.0 * QUANTUM_NM);
    // The fallback torque does not depend on the position: it is not a spring.
    while rig.motors_in(MotorMode::Torque) {
        assert_eq!(rig.history.last().unwrap().1, held_nm);
        rig.step();
    }
    assert_idle_in_time(&rig, begin_ns);
    assert_eq!(rig.emulator().safety().cause(), Cause::Host);
    assert_eq!(
        rig.cycle.guard().last_loss().unwrap().0,
        LossReason::NoAnswer
    );
    // After this, the motors only brake.
    rig.run(300);
    assert!(rig.emulator().pucks().iter().all(|p| p.torque_nm() == 0.0));
}

#[test]
fn a_short_pause_of_the_controller_only_costs_its_cycles() {
    let mut rig = Rig::<4>::holding();
    rig.cycle.link_mut().dead = true;
    for _ in 0..5 {
        assert_eq!(rig.step().torque, Torque::Fallback);
    }
    rig.cycle.link_mut().dead = false;
    assert_eq!(rig.step().torque, Torque::Command);
    rig.run(100);
    assert_eq!(rig.cycle.guard().stage(), Stage::Active);
    assert_eq!(rig.cycle.counters().missed, 5);
}

#[test]
fn the_arm_is_reenabled_only_from_the_pendant() {
    let mut rig = Rig::<4>::holding();
    rig.cycle.link_mut().dead = true;
    rig.run(50);
    assert!(rig.motors_in(MotorMode::Idle));
    rig.cycle.link_mut().dead = false;
    rig.run(5);
    // Only the operator can activate the safety module again.
    rig.request(Request::Reset);
    rig.run(300);
    assert!(rig.motors_in(MotorMode::Idle));
    rig.emulator_mut().press(ButtonPress::Activate);
    rig.run(50);
    assert_eq!(rig.cycle.guard().stage(), Stage::Active);
    assert!(rig.motors_in(MotorMode::Torque));
    let mode = rig.cycle.link_mut().output.unwrap().mode;
    assert_eq!(mode, Mode::GravityHold);
}

#[test]
fn one_lost_reply_is_tolerated() {
    let mut rig = Rig::<4>::holding();
    let now_ns = rig.now_ns();
    let rule =
        FaultRule::always(TrafficDirection::Received, FaultKind::Loss).only(is_reply_of_puck_2);
    fault_injector(&mut rig).add(rule.within(now_ns, now_ns + MS));
    rig.run(100);
    assert_eq!(rig.cycle.counters().replies_lost, 1);
    assert_eq!(rig.cycle.guard().stage(), Stage::Active);
    assert_eq!(rig.cycle.link_mut().output.unwrap().fault, None);
}

#[test]
fn a_lost_encoder_ends_torque_at_once() {
    let mut rig = Rig::<4>::holding();
    let now_ns = rig.now_ns();
    let rule =
        FaultRule::always(TrafficDirection::Received, FaultKind::Loss).only(is_reply_of_puck_2);
    fault_injector(&mut rig).add(rule.within(now_ns, u64::MAX));
    rig.step();
    let action = rig.step();
    assert_eq!(action.torque, Torque::None);
    assert!(action.lower);
    rig.run(30);
    assert_idle_in_time(&rig, now_ns);
    assert_eq!(
        rig.cycle.guard().last_loss().unwrap().0,
        LossReason::EncoderLost(1)
    );
    // Joints 2 and 3 depend on this motor; the other angles are still known.
    let known = rig.cycle.link_mut().report.unwrap().position_rad;
    assert_eq!(known.map(|p| p.is_some()), [true, false, false, true]);
}

#[test]
fn one_lost_torque_frame_is_detected_in_its_cycle_and_does_not_end_torque() {
    let mut rig = Rig::<4>::holding();
    let now_ns = rig.now_ns();
    let rule =
        FaultRule::always(TrafficDirection::Sent, FaultKind::SilentLoss).only(is_torque_frame);
    fault_injector(&mut rig).add(rule.within(now_ns, now_ns + MS));
    rig.step();
    assert_eq!(rig.cycle.counters().tx_lost, 1);
    rig.run(100);
    assert_eq!(rig.cycle.counters().tx_lost, 1);
    assert_eq!(rig.cycle.guard().stage(), Stage::Active);
}

#[test]
fn unsent_torque_frames_set_the_module_to_idle() {
    let mut rig = Rig::<4>::holding();
    let now_ns = rig.now_ns();
    let rule =
        FaultRule::always(TrafficDirection::Sent, FaultKind::SilentLoss).only(is_torque_frame);
    fault_injector(&mut rig).add(rule.within(now_ns, u64::MAX));
    rig.step();
    assert_eq!(rig.cycle.counters().tx_lost, 1);
    rig.run(30);
    assert_idle_in_time(&rig, now_ns);
    assert_eq!(
        rig.cycle.guard().last_loss().unwrap().0,
        LossReason::NotTransmitted
    );
}

/// The host cannot transmit any more; the safety module detects missing positions by its own 100 ms timeout.
#[test]
fn the_safety_module_detects_a_host_that_cannot_transmit() {
    let mut rig = Rig::<4>::holding();
    let now_ns = rig.now_ns();
    let rule = FaultRule::always(TrafficDirection::Sent, FaultKind::SilentLoss);
    fault_injector(&mut rig).add(rule.within(now_ns, u64::MAX));
    rig.step();
    assert!(rig.cycle.counters().tx_lost >= 2);
    let before = rig.history.last().unwrap().1;
    rig.run(90);
    // Until then, the motors keep the last torque, so that the arm does not become stiffer.
    assert_eq!(rig.history.last().unwrap().1, before);
    rig.run(30);
    assert!(rig.motors_in(MotorMode::Idle));
    assert_eq!(rig.emulator().safety().cause(), Cause::Heartbeat);
}

#[test]
fn after_bus_off_the_host_sets_the_module_to_idle() {
    let mut rig = Rig::<4>::holding();
    let now_ns = rig.now_ns();
    let off = FaultRule::always(TrafficDirection::Sent, FaultKind::BusOff);
    fault_injector(&mut rig).add(off.within(now_ns + 300_000, now_ns + 30 * MS));
    rig.run(30);
    assert!(rig.motors_in(MotorMode::Torque));
    rig.run(30);
    assert_idle_in_time(&rig, now_ns + 30 * MS);
    assert_eq!(rig.cycle.guard().last_loss().unwrap().0, LossReason::BusOff);
}

/// Inverts one bit of one reply. Either the error is small and accepted, or it causes a fault and the motors are set to
/// idle. In each cycle the torque grows at most by its rate limit. If the error looks like fast motion, which the
/// controller then stops, it grows at most by a fifth of the joint's torque limit.
#[test]
fn a_corrupted_reply_is_accepted_or_ends_torque() {
    let (mut accepted, mut ended) = (0, 0);
    for seed in 0..24 {
        let mut rig = Rig::<4>::seeded(seed);
        rig.activate();
        let now_ns = rig.now_ns();
        let is_reply_of_puck: [fn(CanId) -> bool; 4] = [
            |id| id.raw() == 0x423,
            is_reply_of_puck_2,
            |id| id.raw() == 0x463,
            |id| id.raw() == 0x483,
        ];
        let rule = FaultRule::always(TrafficDirection::Received, FaultKind::Corrupt);
        let rule = rule.only(is_reply_of_puck[seed as usize % 4]);
        fault_injector(&mut rig).add(rule.within(now_ns, now_ns + MS));
        let from = rig.history.len() - 1;
        rig.run(40);
        let rate_limit_nm = 1.0;
        let config = crate::rig::description(4).config::<4>().unwrap();
        let joint_from_motor = config.joint_from_motor;
        for pair in rig.history[from..].windows(2) {
            let to_joints = joint_from_motor.transpose().try_inverse().unwrap();
            let (before, after) = (to_joints * pair[0].1, to_joints * pair[1].1);
            let growth = after.abs() - before.abs();
            let stopping = rig
                .cycle
                .link_mut()
                .output
                .is_some_and(|o| o.fault.is_some());
            if rig.motors_in(MotorMode::Torque) {
                assert!(
                    growth.max() < rate_limit_nm + 0.1
                        || stopping && (growth - config.limits.joint_torque_nm * 0.2).max() <= 0.1,
                    "{growth} in seed {seed}, from {before} to {after}, {:?}, {:?}",
                    rig.cycle.guard().last_loss(),
                    rig.cycle
                        .link_mut()
                        .output
                        .map(|o| (o.fault, o.torque_nm, o.mode))
                );
            }
        }
        match rig.cycle.guard().stage() {
            Stage::Active => accepted += 1,
            _ => {
                assert_idle_in_time(&rig, now_ns);
                let fault = rig.cycle.link_mut().output.unwrap().fault;
                assert!(
                    matches!(
                        fault,
                        Some(
                            Fault::EncoderJump { .. }
                                | Fault::JointSpeed { .. }
                                | Fault::JointCollision { .. }
                        )
                    ),
                    "{fault:?}"
                );
                ended += 1;
            }
        }
    }
    assert!(accepted > 0 && ended > 0, "{accepted} {ended}");
}

#[test]
fn duplicated_and_reordered_frames_have_no_effect() {
    for kind in [FaultKind::Duplicate, FaultKind::Reorder(20_000)] {
        let mut rig = Rig::<4>::holding();
        fault_injector(&mut rig).add(FaultRule::always(TrafficDirection::Received, kind));
        rig.run(300);
        assert_eq!(rig.cycle.guard().stage(), Stage::Active, "{kind:?}");
        assert_eq!(rig.cycle.counters().replies_lost, 0, "{kind:?}");
    }
}

/// Replies that arrive in the next cycle count as lost.
#[test]
fn late_replies_count_as_lost() {
    let mut rig = Rig::<4>::holding();
    let now_ns = rig.now_ns();
    let rule = FaultRule::always(TrafficDirection::Received, FaultKind::Delay(900_000))
        .only(is_reply_of_puck_2);
    fault_injector(&mut rig).add(rule.within(now_ns, now_ns + MS));
    rig.run(50);
    assert_eq!(rig.cycle.counters().replies_lost, 1);
    assert_eq!(rig.cycle.guard().stage(), Stage::Active);
}

#[test]
fn the_emergency_stop_is_reported_to_the_controller() {
    let mut rig = Rig::<4>::holding();
    rig.emulator_mut().press(ButtonPress::EStop);
    rig.run(20);
    assert_eq!(rig.cycle.drives(), Drives::Off);
    let report = rig.cycle.link_mut().report.unwrap();
    assert_eq!(report.drives, Drives::Off);
    assert_eq!(report.position_rad, [None; 4]);
}

#[test]
fn a_mode_change_of_the_module_is_reported_within_the_time_limit() {
    let mut rig = Rig::<4>::holding();
    let begin_ns = rig.now_ns();
    rig.emulator_mut().press(ButtonPress::Idle);
    while rig.cycle.link_mut().report.unwrap().drives == Drives::Active {
        rig.step();
    }
    assert!(rig.now_ns() - begin_ns <= MAX_SAFE_ACTION_NS);
    assert_eq!(rig.cycle.guard().stage(), Stage::Resting);
}

#[test]
fn the_safety_module_detects_a_dead_host() {
    let mut rig = Rig::<4>::holding();
    let dead_ns = rig.now_ns();
    while rig.now_ns() < dead_ns + 150 * MS {
        rig.emulator_mut().run_until(dead_ns + 150 * MS);
    }
    let after_ns = idle_after_ns(&rig, dead_ns).unwrap();
    assert!((99 * MS..102 * MS).contains(&after_ns), "{after_ns}");
    assert_eq!(rig.emulator().safety().cause(), Cause::Heartbeat);
    // After the host resumes, missed periods are skipped and the arm stays idle.
    let number = rig.cycle.cycle_number();
    rig.run(50);
    assert!(rig.cycle.cycle_number() - number >= 199);
    assert!(rig.cycle.counters().skipped >= 149);
    assert_eq!(rig.cycle.guard().stage(), Stage::Resting);
    assert!(rig.motors_in(MotorMode::Idle));
}

#[test]
fn shutdown_sets_the_module_to_idle_first() {
    let mut rig = Rig::<4>::holding();
    let begin_ns = rig.now_ns();
    rig.cycle.begin_shutdown();
    let action = rig.step();
    assert_eq!(action.torque, Torque::Fallback);
    rig.run(20);
    assert_idle_in_time(&rig, begin_ns);
}

/// If the safety module does not react, the fallback torque ends after 100 ms and the motors are set to idle
/// directly.
#[test]
fn without_the_module_the_motors_are_set_to_idle_directly() {
    let mut rig = Rig::<4>::holding();
    let begin_ns = rig.now_ns();
    let rule =
        FaultRule::always(TrafficDirection::Sent, FaultKind::Loss).only(is_request_to_module);
    fault_injector(&mut rig).add(rule.within(begin_ns, u64::MAX));
    rig.cycle.link_mut().dead = true;
    rig.run(105);
    assert!(rig.motors_in(MotorMode::Torque));
    rig.run(15);
    assert!(rig.motors_in(MotorMode::Idle));
    let after_ns = idle_after_ns(&rig, begin_ns).unwrap();
    assert!((100 * MS..120 * MS).contains(&after_ns), "{after_ns}");
    assert_eq!(rig.emulator().safety().mode(), SafetyMode::Active);
}

/// The safety module stops replying while the arm is active.
#[test]
fn a_silent_module_ends_torque() {
    let mut rig = Rig::<4>::holding();
    let begin_ns = rig.now_ns();
    let is_reply_of_module = |id: CanId| id.raw() == 0x546;
    let rule =
        FaultRule::always(TrafficDirection::Received, FaultKind::Loss).only(is_reply_of_module);
    fault_injector(&mut rig).add(rule.within(begin_ns, u64::MAX));
    rig.run(150);
    assert_eq!(
        rig.cycle.guard().last_loss().unwrap().0,
        LossReason::SafetyModuleSilent
    );
    assert_eq!(rig.emulator().safety().mode(), SafetyMode::Idle);
}
