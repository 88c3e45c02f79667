//! Errors in a TOML, by itself or in combination with its URDF.

use super::check;
use crate::common::{TOML, URDF, with, with_toml};
use supple_model::Description;

#[test]
fn errors_in_a_toml_are_rejected() {
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
                [
                    "home_rad",
                    "2 entries",
                    "list one value for each joint that moves",
                ],
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
                ["[motors] joint_from_motor", "2 entries", "list one value"],
            ),
            (
                "[0.1, 0.0, 0.0]",
                "[0.1, 0.0]",
                ["joint_from_motor[0]", "2 entries", "list one value"],
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
                ["[motors] torque_nm", "2 entries", "list one value"],
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
                "max_stiffness_n_per_m = 6.5",
                ["[law] stiffness_n_per_m[2]", "found 7", "lower it"],
            ),
            // The earlier name of the same key.
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
                "gravity_m_per_s2 = [0.0, 0.0, -981.0]",
                ["gravity_m_per_s2[2]", "found -981", "from -30 to 30 m/s^2"],
            ),
            (
                "home_rad = [0.0, 0.5, 0.2]",
                "period_s = 10.0",
                ["period_s", "found 10", "from 0.0001 to 0.1 s"],
            ),
            (
                "home_rad = [0.0, 0.5, 0.2]",
                "period_s = 1e-9",
                ["period_s", "found 0.000000001", "from 0.0001 to 0.1 s"],
            ),
            (
                "home_rad = [0.0, 0.5, 0.2]",
                "point_mass_radius_m = 1e300",
                ["point_mass_radius_m", "found 1", "0.000001 to 10 m"],
            ),
            (
                "home_rad = [0.0, 0.5, 0.2]",
                "home_rad = [0.0, 1.45, 0.2]",
                [
                    "home_rad of joint `shoulder`",
                    "1.45 rad",
                    "from -1.3 to 1.3 rad, or make [limits] soft_zone_rad",
                ],
            ),
            (
                "cap_radius_m = 0.02",
                "cap_radius_m = 1e300",
                ["[tool] cap_radius_m", "found 1", "from 0.000001 to 1 m"],
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

/// A branch beside the chain is frozen with a warning, for any type of its joint; the chain to the tip is not frozen.
#[test]
fn a_movable_branch_is_frozen_with_a_warning() {
    let free = with_toml("finger_joint = 0.3", "").expect("frozen");
    let sliding = with(
        URDF,
        "<joint name=\"finger_joint\" type=\"revolute\">",
        "<joint name=\"finger_joint\" type=\"prismatic\">",
    );
    let sliding = Description::from_text(&with(TOML, "finger_joint = 0.3", ""), &sliding);
    for arm in [free, sliding.expect("frozen")] {
        let lines: Vec<String> = arm.warnings().iter().map(ToString::to_string).collect();
        assert_eq!(lines.len(), 1, "{lines:?}");
        for fragment in [
            "small.urdf",
            "joint `finger_joint`",
            "frozen",
            "at 0",
            "[fixed_joints_rad]",
        ] {
            assert!(lines[0].contains(fragment), "{lines:?}");
        }
        assert_eq!(arm.joint_names(), ["yaw", "shoulder", "elbow"]);
        assert!(arm.strict().is_err());
    }
}

#[test]
fn a_urdf_instead_of_a_toml_is_rejected() {
    let message = Description::from_text(URDF, URDF).unwrap_err().to_string();
    for fragment in ["arm.toml", "XML", "FILE.urdf"] {
        assert!(message.contains(fragment), "{message}");
    }
}
