//! Every injected fault to its end at the emulated motors: what acts there, how soon, and that nothing
//! makes the arm stiffer.

use crate::rig::{MS, Rig, TestBus};
use supple_bus::virtual_time::Peer;
use supple_bus::{FaultKind, FaultRule, Traffic};
use supple_can::guard::{Stage, Torque};
use supple_can::{Drives, Loss};
use supple_core::Vector;
use supple_core::controller::{Fault, Mode, Request};
use supple_core::dynamics::gravity;
use supple_emu::{Cause, Happening, Press};
use supple_puck::MessageId;
use supple_puck::safety::SafetyMode;
use supple_puck::status::MotorMode;

/// The bound on every safe action.
const SAFE_NS: u64 = 20 * MS;
/// Least torque of a motor puck \[N m\].
const QUANTUM_NM: f64 = 1.0 / 2700.0;

fn torques(id: MessageId) -> bool {
    id.raw() == 0x401
}

fn of_puck_2(id: MessageId) -> bool {
    id.raw() == 0x443
}

fn to_module(id: MessageId) -> bool {
    id.raw() == 0x00a
}

fn injector(rig: &mut Rig<4>) -> &mut TestBus<4> {
    rig.cycle.bus_mut()
}

/// When the motors came to idle, since `begin_ns` \[ns\].
fn idle_after_ns(rig: &Rig<4>, begin_ns: u64) -> Option<u64> {
    let happenings = rig.emulator().happenings().iter();
    let mut idle = happenings.filter(|(_, h)| matches!(h, Happening::Motor(_, MotorMode::Idle)));
    let first = idle.find(|(time_ns, _)| *time_ns >= begin_ns);
    first.map(|(time_ns, _)| time_ns - begin_ns)
}

fn assert_idle_in_time(rig: &Rig<4>, begin_ns: u64) {
    assert!(rig.motors_in(MotorMode::Idle));
    let after_ns = idle_after_ns(rig, begin_ns);
    assert!(after_ns.is_some_and(|ns| ns <= SAFE_NS), "{after_ns:?}");
}

/// Motor torques that hold the arm's weight where it is.
fn weight_nm(rig: &Rig<4>) -> Vector<4> {
    let arm = crate::rig::arm(4).config::<4>().unwrap();
    let q = rig.emulator().truth().position_rad;
    arm.joint_from_motor.transpose() * gravity(&arm.arm, &q)
}

/// As of a controller that does not answer: never zero torque from one cycle to the next.
#[test]
fn torques_that_are_no_numbers_leave_the_weight_held_and_then_the_motors_brake() {
    let mut rig = Rig::<4>::holding();
    rig.run(500);
    rig.cycle.link_mut().not_finite = true;
    let begin_ns = rig.now_ns();
    assert_eq!(rig.step().torque, Torque::Fallback);
    let held = rig.history.last().unwrap().1;
    assert!((held - weight_nm(&rig)).amax() < 2.0 * QUANTUM_NM);
    rig.run(30);
    assert_idle_in_time(&rig, begin_ns);
    assert_eq!(
        rig.cycle.guard().last_loss().map(|(loss, _)| loss),
        Some(Loss::Answer)
    );
    assert!(rig.cycle.counters().unusable >= 10);
}

#[test]
fn a_dead_controller_leaves_the_weight_held_and_then_brakes() {
    let mut rig = Rig::<4>::holding();
    rig.run(500);
    rig.cycle.link_mut().dead = true;
    let begin_ns = rig.now_ns();
    // From the very first cycle without an answer.
    assert_eq!(rig.step().torque, Torque::Fallback);
    let held = rig.history.last().unwrap().1;
    assert!((held - weight_nm(&rig)).amax() < 2.0 * QUANTUM_NM);
    // It does not answer to motion: it is no spring.
    while rig.motors_in(MotorMode::Torque) {
        assert_eq!(rig.history.last().unwrap().1, held);
        rig.step();
    }
    assert_idle_in_time(&rig, begin_ns);
    assert_eq!(rig.emulator().safety().cause(), Cause::Host);
    assert_eq!(rig.cycle.guard().last_loss().unwrap().0, Loss::Answer);
    // Braking alone from here on.
    rig.run(300);
    assert!(rig.emulator().pucks().iter().all(|p| p.torque_nm() == 0.0));
}

#[test]
fn a_short_pause_of_the_controller_costs_nothing_but_its_cycles() {
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
fn service_is_taken_up_again_from_the_pendant() {
    let mut rig = Rig::<4>::holding();
    rig.cycle.link_mut().dead = true;
    rig.run(50);
    assert!(rig.motors_in(MotorMode::Idle));
    rig.cycle.link_mut().dead = false;
    rig.run(5);
    // Nothing raises the module but the operator.
    rig.ask(Request::Reset);
    rig.run(300);
    assert!(rig.motors_in(MotorMode::Idle));
    rig.emulator_mut().press(Press::Activate);
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
    let rule = FaultRule::always(Traffic::Received, FaultKind::Loss).only(of_puck_2);
    injector(&mut rig).add(rule.within(now_ns, now_ns + MS));
    rig.run(100);
    assert_eq!(rig.cycle.counters().replies_lost, 1);
    assert_eq!(rig.cycle.guard().stage(), Stage::Active);
    assert_eq!(rig.cycle.link_mut().output.unwrap().fault, None);
}

#[test]
fn a_lost_encoder_ends_torque_at_once() {
    let mut rig = Rig::<4>::holding();
    let now_ns = rig.now_ns();
    let rule = FaultRule::always(Traffic::Received, FaultKind::Loss).only(of_puck_2);
    injector(&mut rig).add(rule.within(now_ns, u64::MAX));
    rig.step();
    let action = rig.step();
    assert_eq!(action.torque, Torque::None);
    assert!(action.lower_module);
    rig.run(30);
    assert_idle_in_time(&rig, now_ns);
    assert_eq!(rig.cycle.guard().last_loss().unwrap().0, Loss::Encoder(1));
    // Joints 2 and 3 share the motor; the others are still known.
    let known = rig.cycle.link_mut().report.unwrap().position_rad;
    assert_eq!(known.map(|p| p.is_some()), [true, false, false, true]);
}

#[test]
fn one_lost_torque_frame_is_noticed_in_its_cycle_and_made_good_in_the_next() {
    let mut rig = Rig::<4>::holding();
    let now_ns = rig.now_ns();
    let rule = FaultRule::always(Traffic::Sent, FaultKind::SilentLoss).only(torques);
    injector(&mut rig).add(rule.within(now_ns, now_ns + MS));
    rig.step();
    assert_eq!(rig.cycle.counters().tx_lost, 1);
    rig.run(100);
    assert_eq!(rig.cycle.counters().tx_lost, 1);
    assert_eq!(rig.cycle.guard().stage(), Stage::Active);
}

#[test]
fn torques_that_never_leave_lower_the_module() {
    let mut rig = Rig::<4>::holding();
    let now_ns = rig.now_ns();
    let rule = FaultRule::always(Traffic::Sent, FaultKind::SilentLoss).only(torques);
    injector(&mut rig).add(rule.within(now_ns, u64::MAX));
    rig.step();
    assert_eq!(rig.cycle.counters().tx_lost, 1);
    rig.run(30);
    assert_idle_in_time(&rig, now_ns);
    assert_eq!(rig.cycle.guard().last_loss().unwrap().0, Loss::Transmit);
}

/// Then the host can say nothing any more: the safety module notices by itself that positions stop, as
/// late as its own time-out, 100 ms here.
#[test]
fn a_host_that_cannot_speak_is_noticed_by_the_safety_module() {
    let mut rig = Rig::<4>::holding();
    let now_ns = rig.now_ns();
    let rule = FaultRule::always(Traffic::Sent, FaultKind::SilentLoss);
    injector(&mut rig).add(rule.within(now_ns, u64::MAX));
    rig.step();
    assert!(rig.cycle.counters().tx_lost >= 2);
    let before = rig.history.last().unwrap().1;
    rig.run(90);
    // Meanwhile the motors keep the last torque: no stiffer.
    assert_eq!(rig.history.last().unwrap().1, before);
    rig.run(30);
    assert!(rig.motors_in(MotorMode::Idle));
    assert_eq!(rig.emulator().safety().cause(), Cause::Heartbeat);
}

#[test]
fn back_on_the_bus_the_host_lowers_the_module() {
    let mut rig = Rig::<4>::holding();
    let now_ns = rig.now_ns();
    let off = FaultRule::always(Traffic::Sent, FaultKind::BusOff);
    injector(&mut rig).add(off.within(now_ns + 300_000, now_ns + 30 * MS));
    rig.run(30);
    assert!(rig.motors_in(MotorMode::Torque));
    rig.run(30);
    assert_idle_in_time(&rig, now_ns + 30 * MS);
    assert_eq!(rig.cycle.guard().last_loss().unwrap().0, Loss::BusOff);
}

/// A single bit of a single reply, in many places: either it passes for a small error of an encoder, or
/// the controller does not believe it and the arm goes to idle. Torque never grows by more than its rate
/// limit allows, but for what the stop of a motion that is none may ask for: a fifth of the joint's limit a cycle.
#[test]
fn a_corrupted_reply_is_believed_or_ends_torque() {
    let (mut believed, mut ended) = (0, 0);
    for seed in 0..24 {
        let mut rig = Rig::<4>::seeded(seed);
        rig.activate();
        let now_ns = rig.now_ns();
        let bits: [fn(MessageId) -> bool; 4] = [
            |id| id.raw() == 0x423,
            of_puck_2,
            |id| id.raw() == 0x463,
            |id| id.raw() == 0x483,
        ];
        let rule = FaultRule::always(Traffic::Received, FaultKind::Corrupt);
        let rule = rule.only(bits[seed as usize % 4]);
        injector(&mut rig).add(rule.within(now_ns, now_ns + MS));
        let from = rig.history.len() - 1;
        rig.run(40);
        let limit_nm = 1.0;
        let config = crate::rig::arm(4).config::<4>().unwrap();
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
                    growth.max() < limit_nm + 0.1
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
            Stage::Active => believed += 1,
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
    assert!(believed > 0 && ended > 0, "{believed} {ended}");
}

#[test]
fn doubled_and_reordered_frames_change_nothing() {
    for kind in [FaultKind::Duplicate, FaultKind::Reorder(20_000)] {
        let mut rig = Rig::<4>::holding();
        injector(&mut rig).add(FaultRule::always(Traffic::Received, kind));
        rig.run(300);
        assert_eq!(rig.cycle.guard().stage(), Stage::Active, "{kind:?}");
        assert_eq!(rig.cycle.counters().replies_lost, 0, "{kind:?}");
    }
}

/// Replies so late that they fall into the next cycle are lost ones.
#[test]
fn late_replies_are_lost_replies() {
    let mut rig = Rig::<4>::holding();
    let now_ns = rig.now_ns();
    let rule = FaultRule::always(Traffic::Received, FaultKind::Delay(900_000)).only(of_puck_2);
    injector(&mut rig).add(rule.within(now_ns, now_ns + MS));
    rig.run(50);
    assert_eq!(rig.cycle.counters().replies_lost, 1);
    assert_eq!(rig.cycle.guard().stage(), Stage::Active);
}

#[test]
fn the_emergency_stop_is_told_to_the_controller() {
    let mut rig = Rig::<4>::holding();
    rig.emulator_mut().press(Press::EStop);
    rig.run(20);
    assert_eq!(rig.cycle.drives(), Drives::Off);
    let report = rig.cycle.link_mut().report.unwrap();
    assert_eq!(report.drives, Drives::Off);
    assert_eq!(report.position_rad, [None; 4]);
}

#[test]
fn a_mode_that_the_module_changes_is_known_within_the_bound() {
    let mut rig = Rig::<4>::holding();
    let begin_ns = rig.now_ns();
    rig.emulator_mut().press(Press::Idle);
    while rig.cycle.link_mut().report.unwrap().drives == Drives::Active {
        rig.step();
    }
    assert!(rig.now_ns() - begin_ns <= SAFE_NS);
    assert_eq!(rig.cycle.guard().stage(), Stage::Resting);
}

#[test]
fn a_dead_host_is_noticed_by_the_safety_module() {
    let mut rig = Rig::<4>::holding();
    let dead_ns = rig.now_ns();
    while rig.now_ns() < dead_ns + 150 * MS {
        rig.emulator_mut().run_until(dead_ns + 150 * MS);
    }
    let after_ns = idle_after_ns(&rig, dead_ns).unwrap();
    assert!((99 * MS..102 * MS).contains(&after_ns), "{after_ns}");
    assert_eq!(rig.emulator().safety().cause(), Cause::Heartbeat);
    // It comes back: periods are passed over, and the arm stays in idle.
    let number = rig.cycle.cycle_number();
    rig.run(50);
    assert!(rig.cycle.cycle_number() - number >= 199);
    assert!(rig.cycle.counters().skipped >= 149);
    assert_eq!(rig.cycle.guard().stage(), Stage::Resting);
    assert!(rig.motors_in(MotorMode::Idle));
}

#[test]
fn a_program_that_ends_lowers_the_module_first() {
    let mut rig = Rig::<4>::holding();
    let begin_ns = rig.now_ns();
    rig.cycle.leave();
    let action = rig.step();
    assert_eq!(action.torque, Torque::Fallback);
    rig.run(20);
    assert_idle_in_time(&rig, begin_ns);
}

/// A safety module that does not hear: the fallback ends after 100 ms and the motors are told directly.
#[test]
fn without_the_module_the_motors_are_set_to_idle_themselves() {
    let mut rig = Rig::<4>::holding();
    let begin_ns = rig.now_ns();
    let rule = FaultRule::always(Traffic::Sent, FaultKind::Loss).only(to_module);
    injector(&mut rig).add(rule.within(begin_ns, u64::MAX));
    rig.cycle.link_mut().dead = true;
    rig.run(105);
    assert!(rig.motors_in(MotorMode::Torque));
    rig.run(15);
    assert!(rig.motors_in(MotorMode::Idle));
    let after_ns = idle_after_ns(&rig, begin_ns).unwrap();
    assert!((100 * MS..120 * MS).contains(&after_ns), "{after_ns}");
    assert_eq!(rig.emulator().safety().mode(), SafetyMode::Active);
}

/// A module that falls silent while the arm is active.
#[test]
fn a_silent_module_ends_service() {
    let mut rig = Rig::<4>::holding();
    let begin_ns = rig.now_ns();
    let silent = |id: MessageId| id.raw() == 0x546;
    let rule = FaultRule::always(Traffic::Received, FaultKind::Loss).only(silent);
    injector(&mut rig).add(rule.within(begin_ns, u64::MAX));
    rig.run(150);
    assert_eq!(rig.cycle.guard().last_loss().unwrap().0, Loss::Module);
    assert_eq!(rig.emulator().safety().mode(), SafetyMode::Idle);
}
