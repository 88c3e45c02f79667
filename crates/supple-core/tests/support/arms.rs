//! The WAM's published bodies with rotors and a tool, from `data/arms.json`.

use serde_json::Value;
use supple_core::math::{Matrix3, Vector3};
use supple_core::{Arm, Body, Joint, Pose};

const ARMS: &str = include_str!("../data/arms.json");

/// Base yaw, shoulder pitch, elbow.
pub fn wam3() -> Arm<3> {
    read("wam3", [0.205, 0.189, 0.035])
}

/// Base yaw, shoulder pitch, shoulder roll, elbow.
pub fn wam4() -> Arm<4> {
    read("wam4", [0.205, 0.189, 0.067, 0.035])
}

/// The four and a wrist.
pub fn wam7() -> Arm<7> {
    read(
        "wam7",
        [0.205, 0.189, 0.067, 0.035, 0.0032, 0.0032, 0.000_32],
    )
}

fn read<const N: usize>(name: &str, armature: [f64; N]) -> Arm<N> {
    let arms: Value = serde_json::from_str(ARMS).expect("valid JSON");
    let arm = &arms[name];
    assert_eq!(arm["joints"].as_array().map(Vec::len), Some(N));
    let joints = std::array::from_fn(|i| {
        let joint = &arm["joints"][i];
        Joint {
            parent_from_link: pose(&joint["origin"]),
            axis: Vector3::from(three(&joint["axis"])),
            body: body(&joint["body"]),
            armature_kg_m2: armature[i],
        }
    });
    let tip = arm["tip"].as_array().expect("a chain of frames");
    let last_link_from_tip = tip.iter().fold(Pose::IDENTITY, |p, o| p * pose(o));
    let tool = Body {
        mass_kg: 0.35,
        com_m: Vector3::new(0.0, 0.0, -0.012),
        inertia_kg_m2: Matrix3::from_diagonal(&Vector3::new(1.5e-4, 1.5e-4, 1.8e-4)),
    };
    let gravity = Vector3::new(0.0, 0.0, -9.81);
    Arm::new(&joints, last_link_from_tip, Some(tool), gravity).expect("a physical arm")
}

fn body(description: &Value) -> Body {
    let i = |name: &str| number(&description["inertia"][name]);
    Body {
        mass_kg: number(&description["mass"]),
        com_m: Vector3::from(three(&description["com"])),
        #[rustfmt::skip]
        inertia_kg_m2: Matrix3::new(
            i("ixx"), i("ixy"), i("ixz"),
            i("ixy"), i("iyy"), i("iyz"),
            i("ixz"), i("iyz"), i("izz"),
        ),
    }
}

fn pose(origin: &Value) -> Pose {
    Pose::from_xyz_rpy(three(&origin["xyz"]), three(&origin["rpy"]))
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn three(value: &Value) -> [f64; 3] {
    std::array::from_fn(|i| number(&value[i]))
}
