//! Property-based tests of the codec.

use proptest::prelude::*;
use supple_damiao::{Feedback, Frame, MitCodes, MitCommand, Ranges, Request, Status, TorqueShaper};

fn ranges() -> impl Strategy<Value = Ranges> {
    (1.0..100.0, 1.0..200.0, 0.1..200.0)
        .prop_map(|(p, v, t)| Ranges::new(p, v, t).expect("positive ranges"))
}

fn codes() -> impl Strategy<Value = MitCodes> {
    (
        any::<u16>(),
        0..0x1000u16,
        0..0x1000u16,
        0..0x1000u16,
        0..0x1000u16,
    )
        .prop_map(|(position, velocity, kp, kd, torque)| MitCodes {
            position,
            velocity,
            kp,
            kd,
            torque,
        })
}

/// Generates any command, including values far outside the ranges.
fn command() -> impl Strategy<Value = MitCommand> {
    let any = || {
        prop_oneof![
            -1e6..1e6,
            -15.0..15.0,
            Just(500.0),
            Just(5.0),
            Just(f64::MAX),
            Just(f64::MIN)
        ]
    };
    (any(), any(), any(), any(), any()).prop_map(|(p, v, kp, kd, t)| MitCommand {
        position_rad: p,
        velocity_rad_per_s: v,
        kp_nm_per_rad: kp,
        kd_nm_s_per_rad: kd,
        torque_nm: t,
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_command_is_never_a_special_frame(command in command(), ranges in ranges(), id in 1..16u8) {
        let frame = command.encode(id, &ranges).unwrap();
        let request = Request::parse(&frame, id);
        prop_assert!(matches!(request, Some(Request::Mit(_))), "{:?} {:?}", frame, request);
    }

    #[test]
    fn codes_survive_a_round_trip(codes in codes(), ranges in ranges()) {
        let expected = MitCodes { kp: codes.kp.min(0xFFE), ..codes };
        prop_assert_eq!(codes.command(&ranges).codes(&ranges).unwrap(), expected);
        let frame = codes.emit(3);
        prop_assert_eq!(MitCodes::parse(frame.eight().unwrap()), expected);
    }

    #[test]
    fn rounding_is_off_by_half_a_step_at_most(fraction in -1.0..1.0f64, ranges in ranges()) {
        for code in [ranges.position(), ranges.velocity(), ranges.torque()] {
            let value = fraction * code.max();
            let again = code.decode(code.encode(value, "value").unwrap());
            prop_assert!((again - value).abs() <= 0.5 * code.step() * (1.0 + 1e-9));
        }
    }

    /// The sum of the sent torques stays within half a step of the sum of the requested torques.
    #[test]
    fn the_mean_torque_is_exact(torques in prop::collection::vec(-9.0..9.0f64, 1..400)) {
        let ranges = Ranges::new(12.5, 30.0, 10.0).unwrap();
        let mut shaper = TorqueShaper::new();
        let (mut wanted_nm, mut sent_nm) = (0.0, 0.0);
        for torque_nm in torques {
            wanted_nm += torque_nm;
            sent_nm += ranges.torque().decode(shaper.encode(torque_nm, &ranges).unwrap());
            prop_assert!((wanted_nm - sent_nm).abs() <= 0.5 * ranges.torque().step() * (1.0 + 1e-6));
        }
    }

    #[test]
    fn feedback_survives_a_round_trip(bytes in any::<[u8; 8]>(), reply_id in 0x10..0x7FFu16) {
        let frame = Frame::new(u32::from(reply_id), &bytes).unwrap();
        let feedback = Feedback::parse(&frame).unwrap();
        prop_assert_eq!(feedback.emit(reply_id), frame);
        prop_assert_eq!(feedback.status, Status::from_code(bytes[0] >> 4));
    }

    /// A frame is for one motor only, unless another id has the same low byte.
    #[test]
    fn a_frame_is_for_one_motor(raw in 0..0x800u32, payload in prop::collection::vec(any::<u8>(), 0..9)) {
        let frame = Frame::new(raw, &payload).unwrap();
        let hearing = (1..16u8).filter(|id| Request::parse(&frame, *id).is_some());
        prop_assert!(hearing.count() <= 1);
    }
}

/// Encodes all torque codes at the maximum position, velocity, kp and kd, for which public encoders produce the frames "clear
/// error", "enable", "disable" and "set zero".
#[test]
fn no_saturated_torque_is_a_special_frame() {
    for torque in 0..=0xFFF {
        for kp in [0xFFE, 0xFFF, 0xFFFF] {
            let codes = MitCodes {
                position: 0xFFFF,
                velocity: 0xFFF,
                kp,
                kd: 0xFFF,
                torque,
            };
            let frame = codes.emit(1);
            assert!(
                matches!(Request::parse(&frame, 1), Some(Request::Mit(_))),
                "{frame:?}"
            );
        }
    }
}

#[test]
fn values_that_are_not_finite_are_refused() {
    let ranges = Ranges::new(12.5, 30.0, 10.0).unwrap();
    let mut shaper = TorqueShaper::new();
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for command in [
            MitCommand {
                position_rad: bad,
                ..MitCommand::ZERO
            },
            MitCommand {
                velocity_rad_per_s: bad,
                ..MitCommand::ZERO
            },
            MitCommand {
                kp_nm_per_rad: bad,
                ..MitCommand::ZERO
            },
            MitCommand {
                kd_nm_s_per_rad: bad,
                ..MitCommand::ZERO
            },
            MitCommand {
                torque_nm: bad,
                ..MitCommand::ZERO
            },
        ] {
            assert!(command.encode(1, &ranges).is_err());
        }
        assert!(shaper.encode(bad, &ranges).is_err());
        assert_eq!(shaper.carried_nm(), 0.0);
        assert!(Ranges::new(bad, 30.0, 10.0).is_err());
    }
    assert!(Ranges::new(12.5, 0.0, 10.0).is_err());
    assert!(Ranges::new(12.5, 30.0, -10.0).is_err());
}

/// Zero has no code: half of the cycles send the code above zero, half the code below.
#[test]
fn zero_torque_alternates_between_its_neighbours() {
    let ranges = Ranges::new(12.5, 45.0, 54.0).unwrap();
    let mut shaper = TorqueShaper::new();
    let codes: Vec<u16> = (0..1000)
        .map(|_| shaper.encode(0.0, &ranges).unwrap())
        .collect();
    assert!(codes.iter().all(|code| [0x7FF, 0x800].contains(code)));
    assert_eq!(codes.iter().filter(|code| **code == 0x800).count(), 500);
}

/// A saturated torque carries no error: the next torque is sent exactly.
#[test]
fn a_saturated_torque_carries_no_error() {
    let ranges = Ranges::new(12.5, 30.0, 10.0).unwrap();
    let mut shaper = TorqueShaper::new();
    for _ in 0..100 {
        assert_eq!(shaper.encode(50.0, &ranges).unwrap(), 0xFFF);
    }
    assert_eq!(shaper.carried_nm(), 0.0);
}
