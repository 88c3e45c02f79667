//! Tests of the safe action after one loss, and after several simultaneous losses.

use supple_drive::{Drives, GuardInput, LossReason, MotorFault, SafeActionMachine, Stage, Torque};

const MS: u64 = 1_000_000;

fn without_loss(ms: u64) -> GuardInput {
    GuardInput {
        now_ns: ms * MS,
        answer: Some(true),
        drive_guard_loss: None,
        hold_loss: None,
        missing: 0,
        unsent: false,
        bus_off: false,
        drives: Drives::Active,
        drive_loss: None,
        shutting_down: false,
        supported: false,
    }
}

fn active() -> SafeActionMachine {
    let mut guard = SafeActionMachine::new();
    for ms in 0..10 {
        guard.cycle(&without_loss(ms), false);
    }
    assert_eq!(guard.stage(), Stage::Active);
    guard
}

#[test]
fn overspeed_ends_the_fallback_torque_during_any_other_loss() {
    type Change = fn(&mut GuardInput);
    let losses: [(&str, Change); 4] = [
        ("no answer", |input| input.answer = None),
        ("shutting_down", |input| input.shutting_down = true),
        ("unsent", |input| input.unsent = true),
        ("bus off", |input| input.bus_off = true),
    ];
    for (name, lose) in losses {
        for loss in [LossReason::Overspeed(1), LossReason::NotStopped(0)] {
            let mut guard = active();
            let mut action = guard.cycle(&without_loss(10), false);
            for ms in 11..40 {
                let mut input = without_loss(ms);
                lose(&mut input);
                action = guard.cycle(&input, false);
            }
            assert_eq!(action.torque, Torque::Fallback, "{name}");
            let mut input = without_loss(40);
            lose(&mut input);
            input.drive_guard_loss = Some(loss);
            assert_eq!(guard.cycle(&input, false).torque, Torque::None, "{name}");
            // The torque remains zero until the motors brake.
            let mut input = without_loss(41);
            lose(&mut input);
            assert_eq!(guard.cycle(&input, false).torque, Torque::None, "{name}");
        }
    }
}

#[test]
fn drives_activated_outside_gravity_hold_are_set_to_idle_with_the_fallback_torque() {
    let mut guard = SafeActionMachine::new();
    let mut input = without_loss(0);
    input.drive_guard_loss = Some(LossReason::ActivatedOutsideGravityHold);
    let action = guard.cycle(&input, false);
    assert_eq!(action.torque, Torque::Fallback);
    assert!(action.lower);
}

/// For every loss, checks the safe action of an arm that brakes and of an arm that falls, from the next cycle to the end.
#[test]
fn an_arm_that_falls_is_held_and_laid_down_before_its_motors_are_disabled() {
    type Change = fn(&mut GuardInput);
    let losses: [(LossReason, Change); 8] = [
        (LossReason::NoAnswer, |input| input.answer = None),
        (LossReason::TorqueNotWanted, |input| {
            input.answer = Some(false);
        }),
        (LossReason::Overspeed(2), |input| {
            input.drive_guard_loss = Some(LossReason::Overspeed(2));
        }),
        (LossReason::EncoderLost(0), |input| input.missing = 1),
        (LossReason::Motor(3, MotorFault::HotWinding), |input| {
            input.drive_loss = Some(LossReason::Motor(3, MotorFault::HotWinding));
        }),
        (LossReason::NotTransmitted, |input| input.unsent = true),
        (LossReason::BusOff, |input| input.bus_off = true),
        (LossReason::ShuttingDown, |input| input.shutting_down = true),
    ];
    for (reason, lose) in losses {
        let mut guard = SafeActionMachine::falling(100 * MS);
        guard.cycle(&without_loss(0), false);
        assert_eq!(guard.stage(), Stage::Active);
        let mut stages = Vec::new();
        for ms in 1..500 {
            let mut input = without_loss(ms);
            lose(&mut input);
            // The arm lies after 200 ms; a disabled motor is idle.
            if matches!(guard.stage(), Stage::Lowering(..)) {
                input.drives = Drives::Idle;
            }
            let action = guard.cycle(&input, ms >= 300);
            let (found, torque) = match guard.stage() {
                Stage::Active => ("active", None),
                Stage::Holding(of, _) if of == reason => ("holding", Some(Torque::Hold)),
                Stage::Stowing(of, _) if of == reason => ("stowing", Some(Torque::Stow)),
                Stage::Lowering(of, _) if of == reason => ("lowering", Some(Torque::None)),
                Stage::Resting => break,
                other => panic!("{reason}: {other:?}"),
            };
            assert!(
                torque.is_none_or(|torque| torque == action.torque),
                "{reason}"
            );
            assert_eq!(action.lower, found == "lowering", "{reason}");
            if stages.last() != Some(&found) {
                stages.push(found);
            }
        }
        let stages = stages
            .iter()
            .filter(|stage| **stage != "active")
            .copied()
            .collect::<Vec<_>>();
        assert_eq!(stages, ["holding", "stowing", "lowering"], "{reason}");
        assert_eq!(guard.last_loss().map(|(loss, _)| loss), Some(reason));
    }
}

/// If the holding torque accelerates the arm, the motors damp without torque until the arm stands still, then are disabled.
/// If one motor has no torque, the others continue to hold.
#[test]
fn overspeed_while_the_arm_is_held_leads_to_damping() {
    let driven = Some(LossReason::OverspeedInHold(1));
    for stowing in [false, true] {
        for motor_without_torque in [false, true] {
            let mut guard = SafeActionMachine::falling(100 * MS);
            guard.cycle(&without_loss(0), false);
            let begun = if stowing { 150 } else { 50 };
            let mut input = without_loss(1);
            for ms in 1..=begun {
                input = GuardInput {
                    now_ns: ms * MS,
                    answer: Some(false),
                    drive_loss: motor_without_torque
                        .then_some(LossReason::Motor(3, MotorFault::Overload)),
                    ..without_loss(ms)
                };
                guard.cycle(&input, false);
            }
            assert!(guard.holds());
            let before = guard.stage();
            input.now_ns += MS;
            input.hold_loss = driven;
            let action = guard.cycle(&input, false);
            if motor_without_torque {
                assert_eq!(guard.stage(), before);
                continue;
            }
            assert_eq!((action.torque, action.lower), (Torque::Damp, false));
            // The overspeed has ended; the holding torque does not return.
            input.now_ns += MS;
            input.hold_loss = None;
            assert_eq!(guard.cycle(&input, false).torque, Torque::Damp);
            assert!(guard.cycle(&input, true).lower);
            assert!(matches!(
                guard.stage(),
                Stage::Lowering(LossReason::OverspeedInHold(1), _)
            ));
        }
    }
}

/// An arm that falls without torque and does not come to rest while it is damped is disabled in the end.
#[test]
fn damping_ends_after_ten_seconds() {
    let mut guard = SafeActionMachine::falling(100 * MS);
    guard.cycle(&without_loss(0), false);
    let mut ended_ms = None;
    for ms in 1..20_000 {
        let input = GuardInput {
            answer: Some(false),
            hold_loss: Some(LossReason::OverspeedInHold(0)),
            ..without_loss(ms)
        };
        if guard.cycle(&input, false).lower && ended_ms.is_none() {
            ended_ms = Some(ms);
        }
    }
    assert_eq!(ended_ms, Some(10_002));
}
