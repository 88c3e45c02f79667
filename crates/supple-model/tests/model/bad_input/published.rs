//! A URDF in the style of published robots: extensions of other programs are listed, unknown content that would
//! change the dynamics is rejected.

use crate::common::{TOML, URDF, with};
use supple_model::{Description, ModelError};

/// The test arm in the style of a vendor's repository.
fn published() -> String {
    let changes = [
        (
            "<robot name=\"small\">",
            "<robot name=\"small\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\" \
             xmlns:drake=\"http://drake.mit.edu\">\n  <material name=\"white\"><color rgba=\"1 1 1 \
             1\"/></material>",
        ),
        (
            "<link name=\"base\"/>",
            "<link name=\"base\"><origin xyz=\"0 0 0\" rpy=\"0 0 0\"/><visual><geometry><mesh \
             filename=\"package://small/base.dae\" scale=\"1 1 1\"/></geometry><material \
             name=\"white\"/></visual><collision name=\"coarse\"><geometry><ellipsoid radii=\"1 1 \
             1\"/></geometry></collision><self_collision_checking><origin/></self_collision_checking></link>",
        ),
        (
            "<dynamics damping=\"0.7\" friction=\"0.4\"/>",
            "<dynamics D=\"1\" K=\"7000\" damping=\"0.7\" friction=\"0.4\" mu_coulomb=\"0\" \
             mu_viscous=\"16\"/><calibration rising=\"0.0\"/>",
        ),
        (
            "<limit lower=\"-1.5\" upper=\"1.5\" effort=\"40\" velocity=\"2\"/>",
            "<limit lower=\"-1.5\" upper=\"1.5\" effort=\"40\" velocity=\"2\" \
             command_effort=\"40\" \
             drake:acceleration=\"7.5\"/><safety_controller k_position=\"100\"/><hardwareInterface/><drake:limit \
             effort=\"9\"/>",
        ),
        (
            "<limit lower=\"-2.5\" upper=\"2.5\" effort=\"20\" velocity=\"2\"/>",
            "<limit lower=\"-2.5\" upper=\"2.5\" effort=\"20\" velocity=\"2\"/><dynamics D=\"2\" \
             K=\"700\"/>",
        ),
        (
            "</robot>",
            "<transmission name=\"t1\"><type>SimpleTransmission</type><joint name=\"yaw\"/><actuator \
             name=\"m1\"/></transmission><transmission name=\"t2\"/><gazebo \
             reference=\"link1\"><mu1>0.2</mu1></gazebo><ros2_control name=\"s\" type=\"system\"><joint \
             name=\"yaw\"><param name=\"min\">-1</param></joint></ros2_control></robot>",
        ),
    ];
    let changed = changes
        .iter()
        .fold(URDF.to_owned(), |text, (from, to)| with(&text, from, to));
    // The friction of the elbow is in the TOML.
    assert!(changed.contains("K=\"700\""));
    changed
}

#[test]
fn extensions_do_not_change_the_arm_and_each_kind_is_listed_once() {
    let plain = Description::from_text(TOML, URDF).expect("valid");
    assert!(plain.warnings().is_empty());
    assert!(plain.clone().strict().is_ok());
    let arm = Description::from_text(TOML, &published()).expect("as published");
    assert_eq!(arm.parts::<3>().unwrap(), plain.parts::<3>().unwrap());
    assert_eq!(arm.motors(), plain.motors());
    assert_eq!(arm.friction(), plain.friction());
    assert_eq!(arm.home_rad(), plain.home_rad());
    let lines: Vec<String> = arm.warnings().iter().map(ToString::to_string).collect();
    for (place, value) in [
        ("<transmission>", "<transmission> first of 2"),
        ("<gazebo>", "<gazebo>"),
        ("<ros2_control>", "<ros2_control>"),
        ("link `base` <origin>", "<origin>"),
        (
            "link `base` <self_collision_checking>",
            "<self_collision_checking>",
        ),
        (
            "joint `shoulder` <hardwareInterface>",
            "<hardwareInterface>",
        ),
        ("joint `shoulder` <limit>", "acceleration=\"7.5\""),
        ("joint `shoulder` <limit>", "command_effort=\"40\""),
        ("joint `shoulder` <limit>", "<limit>"),
        ("joint `shoulder` <dynamics>", "D=\"1\" first of 2"),
        ("joint `shoulder` <dynamics>", "K=\"7000\" first of 2"),
        ("joint `shoulder` <dynamics>", "mu_coulomb=\"0\""),
        ("joint `shoulder` <dynamics>", "mu_viscous=\"16\""),
    ] {
        let is_said = |line: &&String| {
            line.contains(place)
                && line.contains(&format!("found {value};"))
                && line.contains("(line ")
        };
        let said = lines.iter().filter(is_said).count();
        assert_eq!(said, 1, "{place} {value} in {lines:#?}");
    }
    assert_eq!(lines.len(), 13, "{lines:#?}");
    assert!(lines.iter().all(|line| line.starts_with("small.urdf: ")));
    let error = arm.strict().expect_err("strict rejects ignored content");
    assert!(matches!(&error, ModelError::Strict { findings } if findings.len() == 13));
    for line in &lines {
        assert!(error.to_string().contains(line), "{line} in {error}");
    }
}

/// Content that would silently change the dynamics, each in an otherwise valid file.
#[test]
fn unknown_content_that_would_change_the_dynamics_is_rejected() {
    let cases = [
        ("<axis xyz=\"0 0 2\"/>", "<axes xyz=\"0 1 0\"/>", "<axes>"),
        ("<axis xyz=\"0 0 2\"/>", "<Axis xyz=\"0 1 0\"/>", "<Axis>"),
        (
            "<link name=\"tip\"/>",
            "<link name=\"tip\"><mass value=\"2\"/></link>",
            "<mass>",
        ),
        (
            "<link name=\"tip\"/>",
            "<link name=\"tip\"><inertal/></link>",
            "<inertal>",
        ),
        (
            "<dynamics damping=\"0.7\" friction=\"0.4\"/>",
            "<dynamics damping=\"0.7\" frction=\"0.4\"/>",
            "frction=\"0.4\"",
        ),
        (
            "<dynamics damping=\"0.7\" friction=\"0.4\"/>",
            "<dynamic damping=\"0.7\"/>",
            "<dynamic>",
        ),
        (
            "<joint name=\"elbow\" type=\"revolute\">",
            "<joint name=\"elbow\" type=\"revolute\" axis=\"0 0 1\">",
            "axis=\"0 0 1\"",
        ),
        (
            "<mass value=\"1.5\"/>",
            "<mass value=\"1.5\" unit=\"lb\"/>",
            "unit=\"lb\"",
        ),
        ("</robot>", "<Link name=\"l\"/></robot>", "<Link>"),
        (
            "</robot>",
            "<loop_joint name=\"l\"/></robot>",
            "<loop_joint>",
        ),
        (
            "</robot>",
            "<xacro:arm xmlns:xacro=\"http://www.ros.org/wiki/xacro\"/></robot>",
            "<xacro:arm>",
        ),
        (
            "<origin xyz=\"0.4 0 0\" rpy=\"0 0 0\"/>",
            "<origin xyz=\"0.4 0 0\" quat_xyzw=\"1 0 0 0\"/>",
            "version=\"1.0\"",
        ),
    ];
    for (from, to, value) in cases {
        let text = with(URDF, from, to);
        let error = Description::from_text(TOML, &text).expect_err(to);
        let message = error.to_string();
        for word in ["small.urdf", "(line ", "would be lost", value] {
            assert!(message.contains(word), "no `{word}` in: {message}");
        }
    }
}
