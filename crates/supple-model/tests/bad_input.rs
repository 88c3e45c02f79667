//! What is refused, and that each message names file, element, value and remedy.

mod common;

use common::{TOML, URDF, with, with_toml, with_urdf};
use supple_model::{Description, ModelError};

/// What is changed, to what, and what the message must hold: element, value, remedy.
type Case = (&'static str, &'static str, [&'static str; 3]);

fn check(file: &str, cases: &[Case], load: fn(&str, &str) -> Result<Description, ModelError>) {
    for (from, to, fragments) in cases {
        let error = load(from, to).err();
        let message = error
            .unwrap_or_else(|| panic!("accepted: {to}"))
            .to_string();
        assert!(message.contains(file), "no file name in: {message}");
        for fragment in fragments {
            assert!(message.contains(fragment), "no `{fragment}` in: {message}");
        }
    }
}

#[test]
fn the_unchanged_texts_are_accepted() {
    Description::from_text(TOML, URDF).unwrap();
}

#[test]
fn broken_structure_of_a_urdf() {
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
fn broken_joints_of_a_urdf() {
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
fn broken_links_of_a_urdf() {
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
            // A branch that does not move is no less physical.
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
fn broken_toml() {
    check(
        "arm.toml",
        &[
            (
                "[law]",
                "[law]\nstifness = 3",
                ["line", "stifness", "stiffness_n_per_m"],
            ),
            ("[latch]\n", "[lach]\n", ["line", "lach", "latch"]),
            ("[law]", "[law", ["line 30", "[law", "arm.schema.json"]),
            (
                "tip_frame = \"tip\"\n",
                "",
                ["line", "tip_frame", "arm.schema.json"],
            ),
            (
                "soft_zone_rad = 0.2",
                "soft_zone_rad = \"wide\"",
                ["line", "wide", "arm.schema.json"],
            ),
            (
                "coulomb_nm = 0.2",
                "coulomb = 0.2",
                ["line 12, column 42", "coulomb", "coulomb_nm"],
            ),
            (
                "cap_radius_m = 0.02",
                "cap_radius_m = 0.02\ncap = 1",
                ["line", "cap", "cap_radius_m"],
            ),
            ("held = {", "hold = {", ["line", "hold", "held"]),
            (
                "damping_nm_s_per_rad = 3.0 }",
                "damping_nm_s_per_rad = 3.0, ki = 1.0 }",
                ["line", "ki", "damping_nm_s_per_rad"],
            ),
            (
                "tip_frame = \"tip\"",
                "tip_frame = \"hand\"",
                ["tip_frame", "`hand`", "use one of base"],
            ),
            (
                "finger_joint = 0.3",
                "thumb_joint = 0.3",
                [
                    "[fixed_joints_rad] thumb_joint",
                    "`thumb_joint`",
                    "use one of yaw",
                ],
            ),
            (
                "finger_joint = 0.3",
                "flange_joint = 0.3",
                [
                    "[fixed_joints_rad] flange_joint",
                    "`flange_joint`",
                    "use one of yaw",
                ],
            ),
            (
                "finger_joint = 0.3",
                "finger_joint = 0.6",
                [
                    "[fixed_joints_rad] finger_joint",
                    "0.6 rad",
                    "from -0.5 to 0.5",
                ],
            ),
            (
                "finger_joint = 0.3",
                "finger_joint = nan",
                ["[fixed_joints_rad] finger_joint", "NaN", "finite"],
            ),
            (
                "finger_joint = 0.3",
                "elbow = 0.3",
                ["[[joints]] `elbow`", "[fixed_joints_rad]", "remove one"],
            ),
            (
                "name = \"elbow\"",
                "name = \"knee\"",
                [
                    "[[joints]] `knee`",
                    "`knee`",
                    "use one of yaw, shoulder, elbow",
                ],
            ),
            (
                "[motors]",
                "[[joints]]\nname = \"elbow\"\n[motors]",
                ["[[joints]] `elbow`", "two", "merge"],
            ),
            (
                "home_rad = [0.0, 0.5, 0.2]",
                "home_rad = [0.0, 0.5]",
                ["home_rad", "2 entries", "count"],
            ),
            (
                "home_rad = [0.0, 0.5, 0.2]",
                "home_rad = [0.0, 1.6, 0.2]",
                [
                    "home_rad of joint `shoulder`",
                    "1.6 rad",
                    "from -1.5 to 1.5",
                ],
            ),
            (
                "home_rad = [0.0, 0.5, 0.2]",
                "home_rad = [nan, 0.5, 0.2]",
                ["home_rad of joint `yaw`", "NaN rad", "give an angle"],
            ),
            (
                "position_rad = 0.2",
                "position_rad = 2.6",
                ["`elbow` held.position_rad", "2.6 rad", "from -2.5 to 2.5"],
            ),
            (
                "stiffness_nm_per_rad = 100.0",
                "stiffness_nm_per_rad = 0.0",
                ["`elbow` held.stiffness_nm_per_rad", "found 0", "above zero"],
            ),
            (
                "damping_nm_s_per_rad = 3.0",
                "damping_nm_s_per_rad = -3.0",
                [
                    "`elbow` held.damping_nm_s_per_rad",
                    "found -3",
                    "not negative",
                ],
            ),
            (
                "coulomb_nm = 0.2",
                "coulomb_nm = -0.2",
                ["`elbow` friction coulomb_nm", "found -0.2", "correct it"],
            ),
            (
                "coulomb_nm = 0.2",
                "coulomb_nm = 0.2, breakaway_nm = 0.1",
                ["`elbow` friction breakaway_nm", "found 0.1", "correct it"],
            ),
            (
                "coulomb_nm = 0.2",
                "coulomb_nm = 0.2, band_rad_per_s = 0.0",
                ["`elbow` friction band_rad_per_s", "found 0", "correct it"],
            ),
            (
                "torque_nm = 15.0",
                "torque_nm = -15.0",
                ["`elbow` torque_nm", "found -15", "above zero"],
            ),
            (
                "torque_nm = 15.0",
                "speed_rad_per_s = inf",
                ["`elbow` speed_rad_per_s", "found inf", "finite"],
            ),
            (
                "torque_nm = 15.0",
                "armature_kg_m2 = -1.0",
                ["`elbow` armature_kg_m2", "found -1", "not negative"],
            ),
            (
                "torque_nm = 15.0",
                "torque_rate_nm_per_s = 0.0",
                ["`elbow` torque_rate_nm_per_s", "found 0", "above zero"],
            ),
            (
                "torque_nm = 15.0",
                "move_stiffness_nm_per_rad = nan",
                [
                    "`elbow` move_stiffness_nm_per_rad",
                    "found NaN",
                    "above zero",
                ],
            ),
            (
                "torque_nm = 15.0",
                "position_lower_rad = -2.6",
                ["`elbow` position_lower_rad", "-2.6 rad", "from -2.5 to 2.5"],
            ),
            (
                "torque_nm = 15.0",
                "position_upper_rad = -2.2",
                ["joint `elbow`", "-2.5 to -2.2 rad", "widen"],
            ),
            (
                "[[0.1, 0.0, 0.0], ",
                "[",
                ["[motors] joint_from_motor", "2 entries", "count"],
            ),
            (
                "[0.1, 0.0, 0.0]",
                "[0.1, 0.0]",
                ["joint_from_motor[0]", "2 entries", "count"],
            ),
            (
                "[0.1, 0.0, 0.0]",
                "[nan, 0.0, 0.0]",
                ["joint_from_motor[0][0]", "NaN", "finite"],
            ),
            (
                "[0.0, 0.05, -0.05]",
                "[0.0, 0.1, 0.1]",
                ["[motors] joint_from_motor", "0.1, 0.1", "correct it"],
            ),
            (
                "torque_nm = [5.0, 2.0, 2.0]",
                "torque_nm = [5.0, 2.0]",
                ["[motors] torque_nm", "2 entries", "count"],
            ),
            (
                "torque_nm = [5.0, 2.0, 2.0]",
                "torque_nm = [5.0, 0.0, 2.0]",
                ["[motors] torque_nm[1]", "found 0", "above zero"],
            ),
            (
                "[0.001, 0.001, 0.002]",
                "[0.001, -0.001, 0.002]",
                ["torque_quantum_nm[1]", "found -0.001", "above zero"],
            ),
            (
                "counts_per_revolution = 4096",
                "counts_per_revolution = 0",
                ["[motors] counts_per_revolution", "found 0", "leave it out"],
            ),
            (
                "mass_kg = 0.2",
                "mass_kg = -0.2",
                ["[tool]", "-0.2 kg", "give inertia"],
            ),
            (
                "mass_kg = 0.2\n",
                "",
                ["[tool] mass_kg", "none", "add mass_kg"],
            ),
            ("1.5e-4", "3e-4", ["[tool]", "0.0003", "give inertia"]),
            (
                "cap_radius_m = 0.02",
                "cap_radius_m = 0.0",
                ["[tool] cap_radius_m", "found 0", "above zero"],
            ),
            (
                "soft_zone_rad = 0.2",
                "soft_zone_rad = -0.2",
                ["[limits] soft_zone_rad", "found -0.2", "above zero"],
            ),
            (
                "soft_zone_rad = 0.2",
                "tip_speed_m_per_s = inf",
                ["[limits] tip_speed_m_per_s", "found inf", "finite"],
            ),
            (
                "soft_zone_rad = 0.2",
                "greatest_stiffness_n_per_m = 6.5",
                ["[law] stiffness_n_per_m[2]", "found 7", "lower it"],
            ),
            (
                "[5.0, 6.0, 7.0]",
                "[5.0, -6.0, 7.0]",
                ["[law] stiffness_n_per_m[1]", "found -6", "not negative"],
            ),
            (
                "[5.0, 6.0, 7.0]",
                "[5.0, 6.0, 7.0]\napparent_inertia_kg = [[1.0, 0.0, 0.0], [0.1, 1.0, 0.0], [0.0, 0.0, 1.0]]",
                ["[law] apparent_inertia_kg", "0.1", "symmetric"],
            ),
            (
                "[5.0, 6.0, 7.0]",
                "[5.0, 6.0, 7.0]\napparent_inertia_kg = [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]",
                ["[law] apparent_inertia_kg", "-1.0", "leave it out"],
            ),
            (
                "threshold_n = 2.0",
                "contact_share = 1.5",
                ["[latch] contact_share", "found 1.5", "give the part"],
            ),
            (
                "threshold_n = 2.0",
                "friction_error = -0.1",
                ["[latch] friction_error", "found -0.1", "not negative"],
            ),
            (
                "threshold_n = 2.0",
                "threshold_n = 0.0",
                ["[latch] threshold_n", "found 0", "above zero"],
            ),
            (
                "threshold_n = 2.0",
                "reversal_s = -1.0",
                ["[latch] reversal_s", "found -1", "not negative"],
            ),
            (
                "home_rad = [0.0, 0.5, 0.2]",
                "gravity_m_per_s2 = [0.0, nan, -9.81]",
                ["gravity_m_per_s2[1]", "found NaN", "finite"],
            ),
            (
                "home_rad = [0.0, 0.5, 0.2]",
                "period_s = 0.0",
                ["period_s", "found 0", "above zero"],
            ),
        ],
        with_toml,
    );
}

#[test]
fn a_branch_that_moves_must_be_fixed() {
    let message = with_toml("finger_joint = 0.3", "").unwrap_err().to_string();
    for fragment in [
        "small.urdf",
        "joint `finger_joint`",
        "revolute",
        "[fixed_joints_rad]",
    ] {
        assert!(message.contains(fragment), "{message}");
    }
    let sliding = with(
        URDF,
        "<joint name=\"finger_joint\" type=\"revolute\">",
        "<joint name=\"finger_joint\" type=\"prismatic\">",
    );
    let message = Description::from_text(TOML, &sliding)
        .unwrap_err()
        .to_string();
    for fragment in [
        "small.urdf",
        "joint `finger_joint`",
        "prismatic",
        "change its type to fixed",
    ] {
        assert!(message.contains(fragment), "{message}");
    }
}

#[test]
fn a_urdf_in_the_place_of_a_toml() {
    let message = Description::from_text(URDF, URDF).unwrap_err().to_string();
    for fragment in ["arm.toml", "XML", "name, urdf"] {
        assert!(message.contains(fragment), "{message}");
    }
}

#[test]
fn numbers_that_would_overflow() {
    check(
        "small.urdf",
        &[
            (
                "<mass value=\"1.5\"/>",
                "<mass value=\"1e300\"/>",
                ["`link2` <mass>", "1e300", "SI units"],
            ),
            (
                "<origin xyz=\"0 0 0.3\" rpy=\"0 0 0\"/>",
                "<origin xyz=\"0 -1e200 0\"/>",
                ["`yaw` <origin>", "-1e200", "SI units"],
            ),
        ],
        with_urdf,
    );
    check(
        "arm.toml",
        &[
            (
                "mass_kg = 0.2",
                "mass_kg = 1e200",
                ["[tool]", "mass 1000", "SI units"],
            ),
            (
                "com_m = [0.0, 0.0, -0.01]",
                "com_m = [0.0, 0.0, -1e200]",
                ["[tool]", "-1e200", "SI units"],
            ),
        ],
        with_toml,
    );
}

#[test]
fn a_root_that_is_not_a_robot() {
    let message = Description::from_text(TOML, "<sdf/>")
        .unwrap_err()
        .to_string();
    for fragment in ["small.urdf", "<sdf> (line 1)", "expanded first"] {
        assert!(message.contains(fragment), "{message}");
    }
}

#[test]
fn files_that_are_not_there() {
    let message = Description::find("nowhere/arm.toml")
        .unwrap_err()
        .to_string();
    for fragment in ["nowhere/arm.toml", "cannot be read", "give the TOML"] {
        assert!(message.contains(fragment), "{message}");
    }
    let message = Description::load("/nowhere/arm.toml")
        .unwrap_err()
        .to_string();
    for fragment in ["/nowhere/arm.toml", "cannot be read", "give the TOML"] {
        assert!(message.contains(fragment), "{message}");
    }
    let folder = std::env::temp_dir().join(format!("supple-model-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("arm.toml"), TOML).unwrap();
    let message = Description::load(&folder).unwrap_err().to_string();
    for fragment in ["small.urdf", "cannot be read", "correct `urdf`"] {
        assert!(message.contains(fragment), "{message}");
    }
    std::fs::write(folder.join("small.urdf"), URDF).unwrap();
    let loaded = Description::load(&folder).unwrap();
    assert_eq!((loaded.toml(), loaded.urdf()), (TOML, URDF));
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn an_unknown_asset_names_the_known_ones() {
    assert_eq!(Description::find("wam3").unwrap().name(), "wam3");
    let message = Description::find("wam5").unwrap_err().to_string();
    assert!(
        message.contains("`wam5`") && message.contains("paper3, wam3, wam4, wam7"),
        "{message}"
    );
}

#[test]
fn the_wrong_number_of_joints_names_both() {
    let message = Description::asset("wam4")
        .unwrap()
        .config::<7>()
        .unwrap_err()
        .to_string();
    for fragment in [
        "assets/wam4/arm.toml",
        "`wam4`",
        "4 moving joints",
        "expects 7",
    ] {
        assert!(message.contains(fragment), "{message}");
    }
    let two = supple_model::with_dof!(2, N => N).unwrap_err().to_string();
    for fragment in ["2 moving joints", "3 to 7", "[fixed_joints_rad]"] {
        assert!(two.contains(fragment), "{two}");
    }
    for dof in 3..=7 {
        assert_eq!(supple_model::with_dof!(dof, N => N).unwrap(), dof);
    }
}

#[test]
fn what_a_controller_would_refuse_names_the_file() {
    let description = Description::from_text(TOML, URDF).unwrap();
    let message = description.config::<3>().unwrap_err().to_string();
    for fragment in [
        "arm.toml",
        "active joints",
        "found 2",
        "at least 3",
        "correct it",
    ] {
        assert!(message.contains(fragment), "{message}");
    }
}
