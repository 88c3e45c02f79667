//! Arrival of states: lost replies, repeated and missing states, states out of order.

use crate::support::configs::four;
use crate::support::rig::{Rig, bent};
use supple_core::controller::{Fault, Mode};
use supple_core::{Input, Output, Vector};

/// An arm rotating at constant speed in gravity hold.
fn rotating() -> (Rig<4>, Vector<4>) {
    rotating_with(four().plausible.lost_replies)
}

/// The same, with a budget of `lost_replies` per joint: a lost reply uses one, eight received replies restore one.
fn rotating_with(lost_replies: u32) -> (Rig<4>, Vector<4>) {
    let speed = Vector::<4>::new(0.3, 0.2, 0.0, -0.4);
    let mut config = four();
    config.plausible.lost_replies = lost_replies;
    let mut rig = Rig::holding(config, bent());
    for _ in 0..300 {
        rig.q += speed * 1e-3;
        let output = rig.cycle();
        assert_eq!(output.fault, None);
    }
    (rig, speed)
}

fn without(rig: &Rig<4>, joints: &[usize]) -> Input<4> {
    let mut input = rig.input();
    for joint in joints {
        input.position_rad[*joint] = None;
    }
    input
}

#[test]
fn a_single_lost_reply_is_extrapolated() {
    for lost in [&[0][..], &[3], &[0, 1, 2, 3]] {
        let (mut rig, speed) = rotating();
        rig.q += speed * 1e-3;
        let trusted = rig.cycle().fallback_torque_nm;
        rig.q += speed * 1e-3;
        let output = rig.step(&without(&rig, lost));
        assert_eq!((output.fault, output.mode), (None, Mode::GravityHold));
        let error = output.position_rad - rig.q;
        assert!(
            error.norm() < 1e-9,
            "the extrapolated angles differ by {error} rad"
        );
        assert!((output.velocity_rad_per_s - speed).norm() < 1e-6);
        // The fallback is gravity at the last completely measured pose.
        assert_eq!(output.fallback_torque_nm, trusted);
        rig.q += speed * 1e-3;
        let output = rig.cycle();
        assert_eq!((output.fault, output.position_rad), (None, rig.q));
        assert_ne!(output.fallback_torque_nm, trusted);
    }
}

#[test]
fn losing_every_other_reply_faults_and_one_in_ten_does_not() {
    let losing = |every: u64| {
        let (mut rig, speed) = rotating_with(3);
        for k in 0..400 {
            rig.q += speed * 1e-3;
            let lost: &[usize] = if k % every == 0 { &[1] } else { &[] };
            if let Some(fault) = rig.step(&without(&rig, lost)).fault {
                return Some((k, fault));
            }
        }
        None
    };
    assert_eq!(losing(10), None);
    let (cycle, fault) = losing(2).expect("a fault");
    assert_eq!(fault, Fault::EncoderUnreliable { joint: 1 });
    assert!(cycle < 20, "after {cycle} cycles");
    assert!(losing(5).is_some());
}

#[test]
fn two_lost_replies_in_a_row_are_a_fault() {
    for joint in 0..4 {
        let mut rig = Rig::holding(four(), bent());
        assert_eq!(rig.step(&without(&rig, &[joint])).fault, None);
        let output = rig.step(&without(&rig, &[joint]));
        assert_eq!(output.fault, Some(Fault::EncoderLost { joint }));
        assert_eq!(output.fallback_torque_nm, Vector::<4>::zeros());
        assert_eq!(output.torques.total(), Vector::<4>::zeros());
        assert_eq!(rig.rest().torque_nm, Vector::<4>::zeros());
    }
}

#[test]
fn the_first_state_must_be_complete() {
    for joint in 0..4 {
        let mut rig = Rig::new(four(), bent());
        let output = rig.step(&without(&rig, &[joint]));
        assert_eq!(output.fault, Some(Fault::EncoderLost { joint }));
        assert_eq!(output.torque_nm, Vector::<4>::zeros());
    }
}

fn repeat(rig: &mut Rig<4>) -> Output<4> {
    let cycle = rig.cycle - 1;
    rig.step(&Input {
        cycle,
        ..rig.input()
    })
}

#[test]
fn a_repeated_state_is_tolerated_for_some_cycles() {
    let limit = four().limits.stale_cycles;
    let mut rig = Rig::holding(four(), bent());
    rig.accept(rig.hold_tip_request());
    let last = rig.cycles(100);
    for _ in 0..limit {
        let output = repeat(&mut rig);
        assert_eq!((output.fault, output.mode), (None, Mode::Track));
        // Controller time pauses, and so does the reference.
        assert_eq!(output.mode_time_s, last.mode_time_s);
        assert_eq!(output.reference, last.reference);
        assert!((output.torque_nm - last.torque_nm).norm() < 1e-9);
    }
    let output = repeat(&mut rig);
    let cycles = u64::from(limit) + 1;
    assert_eq!(output.fault, Some(Fault::StateStale { cycles, limit }));
    assert_eq!(output.mode, Mode::Fault);
    assert!(
        output.fallback_torque_nm.norm() > 1.0,
        "the pose is still trusted"
    );
}

#[test]
fn a_new_state_resets_the_stale_count() {
    let limit = four().limits.stale_cycles;
    let mut rig = Rig::holding(four(), bent());
    for _ in 0..20 {
        rig.cycle();
        for _ in 0..limit {
            assert_eq!(repeat(&mut rig).fault, None);
        }
    }
}

#[test]
fn missing_states_are_tolerated_as_long_as_repeated_ones() {
    let limit = four().limits.stale_cycles;
    let (rig, speed) = rotating();
    for missing in 0..=limit + 3 {
        let mut rig = rig.clone();
        rig.cycle += u64::from(missing);
        rig.q += speed * (1e-3 * f64::from(missing + 1));
        let output = rig.cycle();
        if missing <= limit {
            assert_eq!(output.fault, None, "{missing} missing");
            assert!((output.velocity_rad_per_s - speed).norm() < 1e-6);
        } else {
            let cycles = u64::from(missing);
            assert_eq!(output.fault, Some(Fault::StateStale { cycles, limit }));
        }
    }
}

#[test]
fn a_lower_cycle_number_faults_and_later_numbers_count_from_it() {
    let mut rig = Rig::holding(four(), bent());
    let last = rig.cycle - 1;
    let received = last - 7;
    let output = rig.step(&Input {
        cycle: received,
        ..rig.input()
    });
    assert_eq!(
        output.fault,
        Some(Fault::StateOutOfOrder { last, received })
    );
    let output = rig.rest();
    assert_eq!(
        output.fault,
        Some(Fault::StateOutOfOrder { last, received })
    );
    assert_eq!(
        rig.request(supple_core::controller::Request::Reset).fault,
        None
    );
    assert_eq!(rig.rest().fault, None);
}

#[test]
fn cycle_numbers_at_the_limits_of_u64() {
    let mut rig = Rig::holding(four(), bent());
    let last = rig.cycle - 1;
    let output = rig.step(&Input {
        cycle: u64::MAX,
        ..rig.input()
    });
    let limit = four().limits.stale_cycles;
    let cycles = u64::MAX - last - 1;
    assert_eq!(output.fault, Some(Fault::StateStale { cycles, limit }));
    let mut rig = Rig::holding(four(), bent());
    let last = rig.cycle - 1;
    let output = rig.step(&Input {
        cycle: 0,
        ..rig.input()
    });
    let received = 0;
    assert_eq!(
        output.fault,
        Some(Fault::StateOutOfOrder { last, received })
    );
}

/// The tip force of a repeated state is still checked, as it may have changed.
#[test]
fn a_repeated_state_with_a_nan_force_faults() {
    let mut rig = Rig::holding(four(), bent());
    rig.cycle();
    rig.force_n = Some(supple_core::math::Vector3::repeat(f64::NAN));
    let output = repeat(&mut rig);
    assert_eq!(
        output.fault,
        Some(Fault::MeasurementNotFinite { joint: None })
    );
}
