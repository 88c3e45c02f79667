//! Fuzz targets of messages between the processes with arbitrary content, as a faulty process may write them to shared memory.

use crate::bytes::{value_of, values_of};
use crate::requests::{assert_valid_output, controller};
use supple_core::codes::VALUES;
use supple_core::controller::CycleRecord;
use supple_core::record;
use supple_core::{State, step};
use supple_ipc::message::{ArmState, CycleTiming, OperatorReply, Telemetry, Text, TorqueCommand};

/// Maximum number of states per input.
const STATES: usize = 32;

/// Passes successive states of a 4-joint arm through the controller to telemetry.
pub fn arm_state(data: &[u8]) {
    let controller = controller();
    let mut state = State::new(controller);
    let mut last = None;
    for arm_state in values_of::<ArmState>(data).take(STATES) {
        let _ = arm_state.drives().name();
        let Ok(input) = arm_state.input::<4>(None) else {
            assert_ne!(arm_state.dof, 4);
            continue;
        };
        let output = step(controller, &mut state, &input);
        assert_valid_output(controller, last.as_ref(), &output);
        last = Some(output);
        let command = TorqueCommand::new(&output, false);
        assert_eq!(command.torque::<4>(), Ok(output.torque_nm));
        assert_eq!(command.wants_torque(), !output.torque_off);
        let telemetry = Telemetry::new(0, &arm_state, &input, &output, CycleTiming::default());
        let record = telemetry.record_of::<4>();
        assert_eq!(record.mode(), Some(output.mode));
        assert!(record.fault_text.as_str().is_empty() == output.fault.is_none());
    }
}

/// Reads torque commands, as the process that owns the motors does.
pub fn torque_command(data: &[u8]) {
    let command: TorqueCommand = value_of(data);
    let (torque, fallback) = (command.torque::<4>(), command.fallback_torque::<4>());
    assert_eq!(torque.is_ok(), command.dof == 4);
    assert_eq!(fallback.is_ok(), command.dof == 4);
    assert!(!(command.torque::<7>().is_ok() && torque.is_ok()));
    let _ = command.mode().map(|mode| mode.name());
    let _ = command.wants_torque();
}

/// Reads telemetry and replies, as the status line, the log and an operator do.
pub fn telemetry(data: &[u8]) {
    let telemetry: Telemetry = value_of(data);
    let _ = telemetry.state.drives();
    let _ = telemetry.state.input::<4>(None);
    let record = telemetry.record();
    let _ = record.mode().map(|mode| mode.name());
    let _ = record.tip_error_m();
    assert!(record.request_values.values().len() <= VALUES);
    let _ = telemetry.record_of::<4>().input().is_ok();
    for text in [&record.fault_text, &record.refusal_text] {
        assert_eq!(record::Text::from_display(text).as_str(), text.as_str());
    }
    let fields = CycleRecord::<7>::FIELDS;
    let mut columns = 0;
    record::for_each_column(
        fields,
        telemetry.words(),
        telemetry.dof(),
        |column, cell| {
            columns += 1;
            assert!(format!("{column}={cell}").len() > 1);
        },
    );
    // With a `dof` of 0, fields per joint have no column, but vectors have three.
    assert!(columns >= fields.len() - 3);
    let reply: OperatorReply = value_of(data);
    let _ = (reply.outcome(), reply.mode());
    check_text(&reply.text);
}

/// Checks that a text is valid UTF-8 for any bytes and survives a round trip.
fn check_text(text: &Text) {
    let string = text.as_str();
    assert!(string.len() <= size_of::<Text>());
    assert_eq!(Text::of(&string).as_str(), string);
    assert_eq!(format!("{text}"), string);
}
