//! Rejected descriptions of an arm; the error names the part and the value.

use supple_core::math::{Matrix3, Vector3};
use supple_core::{Arm, ArmError, Body, BodyError, Joint, Pose};

const DOWN: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

fn rod() -> Body {
    Body {
        mass_kg: 2.0,
        com_m: Vector3::new(0.0, 0.0, 0.2),
        inertia_kg_m2: Matrix3::from_diagonal(&Vector3::new(0.03, 0.03, 0.001)),
    }
}

fn joints() -> [Joint; 3] {
    [Joint {
        parent_from_link: Pose::from_xyz_rpy([0.0, 0.0, 0.4], [0.3, -0.2, 0.1]),
        axis: Vector3::new(0.0, 1.0, 0.0),
        body: rod(),
        armature_kg_m2: 0.1,
    }; 3]
}

/// The error for an arm with joint 1 changed by `spoil`.
fn refusal(spoil: impl Fn(&mut Joint)) -> ArmError {
    let mut joints = joints();
    spoil(&mut joints[1]);
    Arm::new(&joints, Pose::IDENTITY, None, DOWN).expect_err("joint 1 is physically inconsistent")
}

/// The error for an arm with link 1 changed by `spoil`; the same change of the tool gives the same
/// error.
fn body_refusal(spoil: impl Fn(&mut Body)) -> BodyError {
    let ArmError::Body { joint: 1, error } = refusal(|joint| spoil(&mut joint.body)) else {
        panic!("the link of joint 1 is what is wrong");
    };
    let mut tool = rod();
    spoil(&mut tool);
    let of_tool = Arm::new(&joints(), Pose::IDENTITY, Some(tool), DOWN).expect_err("bad tool");
    // NaN differs from itself, so the texts are compared.
    assert_eq!(of_tool.to_string(), ArmError::Tool(error).to_string());
    assert!(of_tool.to_string().starts_with("tool: "), "{of_tool}");
    let of_link = ArmError::Body { joint: 1, error }.to_string();
    assert!(of_link.starts_with("link of joint 1: "), "{of_link}");
    error
}

#[track_caller]
fn says(error: impl std::error::Error, words: &[&str]) {
    let text = error.to_string();
    for word in words {
        assert!(text.contains(word), "{text:?} does not say {word:?}");
    }
}

#[test]
fn a_physical_arm_is_accepted() {
    assert!(Arm::new(&joints(), Pose::IDENTITY, Some(rod()), DOWN).is_ok());
    assert!(Arm::new(&joints(), Pose::IDENTITY, None, Vector3::zeros()).is_ok());
}

#[test]
fn mass() {
    for (mass, printed) in [
        (0.0, "0 kg"),
        (-1.5, "-1.5 kg"),
        (f64::NAN, "NaN kg"),
        (f64::INFINITY, "inf kg"),
    ] {
        let error = body_refusal(|body| body.mass_kg = mass);
        assert!(matches!(error, BodyError::Mass(_)), "{error:?}");
        says(error, &["mass", printed, "positive"]);
    }
}

#[test]
fn centre_of_mass() {
    for value in [f64::NAN, f64::NEG_INFINITY] {
        let error = body_refusal(|body| body.com_m.y = value);
        assert!(matches!(error, BodyError::CentreOfMass(_)), "{error:?}");
        says(error, &["centre of mass", &format!("{value} m"), "finite"]);
    }
}

#[test]
fn inertia_entry() {
    for at in [(0, 0), (0, 2), (2, 0)] {
        let error = body_refusal(|body| body.inertia_kg_m2[at] = f64::NAN);
        assert!(matches!(error, BodyError::InertiaEntry(_)), "{error:?}");
        says(error, &["inertia", "NaN kg m^2", "finite"]);
    }
}

#[test]
fn inertia_asymmetric() {
    let error = body_refusal(|body| body.inertia_kg_m2[(0, 1)] = 0.002);
    assert_eq!(error, BodyError::Asymmetric(0.002, 0.0));
    says(error, &["not symmetric", "0.002", "against 0 "]);
}

#[test]
fn inertia_not_positive() {
    let error = body_refusal(|body| body.inertia_kg_m2[(1, 1)] = -0.03);
    assert!(matches!(error, BodyError::NotPositive(_)), "{error:?}");
    says(error, &["smallest principal moment", "-0.03", "positive"]);
    let flat = body_refusal(|body| body.inertia_kg_m2 = Matrix3::zeros());
    says(flat, &["0 kg m^2"]);
    // All entries positive, but indefinite.
    let hidden = body_refusal(|body| {
        body.inertia_kg_m2 = Matrix3::new(0.02, 0.03, 0.0, 0.03, 0.02, 0.0, 0.0, 0.0, 0.02);
    });
    says(hidden, &["-0.0"]);
}

#[test]
fn inertia_beyond_the_triangle() {
    let moments = Vector3::new(0.01, 0.05, 0.03);
    let turned = Pose::from_xyz_rpy([0.0; 3], [0.4, -1.1, 2.0]).rotation;
    let inertia = turned * Matrix3::from_diagonal(&moments) * turned.transpose();
    let inertia = (inertia + inertia.transpose()) * 0.5;
    let error = body_refusal(|body| body.inertia_kg_m2 = inertia);
    let BodyError::Triangle { max_moment, others } = error else {
        panic!("{error:?}");
    };
    assert!((max_moment - 0.05).abs() < 1e-12 && (others - 0.04).abs() < 1e-12);
    says(
        error,
        &[
            &format!("{max_moment} kg m^2"),
            &format!("{others} kg m^2"),
            "impossible",
        ],
    );
}

/// The checks do not depend on the magnitude of the entries.
#[test]
fn inertia_is_checked_at_any_magnitude() {
    for size in [1e-200, 1e-110, 1e-20, 1e20, 1e110, 1e300] {
        let judge = |x, y, z| {
            body_refusal(|body| {
                body.inertia_kg_m2 = Matrix3::from_diagonal(&(Vector3::new(x, y, z) * size));
            })
        };
        let broken = judge(1.0, 1.0, 3.0);
        assert!(matches!(broken, BodyError::Triangle { .. }), "{broken:?}");
        let negative = judge(1.0, -1.0, 1.0);
        assert!(
            matches!(negative, BodyError::NotPositive(_)),
            "{negative:?}"
        );
        let valid = Body {
            inertia_kg_m2: Matrix3::from_diagonal(&(Vector3::new(1.0, 1.0, 1.5) * size)),
            ..rod()
        };
        assert_eq!(valid.validate(), Ok(()));
    }
}

/// A thin plate is accepted, also with rounded moments.
#[test]
fn a_flat_body_is_accepted() {
    let mut joints = joints();
    joints[1].body.inertia_kg_m2 = Matrix3::from_diagonal(&Vector3::new(0.01, 0.02, 0.03));
    assert!(Arm::new(&joints, Pose::IDENTITY, None, DOWN).is_ok());
}

#[test]
fn axis() {
    for (axis, length) in [
        (Vector3::zeros(), "length 0,"),
        (Vector3::new(0.0, 2.0, 0.0), "length 2,"),
        (Vector3::new(0.0, f64::NAN, 1.0), "length NaN,"),
    ] {
        let error = refusal(|joint| joint.axis = axis);
        assert!(
            matches!(error, ArmError::Axis { joint: 1, .. }),
            "{error:?}"
        );
        says(error, &["joint 1", "axis", length, "unit"]);
    }
}

#[test]
fn armature() {
    for (armature, printed) in [
        (-0.01, "-0.01 kg m^2"),
        (f64::NAN, "NaN"),
        (f64::INFINITY, "inf"),
    ] {
        let error = refusal(|joint| joint.armature_kg_m2 = armature);
        assert!(
            matches!(error, ArmError::Armature { joint: 1, .. }),
            "{error:?}"
        );
        says(error, &["joint 1", "rotor inertia", printed]);
    }
}

#[test]
fn transform() {
    let broken: [fn(&mut Pose); 4] = [
        |pose| pose.translation.z = f64::NAN,
        |pose| pose.rotation[(1, 2)] = f64::INFINITY,
        |pose| pose.rotation *= 1.01,
        // A reflection preserves lengths but is not a rigid motion.
        |pose| pose.rotation = -pose.rotation,
    ];
    for spoil in broken {
        let error = refusal(|joint| spoil(&mut joint.parent_from_link));
        assert!(
            matches!(error, ArmError::Pose { joint: 1, .. }),
            "{error:?}"
        );
        says(error, &["joint 1", "rigid motion"]);

        let mut tip = Pose::IDENTITY;
        spoil(&mut tip);
        let error = Arm::new(&joints(), tip, None, DOWN).expect_err("bad tip frame");
        assert!(
            matches!(error, ArmError::Pose { joint: 3, .. }),
            "{error:?}"
        );
    }
    says(
        refusal(|joint| joint.parent_from_link.translation.z = f64::NAN),
        &["NaN"],
    );
    says(
        refusal(|joint| joint.parent_from_link.rotation *= 1.5),
        &["1.25"],
    );
}

#[test]
fn gravity() {
    let upwards = Vector3::new(0.0, f64::NAN, 9.81);
    let error = Arm::new(&joints(), Pose::IDENTITY, None, upwards).expect_err("bad gravity");
    assert!(matches!(error, ArmError::Gravity(_)), "{error:?}");
    says(error, &["gravity", "NaN m/s^2", "finite"]);
}

/// Text that represents every number of an arm bit for bit.
fn bits<const N: usize>(arm: &Arm<N>) -> String {
    let (links, armature) = (arm.links(), arm.armature());
    let (tip, gravity) = (arm.joint_from_tip(), arm.gravity());
    // Debug prints the shortest decimal that parses to the same number, so equal texts mean equal
    // bits.
    format!("{links:?} {armature:?} {tip:?} {gravity:?}")
}

#[test]
fn arm_rebuilt_from_its_links_is_identical() {
    let tip = Pose::from_xyz_rpy([0.1, 0.0, 0.3], [0.2, 0.7, -0.4]);
    let arm = Arm::new(&joints(), tip, Some(rod()), DOWN).expect("a physical arm");
    let parts = (arm.armature(), arm.joint_from_tip(), arm.gravity());
    let again = Arm::from_links(*arm.links(), parts.0, parts.1, parts.2).expect("the same arm");
    assert_eq!(bits(&again), bits(&arm));

    let mut links = *arm.links();
    links[2].mass = -1.0;
    let error = Arm::from_links(links, parts.0, parts.1, parts.2).expect_err("negative mass");
    assert!(matches!(error, ArmError::Body { joint: 2, .. }), "{error}");
    let error = Arm::from_links(*arm.links(), -parts.0, parts.1, parts.2).expect_err("armature");
    assert!(
        matches!(error, ArmError::Armature { joint: 0, .. }),
        "{error}"
    );
    let mut links = *arm.links();
    links[1].link_from_joint *= 2.0;
    let error = Arm::from_links(links, parts.0, parts.1, parts.2).expect_err("not a rotation");
    assert!(matches!(error, ArmError::Pose { joint: 1, .. }), "{error}");
}
