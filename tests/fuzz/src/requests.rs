//! Fuzz target of operator requests: decodes bytes to requests and passes them through the checks of the controller.

use crate::bytes::values_of;
use std::sync::OnceLock;
use supple_core::controller::Request;
use supple_core::{Controller, Input, Output, State, Vector, step};
use supple_ipc::message::{OperatorRequest, Text};
use supple_model::Description;

/// Maximum number of requests per input.
const REQUESTS: usize = 4;
/// Number of cycles after each request.
const CYCLES: u64 = 25;
/// Number of cycles in gravity hold before the first request.
const HOLDING: u64 = 300;

/// Time in which the safe action may remove the complete torque of a joint \[s\].
const STOP_TORQUE_S: f64 = 0.005;

/// Returns the controller of the built-in arm with four joints.
pub fn controller() -> &'static Controller<4> {
    static CONTROLLER: OnceLock<Controller<4>> = OnceLock::new();
    CONTROLLER.get_or_init(|| {
        let config = description().config().expect("four joints");
        Controller::new(config).expect("valid")
    })
}

fn description() -> Description {
    Description::asset("wam4").expect("built in")
}

fn home() -> &'static Vector<4> {
    static HOME: OnceLock<Vector<4>> = OnceLock::new();
    HOME.get_or_init(|| description().home().expect("four joints"))
}

/// Returns the input of a cycle with the arm at rest in its home pose, converted from a message.
pub fn at_rest(cycle: u64, request: Option<Request<4>>) -> Input<4> {
    crate::seed::state_at_rest(cycle, home())
        .input(request)
        .expect("four joints")
}

/// Returns state and output in gravity hold with settled torques.
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

/// Sends requests to a stationary arm in gravity hold, each followed by some cycles.
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
            let again = again.request::<4>().expect("the message is a request");
            // The requests are compared as text, because a request may contain NaN.
            assert_eq!(format!("{again:?}"), format!("{:?}", Some(request)));
        }
        for k in 0..CYCLES {
            let input = at_rest(cycle, request.filter(|_| k == 0));
            let output = step(controller(), &mut state, &input);
            assert_valid_output(controller(), Some(&last), &output);
            if let Some(refusal) = &output.refusal {
                assert!(Text::of(refusal).as_str().starts_with("refused"));
            }
            last = output;
            cycle += 1;
        }
    }
}

/// Asserts that the output of a step is finite and within the limits of joints, motors and rate.
pub fn assert_valid_output<const N: usize>(
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
