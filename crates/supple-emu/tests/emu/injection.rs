//! Tests of injected faults, as the host observes them on the bus.

use crate::support::{ACTIVE, Host, MODE, P};
use supple_plant::Injection;

const PERIOD_S: f64 = 1e-3;

fn injected(specs: &[&str]) -> Host {
    let mut host = Host::awake();
    let read: Result<Vec<Injection>, _> = specs.iter().map(|spec| spec.parse()).collect();
    let arm = host.arm_mut();
    arm.inject(&read.expect("valid"), PERIOD_S).expect("taken");
    host.press(supple_emu::ButtonPress::Activate);
    host
}

/// Returns the positions that the pucks report to separate requests.
fn counts(host: &mut Host) -> Vec<Option<i32>> {
    (1..=4)
        .map(|node| {
            let reply = host.get(node, P)?;
            Some(i32::from_be_bytes([0, reply[0], reply[1], reply[2]]) << 10 >> 10)
        })
        .collect()
}

fn active(host: &mut Host) {
    host.cycles(5);
    assert_eq!(host.module_mode(), ACTIVE);
    assert_eq!(host.value(1, MODE), 2);
}

#[test]
fn a_stuck_encoder_reports_a_constant_angle_while_the_arm_falls() {
    let mut host = injected(&["encoder-stuck:joint=3,at-s=0.05"]);
    active(&mut host);
    host.cycles(100);
    let before = counts(&mut host);
    let then_rad = host.arm().truth().position_rad;
    host.cycles(80);
    let after = counts(&mut host);
    let moved_rad = host.arm().truth().position_rad - then_rad;
    assert!(moved_rad[3].abs() > 0.01, "{moved_rad}");
    assert_eq!(before[3], after[3], "joint 3 has a separate motor");
    assert_ne!(before[1], after[1]);
    assert_eq!(host.arm().injections_begun(), 1);
}

#[test]
fn every_second_reply_of_a_puck_is_not_sent() {
    let mut host = injected(&["reply-lost:every=2,joint=1,at-s=0"]);
    active(&mut host);
    let there: Vec<Vec<bool>> = (0..6)
        .map(|_| counts(&mut host).iter().map(Option::is_some).collect())
        .collect();
    let of_puck = |index: usize| -> Vec<bool> { there.iter().map(|set| set[index]).collect() };
    assert_eq!(of_puck(0), [true; 6]);
    let second = of_puck(1);
    let alternating = second.windows(2).all(|pair| pair[0] != pair[1]);
    assert!(alternating, "{second:?}");
}

#[test]
fn faults_without_bus_support_are_rejected_with_a_remedy() {
    for (spec, remedy) in [
        ("encoder-stuck:when=track", "at-s=SECONDS"),
        ("encoder-nan:joint=1", "reply-lost:every=1"),
        ("drives-idle:at-s=1", "pendant"),
        ("motor-dead:motor=4", "count from 0 to 3"),
    ] {
        let injection: Injection = spec.parse().expect("valid");
        let refused = Host::awake().arm_mut().inject(&[injection], PERIOD_S);
        let words = refused.expect_err(spec).to_string();
        assert!(words.contains(remedy), "{spec}: {words}");
    }
}
