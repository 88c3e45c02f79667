//! Messages between the processes, as a peer may have left them in shared memory, and what is done with them.

use crate::bytes::{value_of, values_of};
use crate::requests::{assert_sound, controller};
use supple_core::{State, step};
use supple_ipc::message::{ArmState, CycleTiming, OperatorReply, Telemetry, Text, TorqueCommand};

/// Most states of one input.
const STATES: usize = 32;

/// States of an arm with four joints, one after the other, into the controller and out as telemetry.
pub fn arm_state(data: &[u8]) {
    let controller = controller();
    let mut state = State::new(controller);
    let mut last = None;
    for arm in values_of::<ArmState>(data).take(STATES) {
        let _ = arm.drives().name();
        let Ok(input) = arm.input::<4>(None) else {
            assert_ne!(arm.dof, 4);
            continue;
        };
        let output = step(controller, &mut state, &input);
        assert_sound(controller, last.as_ref(), &output);
        last = Some(output);
        let command = TorqueCommand::new(&output, false);
        assert_eq!(command.torque::<4>(), Ok(output.torque_nm));
        assert_eq!(command.wants_torque(), !output.limp);
        let told = Telemetry::new(0, &arm, &input, &output, CycleTiming::default());
        assert_eq!(told.mode(), Some(output.mode));
        assert!(told.fault_text.as_str().is_empty() == output.fault.is_none());
    }
}

/// The answer to a state, as the process that owns the motors reads it.
pub fn torque_command(data: &[u8]) {
    let command: TorqueCommand = value_of(data);
    let (torque, fallback) = (command.torque::<4>(), command.fallback_torque::<4>());
    assert_eq!(torque.is_ok(), command.dof == 4);
    assert_eq!(fallback.is_ok(), command.dof == 4);
    assert!(!(command.torque::<7>().is_ok() && torque.is_ok()));
    let _ = command.mode().map(|mode| mode.name());
    let _ = command.wants_torque();
}

/// Telemetry and replies, as a status line, a log and an operator read them.
pub fn telemetry(data: &[u8]) {
    let told: Telemetry = value_of(data);
    let _ = told.mode().map(|mode| mode.name());
    let _ = told.tip_error_m();
    let _ = told.state.drives();
    let request = told.request();
    assert!(request.values().len() <= usize::from(request.count));
    let _ = request.request::<4>().is_ok();
    let _ = told.state.input::<4>(None);
    text(&told.fault_text);
    text(&told.refusal_text);
    let reply: OperatorReply = value_of(data);
    let _ = (reply.outcome(), reply.mode());
    text(&reply.text);
}

/// Words are whole characters, whatever the bytes, and can be said again.
fn text(text: &Text) {
    let words = text.as_str();
    assert!(words.len() <= size_of::<Text>());
    assert_eq!(Text::of(&words).as_str(), words);
    assert_eq!(format!("{text}"), words);
}
