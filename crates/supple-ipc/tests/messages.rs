//! Messages carry what they were made of, to the last bit, and refuse readers they are not for.

mod support;

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use std::mem::size_of;
use supple_core::controller::{Mode, Request};
use supple_core::{Trajectory, Vector, trajectory::Sinusoid};
use supple_ipc::message::*;

#[test]
fn there_is_no_padding_to_share() {
    let joints = MAX_DOF * 8;
    assert_eq!(size_of::<PlantReport>(), 9 * 8);
    assert_eq!(
        size_of::<ArmState>(),
        3 * 8 + joints + 3 * 8 + size_of::<PlantReport>() + 8
    );
    assert_eq!(size_of::<TorqueCommand>(), 2 * 8 + 2 * joints + 8);
    assert_eq!(size_of::<Text>(), 256);
    assert_eq!(size_of::<OperatorRequest>(), 3 * 8 + 80 * 8 + 8);
    assert_eq!(size_of::<OperatorReply>(), 3 * 8 + size_of::<Text>() + 8);
    assert_eq!(size_of::<TermTorques>(), 13 * joints);
    assert_eq!(size_of::<CycleTiming>(), 3 * 8);
    assert_eq!(
        size_of::<Telemetry>(),
        2 * 8
            + size_of::<ArmState>()
            + size_of::<OperatorRequest>()
            + 8
            + 5 * joints
            + size_of::<TermTorques>()
            + 8 * 3 * 8
            + 6 * 8
            + size_of::<CycleTiming>()
            + 2 * size_of::<Text>()
            + 8
    );
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(20_260_401),
        ..ProptestConfig::default()
    })]

    #[test]
    fn an_arm_state_gives_the_input_it_was_made_of(
        cycle in any::<u64>(),
        position in proptest::array::uniform7(proptest::option::of(any::<f64>())),
        force in proptest::option::of(proptest::array::uniform3(any::<f64>())),
    ) {
        let force = force.map(Into::into);
        let state = ArmState::new::<7>(
            cycle, 0, &position, force, Drives::Idle, PlantReport::default(),
        );
        let input = state.input::<7>(None).expect("of seven joints");
        prop_assert_eq!(input.cycle, cycle);
        let bits = |p: Option<f64>| p.map(f64::to_bits);
        prop_assert_eq!(input.position_rad.map(bits), position.map(bits));
        let bits = |f: [f64; 3]| f.map(f64::to_bits);
        prop_assert_eq!(
            input.tip_force_n.map(|f| bits(f.into())),
            force.map(|f: supple_core::math::Vector3<f64>| bits(f.into()))
        );
    }

    #[test]
    fn words_are_cut_at_a_character_and_never_lost(words in "\\PC{0,200}") {
        let text = Text::of(&words);
        prop_assert!(words.starts_with(text.as_str()));
        prop_assert!(text.as_str().len() == words.len() || text.as_str().len() > 252 - 4);
    }
}

#[test]
fn another_arm_is_refused_by_name_and_number() {
    let state = support::state(0);
    let error = state.input::<7>(None).expect_err("four joints");
    let words = error.to_string();
    for word in ["arm state", "4 joints", "7 are expected", "--arm"] {
        assert!(words.contains(word), "{words}");
    }
    let input = state.input::<4>(None).expect("four joints");
    let command = TorqueCommand::new(&support::answer(&input), false);
    assert!(command.torque::<3>().is_err() && command.fallback_torque::<3>().is_err());
    let request = OperatorRequest::new::<4>(1, 1, None, &Request::Idle);
    assert!(request.request::<3>().is_err());
}

#[test]
fn a_command_carries_torques_mode_and_what_the_drives_are_to_do() {
    let hold = |request, leaving| {
        let input = support::state(7).input::<4>(request).expect("four joints");
        let output = support::answer(&input);
        (output, TorqueCommand::new(&output, leaving))
    };
    let (output, command) = hold(Some(Request::GravityHold), false);
    assert_eq!(command.cycle, 7);
    assert_eq!(command.torque::<4>(), Ok(output.torque_nm));
    assert_eq!(
        command.fallback_torque::<4>(),
        Ok(output.fallback_torque_nm)
    );
    assert_eq!(command.mode(), Some(Mode::GravityHold));
    assert!(command.wants_torque());
    assert!(!hold(Some(Request::GravityHold), true).1.wants_torque());
    let (_, idle) = hold(None, false);
    assert!(!idle.wants_torque());
    assert_eq!(idle.torque::<4>(), Ok(Vector::zeros()));
}

#[test]
fn telemetry_says_what_was_asked_and_how_far_the_tip_is() {
    let trajectory = Trajectory::Sinusoid(Sinusoid::paper(1.0));
    let state = support::state(3);
    let input = state
        .input::<4>(Some(Request::Track(trajectory)))
        .expect("four joints");
    let output = support::answer(&input);
    let telemetry = Telemetry::new(9, &state, &input, &output, CycleTiming::default());
    assert_eq!(telemetry.request().request::<4>(), Ok(input.request));
    assert_eq!(telemetry.mode(), Some(Mode::Idle));
    assert!(
        telemetry
            .refusal_text
            .as_str()
            .contains("not from mode idle")
    );
    assert_eq!(telemetry.tip_error_m(), None);
    assert_eq!(telemetry.state, state);
}

#[test]
fn requests_wait_for_their_cycle() {
    let at = |cycle| OperatorRequest::new::<4>(1, 1, cycle, &Request::GravityHold);
    assert!(at(None).is_due(0));
    assert!(!at(Some(5)).is_due(4) && at(Some(5)).is_due(5) && at(Some(5)).is_due(6));
    let request = at(Some(5)).request::<4>();
    assert_eq!(request, Ok(Some(Request::GravityHold)));
}
