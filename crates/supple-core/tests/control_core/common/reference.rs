//! The reference arms and their recorded states; see `data/README.md`.

use serde_json::Value;
use std::array::from_fn;
use supple_core::dynamics::Regressor;
use supple_core::math::{Matrix3, Vector3};
use supple_core::{Arm, Body, Joint, Matrix, Pose, Vector};

const ARMS: &str = include_str!("../../data/arms.json");
const REGRESSORS: &str = include_str!("../../data/regressors.json");

/// A recorded arm with its samples.
pub struct Reference<const N: usize> {
    pub arm: Arm<N>,
    pub samples: Vec<Sample<N>>,
}

/// One state and its dynamic quantities from independent libraries.
pub struct Sample<const N: usize> {
    pub q: Vector<N>,
    pub qd: Vector<N>,
    pub qdd: Vector<N>,
    pub tau: Vector<N>,
    pub rnea: Vector<N>,
    pub mass_matrix: Matrix<N, N>,
    pub coriolis_gravity: Vector<N>,
    pub gravity: Vector<N>,
    pub base_from_tip: Pose,
    pub jacobian: Matrix<6, N>,
    pub jacobian_dot_qd: Vector<6>,
    pub aba: Vector<N>,
    pub coriolis_matrix: Matrix<N, N>,
    pub kinetic_energy: f64,
    pub potential_energy: f64,
    /// Blocks of ten columns per link; for the first states only.
    pub regressor: Option<Regressor<N>>,
}

pub fn wam3() -> Reference<3> {
    read("wam3", include_str!("../../data/wam3.json"))
}

pub fn wam4() -> Reference<4> {
    read("wam4", include_str!("../../data/wam4.json"))
}

pub fn wam7() -> Reference<7> {
    read("wam7", include_str!("../../data/wam7.json"))
}

pub fn openarm() -> Reference<7> {
    let plain = include_str!("../../data/openarm_plain.json");
    read_from(plain, "openarm", include_str!("../../data/openarm.json"))
}

pub fn yam() -> Reference<6> {
    let plain = include_str!("../../data/yam_plain.json");
    read_from(plain, "yam", include_str!("../../data/yam.json"))
}

fn read<const N: usize>(name: &str, states: &str) -> Reference<N> {
    read_from(ARMS, name, states)
}

fn read_from<const N: usize>(arms: &str, name: &str, states: &str) -> Reference<N> {
    let states = json(states);
    let regressors = &json(REGRESSORS)[name];
    let s = &states["samples"];
    let count = states["n_samples"].as_u64().expect("a count") as usize;
    let sample = |k: usize| Sample {
        q: vector(&s["q"][k]),
        qd: vector(&s["qd"][k]),
        qdd: vector(&s["qdd"][k]),
        tau: vector(&s["tau_in"][k]),
        rnea: vector(&s["rnea"][k]),
        mass_matrix: matrix(&s["M"][k]),
        coriolis_gravity: vector(&s["nle"][k]),
        gravity: vector(&s["gravity"][k]),
        base_from_tip: Pose {
            rotation: matrix(&s["tip_rot"][k]),
            translation: vector(&s["tip_pos"][k]),
        },
        jacobian: matrix(&s["J_lwa"][k]),
        jacobian_dot_qd: vector(&s["jdot_qd_classical_lwa"][k]),
        aba: vector(&s["aba"][k]),
        coriolis_matrix: matrix(&s["coriolis_matrix"][k]),
        kinetic_energy: number(&s["kinetic_energy"][k]),
        potential_energy: number(&s["potential_energy"][k]),
        regressor: regressors.get(k).map(regressor),
    };
    Reference {
        arm: arm(&json(arms)[name], vector(&states["gravity"])),
        samples: (0..count).map(sample).collect(),
    }
}

fn arm<const N: usize>(description: &Value, gravity: Vector3<f64>) -> Arm<N> {
    let joint = |i: usize| {
        let joint = &description["joints"][i];
        Joint {
            parent_from_link: pose(&joint["origin"]),
            axis: vector(&joint["axis"]),
            body: body(&joint["body"]),
            armature_kg_m2: 0.0,
        }
    };
    let tip = description["tip"].as_array().expect("a chain of frames");
    let last_link_from_tip = tip.iter().fold(Pose::IDENTITY, |pose_so_far, origin| {
        pose_so_far * pose(origin)
    });
    let joints = std::array::from_fn(joint);
    Arm::new(&joints, last_link_from_tip, None, gravity)
        .expect("the reference arms are physically consistent")
}

fn body(description: &Value) -> Body {
    let inertia = |name: &str| number(&description["inertia"][name]);
    Body {
        mass_kg: number(&description["mass"]),
        com_m: vector(&description["com"]),
        #[rustfmt::skip]
        inertia_kg_m2: Matrix3::new(
            inertia("ixx"), inertia("ixy"), inertia("ixz"),
            inertia("ixy"), inertia("iyy"), inertia("iyz"),
            inertia("ixz"), inertia("iyz"), inertia("izz"),
        ),
    }
}

fn pose(origin: &Value) -> Pose {
    let three = |name: &str| vector::<3>(&origin[name]).into();
    Pose::from_xyz_rpy(three("xyz"), three("rpy"))
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).expect("valid JSON")
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn vector<const N: usize>(value: &Value) -> Vector<N> {
    assert_eq!(value.as_array().map(Vec::len), Some(N));
    Vector::from_fn(|i, _| number(&value[i]))
}

fn matrix<const R: usize, const C: usize>(rows: &Value) -> Matrix<R, C> {
    assert_eq!(rows.as_array().map(Vec::len), Some(R));
    Matrix::from_fn(|i, j| number(&rows[i][j]))
}

fn regressor<const N: usize>(rows: &Value) -> Regressor<N> {
    from_fn(|i| from_fn(|k| Vector::from_fn(|p, _| number(&rows[i][10 * k + p]))))
}
