//! Tests that messages keep their contents bit for bit, and that a reader for another arm rejects them.

use crate::property::config;
use crate::support;
use proptest::prelude::*;
use std::mem::size_of;
use supple_core::controller::{CycleRecord, Mode, Request};
use supple_core::{Trajectory, Vector, trajectory::Sinusoid};
use supple_ipc::message::*;

#[test]
fn messages_have_no_padding() {
    let joint_array_bytes = MAX_DOF * size_of::<f64>();
    assert_eq!(size_of::<PlantReport>(), 9 * 8);
    assert_eq!(
        size_of::<ArmState>(),
        3 * 8 + joint_array_bytes + 3 * 8 + size_of::<PlantReport>() + 8
    );
    assert_eq!(
        size_of::<TorqueCommand>(),
        2 * 8 + 2 * joint_array_bytes + 8
    );
    assert_eq!(size_of::<Text>(), 256);
    assert_eq!(size_of::<OperatorRequest>(), 3 * 8 + 80 * 8 + 8);
    assert_eq!(size_of::<OperatorReply>(), 3 * 8 + size_of::<Text>() + 8);
    assert_eq!(size_of::<CycleTiming>(), 3 * 8);
    let words = CycleRecord::<MAX_DOF>::words(MAX_DOF);
    assert_eq!(
        size_of::<Telemetry>(),
        size_of::<ArmState>() + 8 + size_of::<CycleTiming>() + 8 * words
    );
}

proptest! {
    #![proptest_config(config(256, 20_260_401))]

    #[test]
    fn arm_state_round_trips_to_the_same_input(
        cycle in any::<u64>(),
        position in proptest::array::uniform7(proptest::option::of(any::<f64>())),
        force in proptest::option::of(proptest::array::uniform3(any::<f64>())),
    ) {
        let force = force.map(Into::into);
        let state = ArmState::new::<7>(
            cycle, 0, &position, force, Drives::Idle, PlantReport::default(),
        );
        let input = state.input::<7>(None).expect("the state has seven joints");
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
    fn long_text_is_truncated_at_a_character(long in "\\PC{0,200}") {
        let text = Text::of(&long);
        prop_assert!(long.starts_with(text.as_str()));
        prop_assert!(text.as_str().len() == long.len() || text.as_str().len() > 252 - 4);
    }
}

#[test]
fn messages_for_another_arm_are_refused_with_both_joint_counts() {
    let state = support::state(0);
    let error = state.input::<7>(None).expect_err("four joints");
    let text = error.to_string();
    for word in ["arm state", "4 joints", "expected 7", "--arm"] {
        assert!(text.contains(word), "{text}");
    }
    let input = state.input::<4>(None).expect("four joints");
    let command = TorqueCommand::new(&support::answer(&input), false);
    assert!(command.torque::<3>().is_err() && command.fallback_torque::<3>().is_err());
    let request = OperatorRequest::new::<4>(1, 1, None, &Request::Idle);
    assert!(request.request::<3>().is_err());
}

#[test]
fn command_carries_torques_mode_and_requested_drive_state() {
    let command_after = |request, shutting_down| {
        let input = support::state(7).input::<4>(request).expect("four joints");
        let output = support::answer(&input);
        (output, TorqueCommand::new(&output, shutting_down))
    };
    let (output, command) = command_after(Some(Request::GravityHold), false);
    assert_eq!(command.cycle, 7);
    assert_eq!(command.torque::<4>(), Ok(output.torque_nm));
    assert_eq!(
        command.fallback_torque::<4>(),
        Ok(output.fallback_torque_nm)
    );
    assert_eq!(command.mode(), Some(Mode::GravityHold));
    assert!(command.wants_torque());
    assert!(
        !command_after(Some(Request::GravityHold), true)
            .1
            .wants_torque()
    );
    let (_, idle) = command_after(None, false);
    assert!(!idle.wants_torque());
    assert_eq!(idle.torque::<4>(), Ok(Vector::zeros()));
}

#[test]
fn telemetry_contains_the_request_and_the_refusal() {
    let trajectory = Trajectory::Sinusoid(Sinusoid::paper(1.0));
    let state = support::state(3);
    let input = state
        .input::<4>(Some(Request::Track(trajectory)))
        .expect("four joints");
    let output = support::answer(&input);
    let telemetry = Telemetry::new(9, &state, &input, &output, CycleTiming::default());
    let record = telemetry.record_of::<4>();
    assert_eq!(record, CycleRecord::new(9, &input, &output));
    assert_eq!(record.input(), Ok(input));
    assert_eq!(record.mode(), Some(Mode::Idle));
    assert!(
        record
            .refusal_text
            .as_str()
            .contains("not possible in mode idle")
    );
    assert_eq!(record.tip_error_m(), None);
    // The record for the largest arm has the same values, and zero for joints that the arm does not have.
    let wide = telemetry.record();
    assert_eq!((telemetry.step(), telemetry.dof()), (9, 4));
    assert_eq!(
        wide.position_rad.as_slice()[..4],
        *output.position_rad.as_slice()
    );
    assert_eq!(wide.position_rad.as_slice()[4..], [0.0; 3]);
    assert_eq!(wide.fault_text, record.fault_text);
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
