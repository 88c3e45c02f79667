//! Result of reading a valid URDF and TOML: chain, lumping, defaults, shapes, transforms.

use crate::common::{TOML, URDF, with, with_urdf};
use std::f64::consts::TAU;
use supple_core::config::{ApparentInertia, FrictionVelocity, Role};
use supple_core::math::Vector3;
use supple_core::{Friction, Vector, dynamics};
use supple_model::Description;

/// The TOML with the elbow controlled by the law, which needs three joints.
fn free() -> String {
    let start = TOML.find("held = ").unwrap();
    let end = start + TOML[start..].find('\n').unwrap();
    format!("{}{}", &TOML[..start], &TOML[end..])
}

fn small() -> Description {
    Description::from_text(&free(), URDF).unwrap()
}

#[test]
fn a_mass_without_inertia_becomes_a_ball_if_requested() {
    let start = URDF.find("<inertia ").unwrap();
    let end = start + URDF[start..].find("/>").unwrap() + 2;
    let zeros = r#"<inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/>"#;
    let urdf = URDF.replacen(&URDF[start..end], zeros, 1);
    let error = Description::from_text(&free(), &urdf).unwrap_err();
    assert!(error.to_string().contains("point_mass_radius_m"), "{error}");
    let said = |radius: &str| {
        Description::from_text(
            &format!("point_mass_radius_m = {radius}\n{}", free()),
            &urdf,
        )
    };
    let radius_m = 0.05;
    let (ball, whole) = (said("0.05").unwrap(), small());
    let (ball, whole) = (ball.arm::<3>().unwrap(), whole.arm::<3>().unwrap());
    let differs: Vec<usize> = (0..3).filter(|i| ball.body(*i) != whole.body(*i)).collect();
    let [link] = differs[..] else {
        panic!("links {differs:?} differ");
    };
    let (found, mass_kg) = (ball.body(link), whole.body(link).mass_kg);
    assert_eq!(found.mass_kg, mass_kg);
    assert_eq!(found.com_m, whole.body(link).com_m);
    let expected = 0.4 * mass_kg * radius_m * radius_m;
    for i in 0..3 {
        assert!((found.inertia_kg_m2[(i, i)] - expected).abs() < 1e-12 * mass_kg);
    }
    let error = said("-1.0").unwrap_err();
    assert!(error.to_string().contains("above zero"), "{error}");
}

#[test]
fn the_chain_consists_of_the_movable_joints_to_the_tip() {
    let description = small();
    assert_eq!(description.joint_names(), ["yaw", "shoulder", "elbow"]);
    assert_eq!(description.dof(), 3);
    let arm = description.arm::<3>().unwrap();
    let tip = dynamics::tip_pose(&arm, &Vector::zeros()).translation;
    let (s, c) = 1.2_f64.sin_cos();
    let expected = Vector3::new(0.4 + 0.25 + 0.05 * s, 0.0, 0.5 + 0.05 * c);
    assert!((tip - expected).amax() < 1e-12, "{tip}");
}

/// The finger is fixed at 0.3 rad in one description and is the fourth moving joint in another: at that angle, the
/// torques of the first three joints must be the same.
#[test]
fn a_joint_fixed_at_an_angle_equals_a_moving_joint_at_that_angle() {
    let bare = |text: &str| {
        let start = text.find("[tool]").unwrap();
        let end = text.find("[limits]").unwrap();
        format!("{}{}", &text[..start], &text[end..])
    };
    let fixed = Description::from_text(&bare(TOML), URDF)
        .unwrap()
        .arm::<3>()
        .unwrap();
    let toml = "name = \"four\"\nurdf = \"small.urdf\"\ntip_frame = \"finger\"\n";
    let moving = Description::from_text(toml, URDF).unwrap();
    assert_eq!(moving.joint_names()[3], "finger_joint");
    let moving = moving.arm::<4>().unwrap();
    for (q, qd) in [
        ([0.3, 0.5, -0.7], [0.0; 3]),
        ([-1.0, 1.2, 0.4], [0.7, -0.4, 1.1]),
    ] {
        let (q3, qd3) = (Vector::<3>::from(q), Vector::<3>::from(qd));
        let q4 = Vector::<4>::new(q[0], q[1], q[2], 0.3);
        let qd4 = Vector::<4>::new(qd[0], qd[1], qd[2], 0.0);
        let mass = dynamics::crba(&moving, &q4)
            .fixed_view::<3, 3>(0, 0)
            .into_owned();
        assert!((dynamics::crba(&fixed, &q3) - mass).amax() < 1e-13);
        let torque = dynamics::rnea(&moving, &q4, &qd4, &Vector::zeros());
        let expected = dynamics::rnea(&fixed, &q3, &qd3, &Vector::zeros());
        assert!((expected - torque.fixed_rows::<3>(0)).amax() < 1e-13);
    }
}

#[test]
fn an_axis_is_scaled_to_unit_length() {
    let scaled = with_urdf("<axis xyz=\"0 0 2\"/>", "<axis xyz=\"0 0 1\"/>").unwrap();
    assert_eq!(scaled.parts::<3>().unwrap(), small().parts::<3>().unwrap());
}

#[test]
fn limits_come_from_both_files() {
    let limits = small().config::<3>().unwrap().limits;
    // A continuous joint has two turns; the other limits come from the URDF.
    assert_eq!(
        limits.position_lower_rad,
        Vector::<3>::new(-TAU, -1.5, -2.5)
    );
    assert_eq!(limits.position_upper_rad, Vector::<3>::new(TAU, 1.5, 2.5));
    assert_eq!(
        limits.joint_speed_rad_per_s,
        Vector::<3>::new(3.0, 2.0, 2.0)
    );
    assert_eq!(limits.joint_torque_nm, Vector::<3>::new(50.0, 40.0, 15.0));
    let narrow = with(
        &free(),
        "torque_nm = 15.0",
        "position_lower_rad = -1.0\nposition_upper_rad = 1.0",
    );
    let limits = Description::from_text(&narrow, URDF)
        .unwrap()
        .config::<3>()
        .unwrap()
        .limits;
    assert_eq!(
        (limits.position_lower_rad[2], limits.position_upper_rad[2]),
        (-1.0, 1.0)
    );
}

#[test]
fn the_toml_sets_the_range_of_a_continuous_joint() {
    let wide = with(
        &free(),
        "[motors]",
        "[[joints]]\nname = \"yaw\"\nposition_lower_rad = -20.0\nposition_upper_rad = 20.0\n[motors]",
    );
    let limits = Description::from_text(&wide, URDF)
        .unwrap()
        .config::<3>()
        .unwrap()
        .limits;
    assert_eq!(
        (limits.position_lower_rad[0], limits.position_upper_rad[0]),
        (-20.0, 20.0)
    );
}

#[test]
fn friction_comes_from_the_toml_or_the_urdf_or_is_zero() {
    let elbow = Friction::coulomb(0.5, 0.2);
    assert_eq!(
        small().friction(),
        [Friction::NONE, Friction::coulomb(0.7, 0.4), elbow]
    );
    let dip = with(
        TOML,
        "coulomb_nm = 0.2",
        "coulomb_nm = 0.2, breakaway_nm = 0.3, stribeck_rad_per_s = 0.1, offset_nm = -0.1, band_rad_per_s = 0.02",
    );
    let found = Description::from_text(&dip, URDF).unwrap().friction()[2];
    let expected = Friction {
        breakaway_nm: 0.3,
        stribeck_rad_per_s: 0.1,
        offset_nm: -0.1,
        band_rad_per_s: 0.02,
        ..elbow
    };
    assert_eq!(found, expected);
}

#[test]
fn all_settings_of_the_toml_are_used() {
    let config = small().config::<3>().unwrap();
    assert_eq!(config.roles, [Role::Active; 3]);
    assert_eq!(
        config.law.gains.stiffness_n_per_m,
        Vector3::new(5.0, 6.0, 7.0)
    );
    assert_eq!(config.law.inertia, ApparentInertia::Own);
    assert_eq!(config.law.friction_velocity, FrictionVelocity::Reference);
    assert_eq!(config.latch.threshold_n, 2.0);
    assert_eq!(config.limits.soft_zone_rad, 0.2);
    assert_eq!(
        config.limits.motor_torque_nm,
        Vector::<3>::new(5.0, 2.0, 2.0)
    );
    assert_eq!(config.joint_from_motor[(1, 2)], -0.05);
    assert_eq!(config.arm.gravity(), Vector3::new(0.0, 0.0, -9.81));
    let description = small();
    assert_eq!(description.motors().counts_per_revolution, Some(4096));
    assert_eq!(
        description.motors().torque_quantum_nm,
        Some(vec![0.001, 0.001, 0.002])
    );
    assert_eq!(
        description.home::<3>().unwrap(),
        Vector::<3>::new(0.0, 0.5, 0.2)
    );
}

#[test]
fn all_settings_of_the_law_are_used() {
    let toml = with(
        &free(),
        "stiffness_n_per_m = [5.0, 6.0, 7.0]",
        "apparent_inertia_kg = [[2.0, 0.1, 0.0], [0.1, 3.0, 0.0], [0.0, 0.0, 4.0]]\n\
         friction_velocity = \"measured\"\ninertial_feedforward = false",
    );
    let law = Description::from_text(&toml, URDF)
        .unwrap()
        .config::<3>()
        .unwrap()
        .law;
    let ApparentInertia::Chosen(mass) = law.inertia else {
        panic!("{:?}", law.inertia);
    };
    assert_eq!((mass[(0, 1)], mass[(1, 1)]), (0.1, 3.0));
    assert_eq!(law.friction_velocity, FrictionVelocity::Measured);
    assert!(!law.inertial_feedforward);
}

#[test]
fn a_held_joint_has_its_role_if_three_others_remain() {
    let toml = with(TOML, "tip_frame = \"tip\"", "tip_frame = \"finger\"");
    let toml = with(&toml, "home_rad = [0.0, 0.5, 0.2]\n", "");
    let toml = with(&toml, "finger_joint = 0.3\n", "");
    // The finger and its part of the elbow's motion are light.
    let toml = with(
        &toml,
        "damping_nm_s_per_rad = 3.0 }",
        "damping_nm_s_per_rad = 0.03 }",
    );
    let (start, end) = (toml.find("[motors]").unwrap(), toml.find("[tool]").unwrap());
    let finger = "[[joints]]\nname = \"finger_joint\"\nhold_damping_nm_s_per_rad = 0.001\n";
    let toml = format!("{}{finger}{}", &toml[..start], &toml[end..]);
    let config = Description::from_text(&toml, URDF)
        .unwrap()
        .config::<4>()
        .unwrap();
    let held = Role::Held {
        position_rad: 0.2,
        stiffness_nm_per_rad: 100.0,
        damping_nm_s_per_rad: 0.03,
    };
    assert_eq!(
        config.roles,
        [Role::Active, Role::Active, held, Role::Active]
    );
}

/// A TOML with three keys is valid.
#[test]
fn everything_else_has_a_default() {
    let urdf = with(
        URDF,
        "name=\"finger_joint\" type=\"revolute\"",
        "name=\"finger_joint\" type=\"fixed\"",
    );
    let toml = "name = \"bare\"\nurdf = \"small.urdf\"\ntip_frame = \"tip\"\n";
    let description = Description::from_text(toml, &urdf).unwrap();
    let config = description.config::<3>().unwrap();
    assert!(config.roles.iter().all(|role| *role == Role::Active));
    assert_eq!(config.limits.motor_torque_nm, config.limits.joint_torque_nm);
    assert_eq!(config.joint_from_motor, nalgebra::Matrix3::identity());
    assert_eq!(description.tool(), None);
    assert_eq!(description.home_rad(), [0.0, 0.0, 0.0]);
    assert_eq!(description.motors().counts_per_revolution, None);
    supple_core::Controller::new(config).unwrap();
}

#[test]
fn a_held_joint_starts_at_its_held_angle() {
    let toml = with(TOML, "home_rad = [0.0, 0.5, 0.2]\n", "");
    let description = Description::from_text(&toml, URDF).unwrap();
    assert_eq!(description.home_rad(), [0.0, 0.0, 0.2]);
}

#[test]
fn transforms_compose_to_the_tip() {
    let description = small();
    let q = [0.4, -0.3, 0.9];
    let transforms = description.transforms(&q).unwrap();
    let mut base_from_tip = supple_core::Pose::IDENTITY;
    let mut link = "tip";
    while let Some(transform) = transforms.iter().find(|t| t.child == link) {
        base_from_tip = transform.parent_from_child * base_from_tip;
        link = transform.parent;
    }
    assert_eq!(link, "base");
    let arm = description.arm::<3>().unwrap();
    let tip = dynamics::tip_pose(&arm, &Vector::<3>::from(q));
    assert!((tip.translation - base_from_tip.translation).amax() < 1e-12);
    assert!((tip.rotation - base_from_tip.rotation).amax() < 1e-12);
    let finger = transforms.iter().find(|t| t.child == "finger").unwrap();
    let turned = supple_core::Pose::from_xyz_rpy([0.0, 0.02, 0.03], [0.0, 0.0, 0.4])
        * supple_core::Pose::from_xyz_rpy([0.0; 3], [0.0, 0.3, 0.0]);
    assert!((finger.parent_from_child.rotation - turned.rotation).amax() < 1e-12);
    let message = description.transforms(&q[..2]).unwrap_err().to_string();
    assert!(
        message.contains("3 moving joints, the caller expects 2"),
        "{message}"
    );
}

#[test]
fn shapes_are_the_visuals_in_the_frame_of_their_moving_link() {
    let urdf = with(
        URDF,
        "<link name=\"tip\"/>",
        "<link name=\"tip\"><visual><geometry><sphere radius=\"0.02\"/></geometry></visual>\
         <visual><geometry><box size=\"1 1 1\"/></geometry></visual></link>",
    );
    let urdf = with(
        &urdf,
        "<link name=\"base\"/>",
        "<link name=\"base\"><visual><origin xyz=\"0 0 0.1\"/><geometry><cylinder radius=\"0.05\" \
         length=\"0.2\"/></geometry></visual></link>",
    );
    let description = Description::from_text(TOML, &urdf).unwrap();
    let [base, tip] = description.capsules() else {
        panic!("{:?}", description.capsules());
    };
    assert_eq!((base.joint, base.radius_m), (None, 0.05));
    assert!((base.ends_m[1] - Vector3::new(0.0, 0.0, 0.2)).amax() < 1e-15);
    assert_eq!((tip.joint, tip.radius_m), (Some(2), 0.02));
    let at = description
        .parts::<3>()
        .unwrap()
        .last_link_from_tip
        .translation;
    assert_eq!(tip.ends_m, [at, at]);
}

/// Extensions of other programs in a URDF are accepted.
#[test]
fn extensions_and_decoration_are_accepted() {
    let urdf = with(
        URDF,
        "<robot name=\"small\">",
        "<robot name=\"small\" version=\"1.0\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\">\
         <material name=\"grey\"><color rgba=\"0.5 0.5 0.5 1\"/></material>\
         <transmission name=\"t\"><type>simple</type><joint name=\"yaw\"/><actuator name=\"m\"/></transmission>\
         <gazebo reference=\"link1\"><mu1>0.2</mu1></gazebo>\
         <ros2_control name=\"r\" type=\"system\"><joint name=\"elbow\"/></ros2_control>",
    );
    let urdf = with(
        &urdf,
        "<link name=\"tip\"/>",
        "<link name=\"tip\"><visual name=\"v\"><origin xyz=\"0 0 0\"/><geometry><mesh filename=\"a.stl\" \
         scale=\"1 1 1\"/></geometry><material name=\"grey\"/></visual><collision><geometry><box \
         size=\"1 1 1\"/></geometry></collision></link>",
    );
    let urdf = with(
        &urdf,
        "<axis xyz=\"0 0 2\"/>",
        "<axis xyz=\"0 0 2\"/><calibration rising=\"0.1\"/><safety_controller k_velocity=\"10\" \
         k_position=\"20\" soft_lower_limit=\"-1\" soft_upper_limit=\"1\"/>",
    );
    let decorated = Description::from_text(TOML, &urdf).unwrap();
    assert_eq!(
        decorated.parts::<3>().unwrap(),
        small().parts::<3>().unwrap()
    );
}

/// With the delay of the loop, this damping makes the finger unstable, because its inertia is small.
#[test]
fn damping_that_is_unstable_with_the_delay_is_refused_with_its_joint() {
    let toml = with(&free(), "tip_frame = \"tip\"", "tip_frame = \"finger\"");
    let toml = with(&toml, "home_rad = [0.0, 0.5, 0.2]\n", "");
    let toml = with(&toml, "finger_joint = 0.3\n", "");
    let (start, end) = (toml.find("[motors]").unwrap(), toml.find("[tool]").unwrap());
    let refusal = |entry: &str| {
        // Without this entry a rotor inertia is estimated, which increases the finger's inertia.
        let rotor = "armature_kg_m2 = 0.0";
        let finger = format!("[[joints]]\nname = \"finger_joint\"\n{rotor}\n{entry}\n");
        let toml = format!("{}{finger}{}", &toml[..start], &toml[end..]);
        let description = Description::from_text(&toml, URDF).unwrap();
        description.completed().err().map(|error| error.to_string())
    };
    let soft = "hold_damping_nm_s_per_rad = 0.001";
    assert_eq!(refusal(soft), None);
    let hold = refusal("hold_damping_nm_s_per_rad = 1.0").unwrap();
    assert!(
        hold.contains("hold_damping_nm_s_per_rad of joint `finger_joint`"),
        "{hold}"
    );
    let held =
        "held = { position_rad = 0.2, stiffness_nm_per_rad = 1.0, damping_nm_s_per_rad = 1.0 }";
    let held = refusal(&format!("{soft}\n{held}")).unwrap();
    assert!(
        held.contains("held damping_nm_s_per_rad of joint `finger_joint`"),
        "{held}"
    );
    for refused in [hold, held] {
        assert!(refused.contains("delay"), "{refused}");
    }
}

/// At a quarter of the rate the delay is longer, so the roll joint of the WAM is held with smaller gains.
#[test]
fn a_lower_control_rate_reduces_the_damping_to_the_limit_of_its_delay() {
    let wam = Description::asset("wam4").unwrap();
    let held = |description: &Description| match description.config::<4>().unwrap().roles[2] {
        Role::Held {
            stiffness_nm_per_rad,
            damping_nm_s_per_rad,
            ..
        } => (stiffness_nm_per_rad, damping_nm_s_per_rad),
        Role::Active => panic!("held"),
    };
    let (stiffness, damping) = held(&wam);
    assert_eq!(
        held(&wam.clone().at_rate(1000.0).unwrap()),
        (stiffness, damping)
    );
    let (slower_stiffness, slower_damping) = held(&wam.at_rate(250.0).unwrap());
    assert!(slower_damping < 0.6 * damping, "{slower_damping}");
    let shares = (slower_stiffness / stiffness, slower_damping / damping);
    assert!((shares.0 - shares.1).abs() < 1e-12, "{shares:?}");
}
