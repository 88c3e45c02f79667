//! Requests of an operator: from bytes to numbers, to a request, to the controller's own checks.

use crate::bytes::values_of;
use std::sync::OnceLock;
use supple_core::controller::Request;
use supple_core::{Controller, Input, Output, State, Vector, step};
use supple_ipc::message::{OperatorRequest, Text};
use supple_model::Description;

/// Most requests of one input.
const REQUESTS: usize = 4;
/// Cycles after each of them.
const CYCLES: u64 = 25;
/// Cycles that the controller holds the arm before the first.
const HOLDING: u64 = 300;

/// The safe action may take a joint's whole torque away in this time \[s\].
const STOP_TORQUE_S: f64 = 0.005;

/// The controller of the built-in arm with four joints.
pub fn controller() -> &'static Controller<4> {
    static CONTROLLER: OnceLock<Controller<4>> = OnceLock::new();
    CONTROLLER.get_or_init(|| {
        let config = description().config().expect("four joints");
        Controller::new(config).expect("sound")
    })
}

fn description() -> Description {
    Description::asset("wam4").expect("built in")
}

fn home() -> &'static Vector<4> {
    static HOME: OnceLock<Vector<4>> = OnceLock::new();
    HOME.get_or_init(|| description().home().expect("four joints"))
}

/// The arm at rest at home in this cycle: by way of a message, which knows what an input holds.
pub fn at_rest(cycle: u64, request: Option<Request<4>>) -> Input<4> {
    crate::seeds::state_at_rest(cycle, home())
        .input(request)
        .expect("four joints")
}

/// In gravity hold, with the torques settled.
fn holding() -> &'static (State<4>, Output<4>) {
    static HELD: OnceLock<(State<4>, Output<4>)> = OnceLock::new();
    HELD.get_or_init(|| {
        let mut state = State::new(controller());
        let first = Some(Request::GravityHold);
        let mut output = step(controller(), &mut state, &at_rest(0, None));
        for cycle in 1..HOLDING {
            let request = first.filter(|_| cycle == 1);
            output = step(controller(), &mut state, &at_rest(cycle, request));
        }
        assert_eq!(output.fault, None);
        (state, output)
    })
}

/// Requests to an arm that stands still in gravity hold, each followed by some cycles.
pub fn operator_request(data: &[u8]) {
    let (mut state, held) = *holding();
    let mut last = held;
    let mut cycle = HOLDING;
    for message in values_of::<OperatorRequest>(data).take(REQUESTS) {
        let _ = message.is_due(cycle);
        let request = match message.request::<4>() {
            Ok(request) => request,
            Err(error) => {
                assert!(!Text::of(&error).as_str().is_empty());
                None
            }
        };
        if let Some(request) = &request {
            let again = OperatorRequest::new(message.operator, message.sequence, None, request);
            let again = again.request::<4>().expect("it was a request");
            // Compared as words: a request may hold what is not a number.
            assert_eq!(format!("{again:?}"), format!("{:?}", Some(request)));
        }
        for k in 0..CYCLES {
            let input = at_rest(cycle, request.filter(|_| k == 0));
            let output = step(controller(), &mut state, &input);
            assert_sound(controller(), Some(&last), &output);
            if let Some(refusal) = &output.refusal {
                assert!(Text::of(refusal).as_str().starts_with("refused"));
            }
            last = output;
            cycle += 1;
        }
    }
}

/// What holds of every output of a step: finite, within the limits of joints, motors and rate.
pub fn assert_sound<const N: usize>(
    controller: &Controller<N>,
    last: Option<&Output<N>>,
    output: &Output<N>,
) {
    let config = controller.config();
    let limits = &config.limits;
    let motor_nm = controller.motors().motor_torque_nm(&output.torque_nm);
    for i in 0..N {
        for torque in [output.torque_nm[i], output.fallback_torque_nm[i]] {
            assert!(torque.abs() <= limits.joint_torque_nm[i] * (1.0 + 1e-12));
        }
        assert!(motor_nm[i].abs() <= limits.motor_torque_nm[i] * (1.0 + 1e-12));
        let before_nm = last.map_or(0.0, |last| last.torque_nm[i]);
        let step_nm = (output.torque_nm[i] - before_nm).abs();
        let mut rate_nm_per_s = limits.torque_rate_nm_per_s[i];
        if output.fault.is_some() {
            rate_nm_per_s = rate_nm_per_s.max(limits.joint_torque_nm[i] / STOP_TORQUE_S);
        }
        let most_nm = rate_nm_per_s * config.period_s;
        // A torque that is not finite is dropped, not ramped.
        assert!(step_nm <= most_nm * (1.0 + 1e-9) || output.torque_nm[i] == 0.0);
    }
}
