//! Errors in a URDF.

use super::check;
use crate::common::{TOML, with_urdf};
use supple_model::Description;

#[test]
fn errors_in_the_structure_are_rejected() {
    check(
        "small.urdf",
        &[
            ("</robot>", "", ["root node", "never closed", "well-formed"]),
            (
                "<link name=\"base\"/>",
                "<link name=base/>",
                ["3:14", "expected", "well-formed"],
            ),
            (
                "<link name=\"base\"/>",
                "<link/>",
                ["link", "none", "`name`"],
            ),
            (
                "<link name=\"tip\"/>",
                "<link name=\"base\"/>",
                ["link `base`", "twice", "rename"],
            ),
            (
                "name=\"tip_joint\"",
                "name=\"elbow\"",
                ["joint `elbow`", "twice", "rename"],
            ),
            (
                "<parent link=\"flange\"/><child link=\"tip\"/>",
                "<parent link=\"ghost\"/><child link=\"tip\"/>",
                ["`tip_joint` <parent>", "`ghost`", "add <link"],
            ),
            (
                "<parent link=\"flange\"/><child link=\"tip\"/>",
                "<parent link=\"flange\"/><child link=\"ghost\"/>",
                ["`tip_joint` <child>", "`ghost`", "add <link"],
            ),
            (
                "<parent link=\"flange\"/><child link=\"tip\"/>",
                "<parent link=\"flange\"/><child link=\"link2\"/>",
                ["`tip_joint` <child>", "`shoulder`", "remove one"],
            ),
            (
                "<parent link=\"flange\"/><child link=\"tip\"/>",
                "<parent link=\"flange\"/>",
                ["`tip_joint`", "none", "add <child>"],
            ),
            (
                "<parent link=\"flange\"/><child link=\"tip\"/>",
                "<parent/><child link=\"tip\"/>",
                ["`tip_joint` <parent>", "none", "add link="],
            ),
            (
                "<link name=\"tip\"/>",
                "<link name=\"tip\"/><link name=\"lost\"/>",
                ["link `lost`", "2 roots: `base`, `lost`", "connect it"],
            ),
            (
                "<parent link=\"base\"/>",
                "<parent link=\"tip\"/>",
                [
                    "link `link1`",
                    "cycle of `link1`, `link2`",
                    "open the cycle",
                ],
            ),
            (
                "<link name=\"tip\"/>",
                "<link name=\"tip\"/><link name=\"a\"/><link name=\"b\"/><joint name=\"ab\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/></joint><joint name=\"ba\" type=\"fixed\"><parent link=\"b\"/><child link=\"a\"/></joint>",
                ["link `a`", "a cycle of `a`, `b`", "open the cycle"],
            ),
        ],
        with_urdf,
    );
    let ring = "<robot name=\"r\"><link name=\"a\"/><joint name=\"j\" type=\"fixed\"><parent link=\"a\"/><child link=\"a\"/></joint></robot>";
    let message = Description::from_text(TOML, ring).unwrap_err().to_string();
    // Names are looked up before the tree is walked.
    assert!(message.contains("finger_joint"), "{message}");
    let toml = "name = \"r\"\nurdf = \"r.urdf\"\ntip_frame = \"a\"\n";
    let message = Description::from_text(toml, ring).unwrap_err().to_string();
    for fragment in [
        "r.urdf",
        "<robot>",
        "a cycle through every link",
        "open the cycle",
    ] {
        assert!(message.contains(fragment), "{message}");
    }
}

#[test]
fn errors_in_joints_are_rejected() {
    let shoulder = "<limit lower=\"-1.5\" upper=\"1.5\" effort=\"40\" velocity=\"2\"/>";
    check(
        "small.urdf",
        &[
            (shoulder, "", ["`shoulder`", "no <limit>", "add <limit"]),
            (
                shoulder,
                "<limit effort=\"40\" velocity=\"2\"/>",
                ["`shoulder`", "without lower or upper", "add <limit"],
            ),
            (
                shoulder,
                "<limit lower=\"1\" upper=\"-1\" effort=\"40\" velocity=\"2\"/>",
                ["`shoulder`", "lower 1, upper -1", "swap"],
            ),
            (
                shoulder,
                "<limit lower=\"-1\" upper=\"nan\" effort=\"40\" velocity=\"2\"/>",
                ["`shoulder` <limit>", "\"nan\"", "correct it"],
            ),
            (
                shoulder,
                "<limit lower=\"-inf\" upper=\"1\" effort=\"40\" velocity=\"2\"/>",
                ["`shoulder` <limit>", "\"-inf\"", "correct it"],
            ),
            (
                shoulder,
                "<limit lower=\"-1\" upper=\"1\" effort=\"40\"/>",
                [
                    "`shoulder` <limit>",
                    "`velocity` is missing",
                    "add velocity",
                ],
            ),
            (
                shoulder,
                "<limit lower=\"-1\" upper=\"1\" effort=\"0\" velocity=\"2\"/>",
                [
                    "`shoulder` <limit effort>",
                    "found 0",
                    "torque_nm in the TOML",
                ],
            ),
            (
                shoulder,
                "<limit lower=\"-1\" upper=\"1\" effort=\"4\" velocity=\"-2\"/>",
                [
                    "`shoulder` <limit velocity>",
                    "found -2",
                    "speed_rad_per_s in the TOML",
                ],
            ),
            (
                shoulder,
                "<limit lower=\"-1\" upper=\"1\" effort=\"4\" velocity=\"2\" min=\"3\"/>",
                ["`shoulder` <limit>", "min=\"3\"", "remove it"],
            ),
            (
                "<axis xyz=\"0 0 2\"/>",
                "<axis xyz=\"0 0 0\"/>",
                ["`yaw` <axis>", "[0.0, 0.0, 0.0]", "give the direction"],
            ),
            (
                "<axis xyz=\"0 0 2\"/>",
                "<axis xyz=\"0 0 z 1\"/>",
                ["`yaw` <axis>", "0 0 z 1", "correct it"],
            ),
            (
                "<axis xyz=\"0 0 2\"/>",
                "<axis xyz=\"0 inf 0\"/>",
                ["`yaw` <axis>", "inf", "correct it"],
            ),
            (
                "<axis xyz=\"0 0 2\"/>",
                "<axes xyz=\"0 0 2\"/>",
                ["`yaw` <axes>", "<axes>", "axis"],
            ),
            (
                "<origin xyz=\"0 0 0.3\" rpy=\"0 0 0\"/>",
                "<origin xyz=\"0 0 NaN\"/>",
                ["`yaw` <origin>", "0 0 NaN", "correct it"],
            ),
            (
                "<origin xyz=\"0 0 0.3\" rpy=\"0 0 0\"/>",
                "<origin pos=\"0 0 1\"/>",
                ["`yaw` <origin>", "pos=\"0 0 1\"", "xyz, rpy"],
            ),
            (
                "<origin xyz=\"0 0 0.3\" rpy=\"0 0 0\"/>",
                "<origin/><origin/>",
                ["`yaw` <origin>", "found 2", "keep one"],
            ),
            (
                "type=\"continuous\"",
                "type=\"prismatic\"",
                ["`yaw`", "prismatic", "fixed"],
            ),
            (
                "type=\"continuous\"",
                "type=\"floating\"",
                ["`yaw`", "floating", "fixed"],
            ),
            (
                "type=\"continuous\"",
                "type=\"planar\"",
                ["`yaw`", "planar", "fixed"],
            ),
            (
                "type=\"continuous\"",
                "type=\"spherical\"",
                ["`yaw`", "spherical", "fixed"],
            ),
            (
                "type=\"continuous\"",
                "type=\"hinge\"",
                ["`yaw`", "`hinge`", "use revolute"],
            ),
            (
                "<axis xyz=\"0 0 2\"/>",
                "<axis xyz=\"0 0 2\"/><mimic joint=\"elbow\"/>",
                ["`yaw` <mimic>", "`elbow`", "remove <mimic>"],
            ),
            (
                "<dynamics damping=\"0.7\" friction=\"0.4\"/>",
                "<dynamics damping=\"-0.7\"/>",
                ["`shoulder` <dynamics>", "found -0.7", "correct it"],
            ),
        ],
        with_urdf,
    );
}

#[test]
fn errors_in_links_are_rejected() {
    let link2 = "<mass value=\"1.5\"/>\n      <inertia ixx=\"0.002\" ixy=\"0\" ixz=\"0\" iyy=\"0.02\" iyz=\"0\" izz=\"0.02\"/>";
    check(
        "small.urdf",
        &[
            (
                "<mass value=\"1.5\"/>",
                "<mass value=\"-1.5\"/>",
                ["`link2` <inertial>", "-1.5 kg", "give inertia"],
            ),
            (
                "<mass value=\"1.5\"/>",
                "<mass value=\"0\"/>",
                ["`link2` <inertial>", "mass 0 kg", "remove <inertial>"],
            ),
            (
                "<mass value=\"1.5\"/>",
                "<mass value=\"nan\"/>",
                ["`link2` <mass>", "\"nan\"", "correct it"],
            ),
            (
                "<mass value=\"1.5\"/>",
                "<mass/>",
                ["`link2` <mass>", "`value` is missing", "add value"],
            ),
            (
                "<mass value=\"1.5\"/>",
                "",
                ["`link2` <inertial>", "<mass> is missing", "add <mass>"],
            ),
            (
                "ixx=\"0.002\"",
                "ixx=\"0.2\"",
                ["`link2` <inertial>", "0.2", "give inertia"],
            ),
            (
                "ixx=\"0.002\"",
                "ixx=\"-0.002\"",
                ["`link2` <inertial>", "-0.002", "give inertia"],
            ),
            (
                "ixx=\"0.002\"",
                "",
                ["`link2` <inertia>", "`ixx` is missing", "add ixx"],
            ),
            (
                "<origin xyz=\"0.2 0 0\" rpy=\"0 0 0\"/>",
                "<orgin xyz=\"0.2 0 0\"/>",
                ["`link2` <orgin>", "<orgin>", "origin"],
            ),
            (
                "<origin xyz=\"0.2 0 0\" rpy=\"0 0 0\"/>",
                "<origin xyz=\"0.2 0\"/>",
                ["`link2` <origin>", "\"0.2 0\"", "correct it"],
            ),
            (
                link2,
                "<mass value=\"0\"/><inertia ixx=\"0\" ixy=\"0\" ixz=\"0\" iyy=\"0\" iyz=\"0\" izz=\"0\"/>",
                ["link `link2`", "found none", "fix joint `shoulder`"],
            ),
            // A fixed branch must be physically consistent as well.
            (
                "<mass value=\"0.3\"/>",
                "<mass value=\"-0.3\"/>",
                ["`flange` <inertial>", "-0.3 kg", "give inertia"],
            ),
        ],
        with_urdf,
    );
}

#[test]
fn a_root_element_other_than_robot_is_rejected() {
    let message = Description::from_text(TOML, "<sdf/>")
        .unwrap_err()
        .to_string();
    for fragment in ["small.urdf", "<sdf> (line 1)", "expanded first"] {
        assert!(message.contains(fragment), "{message}");
    }
}
