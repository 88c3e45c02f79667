//! All test cases with their expected results, for an arm with any number of joints. The expectations were written before
//! the first run, with two exceptions: the time after a killed controller, which allows for its missing telemetry, and the
//! sinking of the tip, which is not evaluated if a motor is lost.
//!
//! Most events affect the last motor of the wrist, which does not carry the arm's weight, so that the reaction of the other
//! motors can be evaluated. Some affect the second motor of the shoulder, which carries the arm, or the motor of the elbow.

use super::super::matrix::{ENCODER_LOSS_FAULTS, WRONG_DIRECTION_FAULTS};
use super::case::{Case, Event, Expected, TASKS, Task};

/// Resolution of the reported times \[ms\].
const RESOLUTION_MS: f64 = 0.1;
/// Number of cycles within which the plant loop reports a motor fault, or missing replies: the event occurs within a cycle, and
/// one lost reply is tolerated.
const NAMED_CYCLES: f64 = 2.0;
const SILENT_CYCLES: f64 = 3.0;
/// Time without answers after which the controller counts as lost \[ms\].
const ANSWER_MS: f64 = 10.0;
/// Number of cycles whose telemetry may be lost with the controller: the time counts from the last received cycle.
const UNSEEN_CYCLES: f64 = 6.0;
/// Maximum detection time of faults that are observable only in the motion \[ms\].
const MOTION_MS: f64 = 1100.0;
/// Watchdog time of the motors, 20 ms rounded up to its resolution \[ms\].
const WATCHDOG_MS: f64 = 20.5;
/// Error codes with the reports of the plant loop.
const ERRORS: [(&str, &str); 8] = [
    ("8", "reports over-voltage"),
    ("9", "reports under-voltage"),
    ("A", "reports over-current"),
    ("B", "reports that its driver is too hot"),
    ("C", "reports that its winding is too hot"),
    ("D", "reports that commands were missing"),
    ("E", "reports overload"),
    ("5", "reports unknown code 0x5"),
];
/// Valid faults of the controller if a motor does not apply the commanded torque.
const WEAK_MOTOR_FAULTS: &[&str] = WRONG_DIRECTION_FAULTS;

/// All test cases of an arm with this number of joints, at this period \[s\].
pub fn all(joints: usize, period_s: f64) -> Vec<Case> {
    let cycles_ms = |cycles: f64| 1e3 * cycles * period_s + RESOLUTION_MS;
    let (named_ms, silent_ms) = (cycles_ms(NAMED_CYCLES), cycles_ms(SILENT_CYCLES));
    let wrist = joints;
    let (shoulder, elbow) = (2.min(joints), joints.min(if joints > 6 { 4 } else { 3 }));
    let mut events: Vec<(Event, Expected)> = Vec::new();
    let misbehaves = |spec: String, without: Option<usize>| Event::Misbehaves { spec, without };
    let laid_down = |reason: String, within_ms: f64| Expected::LaidDown { reason, within_ms };
    let of = |motor: usize, what: &str| format!("motor {motor} {what}");

    events.push((Event::Nothing, Expected::KeepsRunning));

    // Errors that a motor reports.
    for (code, what) in ERRORS {
        events.push((
            misbehaves(format!("error:motor={wrist},code={code}"), Some(wrist - 1)),
            laid_down(of(wrist, what), named_ms),
        ));
    }
    events.push((
        misbehaves(format!("error:motor={shoulder},code=A"), Some(shoulder - 1)),
        laid_down(of(shoulder, "reports over-current"), named_ms),
    ));

    // Motors that are lost.
    for motor in [wrist, shoulder] {
        events.push((
            misbehaves(format!("silent:motor={motor}"), Some(motor - 1)),
            laid_down(of(motor, "did not reply in two cycles"), silent_ms),
        ));
        events.push((
            misbehaves(format!("reappears:motor={motor}"), Some(motor - 1)),
            laid_down(of(motor, "is disabled and nobody disabled it"), named_ms),
        ));
    }
    // One lost reply is tolerated; two in a row are a lost encoder.
    events.push((
        misbehaves(format!("reply-lost:motor={wrist},every=50"), None),
        Expected::KeepsRunning,
    ));
    events.push((
        misbehaves(format!("reply-lost:motor={wrist},every=2"), None),
        Expected::Fault {
            reason: None,
            names: ENCODER_LOSS_FAULTS,
            within_ms: MOTION_MS,
        },
    ));
    events.push((
        misbehaves(format!("late:motor={wrist},delay-us=9000"), None),
        laid_down(of(wrist, "did not reply in two cycles"), silent_ms),
    ));

    // Temperature: a warning, reduced torque, then a fault.
    for celsius in [75, 90] {
        events.push((
            misbehaves(format!("hot:motor={wrist},celsius={celsius}"), None),
            Expected::KeepsRunning,
        ));
    }
    events.push((
        misbehaves(format!("hot:motor={wrist},celsius=97"), None),
        laid_down(of(wrist, "is hotter than the arm allows"), named_ms),
    ));

    // Registers and ids that change.
    events.push((
        misbehaves(
            format!("register:motor={elbow},number=21,value=25"),
            Some(elbow - 1),
        ),
        laid_down(of(elbow, "reports a position that jumped"), named_ms),
    ));
    events.push((
        misbehaves(
            format!("zero:motor={wrist},offset-rad=6.2832"),
            Some(wrist - 1),
        ),
        laid_down(of(wrist, "reports a position that jumped"), named_ms),
    ));
    // The cycle reads no registers: a motor without torque, or with reduced torque, is detected from the motion.
    let less_torque = misbehaves(
        format!("register:motor={shoulder},number=23,value=10"),
        Some(shoulder - 1),
    );
    let no_torque = misbehaves(
        format!("register:motor={shoulder},number=10,value=2"),
        Some(shoulder - 1),
    );
    for event in [no_torque, less_torque.clone()] {
        events.push((
            event,
            Expected::Fault {
                reason: None,
                names: WEAK_MOTOR_FAULTS,
                within_ms: MOTION_MS,
            },
        ));
    }
    // With a wrong torque sign, the holding torque accelerates the arm, damping does not.
    events.push((
        misbehaves(format!("torque-sign:motor={shoulder}"), None),
        Expected::Fault {
            reason: Some("drives".to_owned()),
            names: WRONG_DIRECTION_FAULTS,
            within_ms: MOTION_MS,
        },
    ));
    events.push((
        misbehaves(
            format!("same-id:motor={wrist},with={}", wrist - 1),
            Some(wrist - 1),
        ),
        laid_down("motor".to_owned(), silent_ms),
    ));

    // The bus.
    for (spec, reason) in [
        ("bus-off", "the CAN interface is bus-off"),
        ("wedged", "the CAN interface does not send its frames"),
    ] {
        events.push((
            misbehaves(spec.to_owned(), None),
            Expected::TorqueEnds {
                reason: Some(reason),
                within_ms: WATCHDOG_MS,
            },
        ));
    }

    // The operator and the processes.
    events.push((
        Event::Idle,
        laid_down("the controller requests no torque".to_owned(), named_ms),
    ));
    events.push((
        Event::KillController,
        laid_down(
            "the controller did not answer".to_owned(),
            ANSWER_MS + cycles_ms(SILENT_CYCLES + UNSEEN_CYCLES),
        ),
    ));
    for event in [Event::KillHost, Event::StopHost] {
        events.push((
            event,
            Expected::TorqueEnds {
                reason: None,
                within_ms: WATCHDOG_MS,
            },
        ));
    }
    // In wall-clock time, counted from the signal, which all processes receive.
    events.push((
        Event::KillUp,
        laid_down("the program is shutting down".to_owned(), 1000.0),
    ));

    let of_tasks = TASKS.iter().flat_map(|task| {
        let of_task = events.iter().map(|(event, expected)| Case {
            task: *task,
            event: event.clone(),
            expected: match task {
                // The shoulder sinks to its hanging pose, as slowly as if a hand guided it with 5 N.
                Task::GravityHold if *event == less_torque => Expected::KeepsRunning,
                _ => expected.clone(),
            },
        });
        of_task.collect::<Vec<_>>()
    });
    of_tasks.collect()
}
