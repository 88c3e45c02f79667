//! Settings derived from the arm: stable in every pose, reproducible, and not applied if the TOML gives values.

use crate::common::{TOML, URDF, with};
use supple_core::controller::Controller;
use supple_core::dynamics::crba;
use supple_core::nalgebra::SymmetricEigen;
use supple_core::{Config, Matrix, Vector};
use supple_model::{Description, UrdfName, assets, reach};

const BARE: &str = "name = \"small\"\nurdf = \"small.urdf\"\ntip_frame = \"tip\"\n";

/// Rotor inertias of which half is an error must not make a loop unstable.
fn fastest_rate<const N: usize>(config: &Config<N>, damping: &Vector<N>, pose: u32) -> f64 {
    let share = |k: usize| (f64::from(pose) * [0.618, 0.755, 0.819][k % 3] + 0.1).fract();
    let q = Vector::<N>::from_fn(|i, _| {
        let (lower, upper) = (
            config.limits.position_lower_rad[i].max(-3.1),
            config.limits.position_upper_rad[i].min(3.1),
        );
        lower + share(i) * (upper - lower)
    });
    let mut mass = crba(&config.arm, &q);
    for i in 0..N {
        mass[(i, i)] -= 0.5 * config.arm.armature()[i];
    }
    let inverse = mass.try_inverse().expect("positive definite");
    let root = Matrix::<N, N>::from_diagonal(&damping.map(f64::sqrt));
    let coupled = root * inverse * root;
    let coupled = supple_core::nalgebra::DMatrix::from_fn(N, N, |i, j| coupled[(i, j)]);
    SymmetricEigen::new(coupled).eigenvalues.max()
}

#[test]
fn derived_gains_are_stable_in_every_pose() {
    let completed = Description::from_text(BARE, URDF)
        .unwrap()
        .completed()
        .unwrap();
    let config = completed.description.config::<3>().unwrap();
    let delay_s = Controller::new(config).unwrap().delay_s();
    let (stiffness, damping) = (
        config.move_gains.stiffness_nm_per_rad,
        config.move_gains.damping_nm_s_per_rad,
    );
    for pose in 0..500 {
        let rate = fastest_rate(&config, &damping, pose);
        assert!(
            rate * delay_s < std::f64::consts::FRAC_PI_4,
            "pose {pose}: {rate} 1/s"
        );
        // Every mode is critically damped, to within rounding and the poses between the evaluated ones.
        let frequency = fastest_rate(&config, &stiffness, pose).sqrt();
        assert!(
            2.0 * frequency < 1.3 * DAMPING_TIMES_DELAY / delay_s,
            "pose {pose}: {frequency}"
        );
    }
    // Each derived setting has its reason in the TOML, and an estimate is marked as one.
    let toml = completed.description.toml();
    for derived in &completed.derived {
        assert!(toml.contains(&derived.why), "{derived}");
    }
    assert!(toml.contains("armature_is_estimate = true"), "{toml}");
    assert!(
        completed
            .description
            .settings()
            .joints
            .iter()
            .all(|joint| joint.armature_is_estimate)
    );
}

/// The documented derivation.
const DAMPING_TIMES_DELAY: f64 = 0.4;

#[test]
fn a_completed_arm_is_complete_and_reaches_its_paths() {
    let bare = Description::from_text(BARE, URDF).unwrap();
    let first = bare.completed().unwrap().description;
    let again = first.completed().unwrap();
    assert_eq!(
        (again.description.toml(), again.derived.len()),
        (first.toml(), 0)
    );
    assert_eq!(bare.completed().unwrap().description.toml(), first.toml());
    let config = first.config::<3>().unwrap();
    let (trajectory, duration_s) = first.paths().sinusoid(2.0);
    let start = reach::start_pose(&config, &trajectory, duration_s).expect("in reach");
    let home = Vector::from_column_slice(first.home_rad());
    assert!((start - home).norm() < 2e-3, "{start} {home}");
}

/// The settings in the TOML are unchanged, byte for byte.
#[test]
fn given_settings_and_built_in_arms_are_unchanged() {
    for name in assets() {
        let arm = Description::asset(name).unwrap();
        let completed = arm.completed().unwrap();
        if ["paper3", "wam3", "wam4", "wam7"].contains(name) {
            assert_eq!(completed.description.toml(), arm.toml(), "{name}");
            assert!(
                completed.derived.is_empty(),
                "{name}: {:?}",
                completed.derived
            );
        }
    }
    let given = with(
        TOML,
        "torque_nm = 15.0",
        "torque_nm = 15.0\nmove_stiffness_nm_per_rad = 77.0",
    );
    let held =
        "held = { position_rad = 0.2, stiffness_nm_per_rad = 100.0, damping_nm_s_per_rad = 3.0 }\n";
    let given = with(&given, held, "");
    let completed = Description::from_text(&given, URDF)
        .unwrap()
        .completed()
        .unwrap();
    let joints = &completed.description.settings().joints;
    let elbow = joints.iter().find(|joint| joint.name == "elbow").unwrap();
    assert_eq!(elbow.move_stiffness_nm_per_rad, 77.0);
    // A TOML that lists joints decides which are held.
    assert_eq!(
        joints.iter().filter(|joint| joint.held.is_some()).count(),
        0
    );
    assert_eq!(completed.description.home_rad(), [0.0, 0.5, 0.2]);
}

/// A prismatic lift, eight more joints, a gripper with a mimic, a point mass and an inertia that no body has.
#[test]
fn an_arm_can_be_read_from_a_urdf_alone() {
    let folder = tempfile::tempdir().unwrap();
    let inertial = |mass: &str, i: &str| {
        format!(
            "<inertial><origin xyz=\"0 0 0.05\"/><mass value=\"{mass}\"/>\
             <inertia ixx=\"{i}\" ixy=\"0\" ixz=\"0\" iyy=\"0.002\" iyz=\"0\" izz=\"0.002\"/></inertial>"
        )
    };
    let mut urdf = String::from("<robot name=\"long\"><link name=\"base\"/>");
    let mut joint = |name: &str, kind: &str, parent: &str, more: &str, inertia: &str| {
        urdf += &format!(
            "<link name=\"{name}_link\">{inertia}</link><joint name=\"{name}\" type=\"{kind}\">\
             <parent link=\"{parent}\"/><child link=\"{name}_link\"/><origin xyz=\"0 0 0.15\"/>{more}</joint>"
        );
    };
    let limit = "<limit lower=\"0.1\" upper=\"0.4\" effort=\"60\" velocity=\"3\"/>";
    let turning = "<limit lower=\"-2.5\" upper=\"2.5\" effort=\"60\" velocity=\"3\"/>";
    let sound = inertial("1", "0.002");
    joint(
        "lift",
        "prismatic",
        "base",
        &format!("<axis xyz=\"0 0 1\"/>{limit}"),
        &sound,
    );
    let mut parent = "lift_link".to_owned();
    for k in 0..8 {
        let axis = if k % 2 == 0 { "0 0 1" } else { "0 1 0" };
        let name = format!("j{k}");
        let inertia = if k == 7 {
            inertial("1", "0.02")
        } else {
            sound.clone()
        };
        joint(
            &name,
            "revolute",
            &parent,
            &format!("<axis xyz=\"{axis}\"/>{turning}"),
            &inertia,
        );
        parent = format!("{name}_link");
    }
    let mimic = "<axis xyz=\"0 1 0\"/><mimic joint=\"lift\"/>".to_owned() + limit;
    joint("finger", "prismatic", &parent, &mimic, &sound);
    joint("tool", "fixed", &parent, "", "");
    urdf += "</robot>";
    let path = folder.path().join("long.urdf");
    std::fs::write(&path, urdf).unwrap();
    let mut name = UrdfName::parse(&format!("{}#tool_link", path.display())).unwrap();
    let message = Description::from_urdf(&name).unwrap_err().to_string();
    for fragment in [
        "link `j7_link` <inertial>",
        "physically impossible",
        "--repair",
    ] {
        assert!(message.contains(fragment), "{message}");
    }
    name.repair = true;
    let arm = Description::from_urdf(&name).unwrap();
    assert_eq!(
        arm.joint_names(),
        ["j1", "j2", "j3", "j4", "j5", "j6", "j7"]
    );
    let lines: Vec<String> = arm.warnings().iter().map(ToString::to_string).collect();
    for fragment in [
        "`lift` at 0.1",
        "`j0` at 0",
        "`finger` at 0.1",
        "link `j7_link` <inertial>",
    ] {
        assert!(
            lines.iter().any(|line| line.contains(fragment)),
            "{fragment} in {lines:#?}"
        );
    }
    let completed = arm.completed().unwrap();
    let held = completed.description.settings().joints.iter();
    assert_eq!(held.filter(|joint| joint.held.is_some()).count(), 4);
    // Without a tip the longest chain ends in two places.
    let ends = Description::from_urdf(&UrdfName { tip: None, ..name });
    let message = ends.unwrap_err().to_string();
    for fragment in ["--tip LINK", "tool_link", "finger_link"] {
        assert!(message.contains(fragment), "{message}");
    }
}

/// Writes a URDF of two revolute joints, a third joint of this type, and a fixed flange beside it.
fn gripper_urdf(folder: &std::path::Path, last: &str) -> UrdfName {
    let inertial = "<inertial><mass value=\"1\"/><inertia ixx=\"0.01\" ixy=\"0\" ixz=\"0\" iyy=\"0.01\" iyz=\"0\" \
                    izz=\"0.01\"/></inertial>";
    let mut urdf = "<robot name=\"arm\">".to_owned();
    for link in [
        "base", "upper", "lower", "wrist", "hand", "finger", "flange",
    ] {
        urdf += &format!("<link name=\"{link}\">{inertial}</link>");
    }
    for (name, kind, parent, child) in [
        ("shoulder", "revolute", "base", "upper"),
        ("elbow", "revolute", "upper", "lower"),
        ("roll", "revolute", "lower", "wrist"),
        ("mount", "fixed", "wrist", "hand"),
        ("grip", last, "hand", "finger"),
        ("plate", "fixed", "hand", "flange"),
    ] {
        let axis = if name == "shoulder" { "0 0 1" } else { "0 1 0" };
        urdf += &format!(
            "<joint name=\"{name}\" type=\"{kind}\"><origin xyz=\"0 0 0.3\"/><parent link=\"{parent}\"/><child \
             link=\"{child}\"/><axis xyz=\"{axis}\"/><limit lower=\"-2\" upper=\"2\" effort=\"20\" velocity=\"2\"/></joint>"
        );
    }
    let path = folder.join("gripper.urdf");
    std::fs::write(&path, urdf + "</robot>").unwrap();
    UrdfName::parse(&path.display().to_string()).unwrap()
}

/// A URDF does not state whether its last joint belongs to a gripper, so the warning names both tips, also after all settings are
/// derived.
#[test]
fn a_tip_chosen_without_a_request_is_a_warning_that_names_its_parent_link() {
    let folder = tempfile::tempdir().unwrap();
    let name = gripper_urdf(folder.path(), "revolute");
    let arm = Description::from_urdf(&name).unwrap();
    assert_eq!(arm.settings().tip_frame, "finger");
    let completed = arm.clone().completed().unwrap().description;
    for arm in [&arm, &completed] {
        let lines: Vec<String> = arm.warnings().iter().map(ToString::to_string).collect();
        assert_eq!(lines.len(), 1, "{lines:#?}");
        for part in ["`finger`", "joint `grip`", "--tip hand", "--tip finger"] {
            assert!(lines[0].contains(part), "{part} in {}", lines[0]);
        }
    }
    assert!(arm.strict().is_err());
    let named = UrdfName {
        tip: Some("finger".to_owned()),
        ..name
    };
    assert!(Description::from_urdf(&named).unwrap().strict().is_ok());
}

/// A joint beside the chain of a URDF causes a warning, also for the arm with all settings.
#[test]
fn a_completed_arm_has_the_warnings_of_the_given_files() {
    let folder = tempfile::tempdir().unwrap();
    let mut name = gripper_urdf(folder.path(), "prismatic");
    name.tip = Some("flange".to_owned());
    let completed = Description::from_urdf(&name).unwrap().completed().unwrap();
    let warnings = completed.description.warnings();
    assert!(
        warnings
            .iter()
            .any(|line| line.to_string().contains("`grip`")),
        "{warnings:?}"
    );
}

#[test]
fn a_urdf_without_a_chain_says_what_is_missing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("part.urdf");
    let fixed = "<robot name=\"p\"><link name=\"a\"/><link name=\"b\"/><joint name=\"j\" type=\"fixed\"><parent link=\"a\"/>\
                 <child link=\"b\"/></joint></robot>";
    for (text, found) in [
        (
            "<robot name=\"p\"><link name=\"a\"/></robot>",
            "<robot> without any <joint>",
        ),
        ("<sdf><model/></sdf>", "<sdf> without any <joint>"),
        (fixed, "joints: 1 fixed"),
    ] {
        std::fs::write(&path, text).unwrap();
        let name = UrdfName::parse(&path.display().to_string()).unwrap();
        let message = Description::from_urdf(&name).unwrap_err().to_string();
        for part in [found, "3 to 7 revolute", "part.urdf"] {
            assert!(message.contains(part), "{part} in {message}");
        }
    }
}
