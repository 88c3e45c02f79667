//! Torque with several simultaneous losses: a loss that invalidates the fallback torque ends it.

use supple_can::guard::{GuardInput, LossReason, SafeActionMachine, Stage, Torque};
use supple_puck::safety::SafetyMode;

const MS: u64 = 1_000_000;

fn without_loss(ms: u64) -> GuardInput {
    GuardInput {
        now_ns: ms * MS,
        answer: Some(true),
        drive_guard_loss: None,
        missing: 0,
        unsent: false,
        bus_off: false,
        module: Some((SafetyMode::Active, ms * MS)),
        leaving: false,
    }
}

fn active() -> SafeActionMachine {
    let mut guard = SafeActionMachine::new();
    for ms in 0..10 {
        guard.cycle(&without_loss(ms));
    }
    assert_eq!(guard.stage(), Stage::Active);
    guard
}

#[test]
fn overspeed_ends_the_fallback_torque_during_any_other_loss() {
    type Change = fn(&mut GuardInput);
    let losses: [(&str, Change); 4] = [
        ("no answer", |input| input.answer = None),
        ("leaving", |input| input.leaving = true),
        ("unsent", |input| input.unsent = true),
        ("bus off", |input| input.bus_off = true),
    ];
    for (name, lose) in losses {
        for loss in [LossReason::Overspeed(1), LossReason::NotStopped(0)] {
            let mut guard = active();
            let mut action = guard.cycle(&without_loss(10));
            for ms in 11..40 {
                let mut input = without_loss(ms);
                lose(&mut input);
                action = guard.cycle(&input);
            }
            assert_eq!(action.torque, Torque::Fallback, "{name}");
            let mut input = without_loss(40);
            lose(&mut input);
            input.drive_guard_loss = Some(loss);
            assert_eq!(guard.cycle(&input).torque, Torque::None, "{name}");
            // The torque remains zero until the motors brake.
            let mut input = without_loss(41);
            lose(&mut input);
            assert_eq!(guard.cycle(&input).torque, Torque::None, "{name}");
        }
    }
}

#[test]
fn activation_outside_gravity_hold_is_set_to_idle_with_the_fallback_torque() {
    let mut guard = SafeActionMachine::new();
    let mut input = without_loss(0);
    input.drive_guard_loss = Some(LossReason::Activated);
    let action = guard.cycle(&input);
    assert_eq!(action.torque, Torque::Fallback);
    assert!(action.lower_module);
}
