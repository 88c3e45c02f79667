//! Small valid inputs of every target, from which a fuzzer starts.
//!
//! `cargo test -p supple-fuzz --test corpus -- --ignored write_seeds` writes them into the committed corpus, as
//! `seed-*` files; run it after the layout of a message or a log has changed.

pub use crate::seed::{Seed, state_at_rest};

use crate::arms;
use crate::bytes::bytes_of;
use crate::logs;
use crate::requests::{at_rest, controller};
use supple_bus::EncodedFrame;
use supple_can_frame::CanFrame;
use supple_core::config::Gains;
use supple_core::controller::{Breakaway, Request};
use supple_core::dynamics::tip_pose;
use supple_core::math::Vector3;
use supple_core::trajectory::{Arc, Fourier, Line, Probe, Quadrant, Sinusoid, Trajectory};
use supple_core::{Output, State, Vector, step};
use supple_ident::FourierCoefficients;
use supple_ipc::message::{
    ArmState, CycleTiming, OperatorReply, OperatorRequest, Outcome, Telemetry, Text, TorqueCommand,
};
use supple_model::Description;

/// Returns the seeds of a target.
///
/// # Panics
/// If there is no target of this name.
pub fn of(target: &str) -> Vec<Seed> {
    match target {
        "inbound" => frames(&[POSITION, JOINT_POSITION, REPLY, FORCE]),
        "property" => frames(&[SET, GET, REPLY]),
        "position" => frames(&[POSITION, JOINT_POSITION]),
        "torque" => frames(&[TORQUES]),
        "force_torque" => frames(&[FORCE, FORCE_AND_STATUS]),
        "pendant" => vec![("idle".to_owned(), 0x0000_1249_u32.to_le_bytes().to_vec())],
        "values" => (0..4)
            .map(|value: i32| (value.to_string(), value.to_le_bytes().to_vec()))
            .collect(),
        "arm_state" => arm_states(),
        "torque_command" => vec![named("hold", &TorqueCommand::new(&held().1, false))],
        "telemetry" => telemetry(),
        "operator_request" => requests(),
        "log" => logs::seeds(),
        "log_schema" => definitions(),
        "urdf" => vec![text("wam3", arms::URDF)],
        "toml" => vec![text("wam3", arms::TOML)],
        "csv" => tables(),
        "pendant_line" => vec![
            text(
                "buttons",
                "idle\nactivate\nstatus\ne-stop\nrelease\nrecord\n",
            ),
            text("times", "idle@0.001\nactivate@held+0.002\nstatus\n"),
        ],
        "arm_bus" => bus(),
        "damiao_reply" => frames(&[DAMIAO_FEEDBACK, DAMIAO_REGISTER]),
        "damiao_request" => frames(&[DAMIAO_COMMAND, DAMIAO_SET_ZERO, DAMIAO_READ]),
        other => panic!("no target {other}"),
    }
}

const POSITION: &[u8] = &[0x23, 0x04, 0x00, 0x12, 0x34];
const JOINT_POSITION: &[u8] = &[0x23, 0x04, 0x00, 0x12, 0x34, 0x3f, 0xff, 0xfe];
const REPLY: &[u8] = &[0x26, 0x04, 0x85, 0x00, 0x02, 0x00];
const SET: &[u8] = &[0x01, 0x00, 0x88, 0x00, 0x02, 0x00];
const GET: &[u8] = &[0x01, 0x00, 0x05];
const TORQUES: &[u8] = &[0x01, 0x04, 0xaa, 0x00, 0x10, 0x20, 0x30, 0x40, 0x50, 0x60];
const DAMIAO_FEEDBACK: &[u8] = &[0x13, 0x00, 0x13, 0x7f, 0x3b, 0x7f, 0xf8, 0x00, 0x1a, 0x19];
const DAMIAO_REGISTER: &[u8] = &[0x13, 0x00, 0x03, 0x00, 0x33, 0x0e, 0x37, 0x30, 0x33, 0x38];
const DAMIAO_COMMAND: &[u8] = &[0x03, 0x00, 0x7a, 0xe1, 0x83, 0x32, 0x8f, 0x40, 0x07, 0x24];
const DAMIAO_SET_ZERO: &[u8] = &[0x02, 0x00, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xfe];
const DAMIAO_READ: &[u8] = &[0xff, 0x07, 0x03, 0x00, 0x33, 0x09, 0x00, 0x00, 0x00, 0x00];
const FORCE: &[u8] = &[0x0a, 0x05, 0x01, 0x00, 0x02, 0x00, 0xff, 0xff];
const FORCE_AND_STATUS: &[u8] = &[0x0a, 0x05, 0x01, 0x00, 0x02, 0x00, 0xff, 0xff, 0x00];

fn frames(all: &[&[u8]]) -> Vec<Seed> {
    let named = |(index, frame): (usize, &&[u8])| (index.to_string(), frame.to_vec());
    all.iter().enumerate().map(named).collect()
}

fn text(name: &str, text: &str) -> Seed {
    (name.to_owned(), text.as_bytes().to_vec())
}

fn named<T: crate::bytes::AnyBitPattern>(name: &str, value: &T) -> Seed {
    (name.to_owned(), bytes_of(value))
}

fn home() -> Vector<4> {
    let description = Description::asset("wam4").expect("built in");
    description.home().expect("four joints")
}

fn arm_states() -> Vec<Seed> {
    let home = home();
    let sequence = |states: &[ArmState]| -> Vec<u8> { states.iter().flat_map(bytes_of).collect() };
    let at = |cycle| state_at_rest(cycle, &home);
    let mut lost = at(3);
    lost.position_present = 0b0101;
    let other = ArmState { dof: 7, ..at(4) };
    vec![
        (
            "at_rest".to_owned(),
            sequence(&[at(1), at(2), at(3), at(4)]),
        ),
        ("lost".to_owned(), sequence(&[at(1), at(2), lost, at(4)])),
        ("stale".to_owned(), sequence(&[at(1), at(1), at(9)])),
        ("of_another_arm".to_owned(), sequence(&[at(1), other])),
    ]
}

/// Returns state and output of a step in gravity hold.
fn held() -> (ArmState, Output<4>) {
    let mut state = State::new(controller());
    step(controller(), &mut state, &at_rest(0, None));
    let output = step(
        controller(),
        &mut state,
        &at_rest(1, Some(Request::GravityHold)),
    );
    (state_at_rest(1, &home()), output)
}

fn telemetry() -> Vec<Seed> {
    let (arm, output) = held();
    let input = at_rest(1, Some(Request::GravityHold));
    let telemetry = Telemetry::new(1, &arm, &input, &output, CycleTiming::default());
    let request = OperatorRequest::new(1, 1, None, &Request::<4>::Idle);
    let text = Text::of(&"refused: not allowed in mode idle");
    let reply = OperatorReply::new(&request, 1, output.mode, Outcome::Refused, text);
    vec![named("hold", &telemetry), named("reply", &reply)]
}

fn requests() -> Vec<Seed> {
    let home = home();
    let arm = &controller().config().arm;
    let tip_m = tip_pose(arm, &home).translation;
    let far_m = tip_m + Vector3::new(0.02, 0.0, -0.02);
    let all = [
        ("idle", Request::Idle),
        ("gravity_hold", Request::GravityHold),
        ("reset", Request::Reset),
        (
            "move",
            Request::Move {
                target_rad: home,
                duration_s: 1.0,
            },
        ),
        (
            "gains",
            Request::Gains {
                gains: Gains::isotropic(100.0, 20.0),
                ramp_s: 0.1,
            },
        ),
        ("excite", Request::Excite(Fourier::at_rest(home, 1.0))),
        (
            "breakaway",
            Request::Breakaway(Breakaway {
                joint: 1,
                rate_nm_per_s: 0.5,
                stop_rad: 0.035,
                limit_nm: 4.0,
            }),
        ),
        ("hold", Request::Track(Trajectory::Hold(tip_m))),
        (
            "line",
            Request::Track(Trajectory::Line(Line {
                from_m: tip_m,
                to_m: far_m,
                duration_s: 1.0,
            })),
        ),
        (
            "sinusoid",
            Request::Track(Trajectory::Sinusoid(Sinusoid {
                centre_m: tip_m,
                amplitude_m: Vector3::new(0.0, 0.0, 0.05),
                angular_frequency_rad_per_s: 1.0,
                ramp_s: 1.0,
            })),
        ),
        (
            "arc",
            Request::Track(Trajectory::Arc(Arc {
                radius_m: tip_m.x.hypot(tip_m.y),
                height_m: tip_m.z,
                centre_rad: tip_m.y.atan2(tip_m.x),
                amplitude_rad: 0.1,
                angular_frequency_rad_per_s: 1.0,
                ramp_s: 1.0,
            })),
        ),
        (
            "quadrant",
            Request::Track(Trajectory::Quadrant(Quadrant::new(
                tip_m,
                Vector3::new(0.05, 0.0, 0.0),
                Vector3::new(0.0, 0.0, 0.05),
                0.05,
                0.5,
            ))),
        ),
        (
            "probe",
            Request::Track(Trajectory::Probe(Probe {
                radius_m: tip_m.x.hypot(tip_m.y),
                strokes: 3,
                radial_step_m: 0.00667,
                top_m: tip_m.z,
                stroke_m: 0.1,
                azimuth_rad: tip_m.y.atan2(tip_m.x),
                azimuth_step_rad: 0.05,
                speed_m_per_s: 0.04,
                ramp_s: 0.1,
                dwell_s: 0.0,
            })),
        ),
    ];
    let coded = |(name, request): (&str, Request<4>)| {
        named(name, &OperatorRequest::new(1, 1, None, &request))
    };
    all.map(coded).to_vec()
}

/// Separator line between message definitions.
const SEPARATOR: &str =
    "================================================================================";

fn definitions() -> Vec<Seed> {
    let with = |name: &str, definition: &str, message: &[u8]| -> Seed {
        let mut bytes = definition.as_bytes().to_vec();
        bytes.push(0);
        bytes.extend_from_slice(message);
        (name.to_owned(), bytes)
    };
    let numbers = [&[0, 1, 0, 0][..], &[0; 10]].concat();
    // The message has three structures of five bytes, the second and third aligned to four bytes, and an empty string.
    let nested = [&[0, 1, 0, 0][..], &[0; 24], &[1, 0, 0, 0, 0]].concat();
    vec![
        with("numbers", "float64 x\nint8[2] y\n", &numbers),
        with(
            "nested",
            &format!("P[3] p\nstring name\n{SEPARATOR}\nMSG: pkg/P\nfloat32 x\nbool b\n"),
            &nested,
        ),
        with(
            "sequence",
            "uint16[] n\n",
            &[0, 1, 0, 0, 2, 0, 0, 0, 1, 0, 2, 0],
        ),
    ]
}

fn tables() -> Vec<Seed> {
    let mut table = "t,q[0],q[1],q[2],tau[0],tau[1],tau[2]\n".to_owned();
    for k in 0..6 {
        let t = f64::from(k) * 0.01;
        table += &format!("{t},{},{},{},1.5,-2,{t}\n", 0.1 * t.sin(), t, -t);
    }
    let series = FourierCoefficients::from(&Fourier::<3>::at_rest(Vector::repeat(0.2), 0.5));
    let series = serde_json::to_string(&series).expect("plain data");
    vec![text("table", &table), text("series", &series)]
}

fn bus() -> Vec<Seed> {
    let raw = |frames: &[&[u8]]| -> Vec<u8> {
        let raw = frames.iter().map(|bytes| {
            let id = u32::from(u16::from_le_bytes([bytes[0], bytes[1]]));
            EncodedFrame::of_data(&CanFrame::from_raw(id, &bytes[2..]).expect("a frame"))
        });
        raw.flat_map(|raw| raw.to_vec()).collect()
    };
    let positions: &[u8] = &[0x04, 0x04, 0x30];
    vec![
        ("cycle".to_owned(), raw(&[positions, TORQUES, positions])),
        ("properties".to_owned(), raw(&[GET, SET, GET])),
    ]
}
