//! The closed form of the paper's arm compared with the general dynamics, and properties of the printed set.

use crate::property::config;
use proptest::prelude::*;
use std::f64::consts::PI;
use supple_core::math::{Matrix3, Vector3};
use supple_core::{Arm, ArmError, Pose, Vector, dynamics};
use supple_model::Description;
use supple_model::paper::Parameters;

const M1_KG: f64 = 3.0;
const M2_KG: f64 = 4.0;

fn arm(parameters: &Parameters) -> Result<Arm<3>, ArmError> {
    let tip = Pose::from_translation(Vector3::new(parameters.l3_m, 0.0, 0.0));
    let gravity = Vector3::new(0.0, 0.0, -parameters.g_m_per_s2);
    Arm::new(&parameters.joints(M1_KG, M2_KG), tip, None, gravity)
}

/// Parameters of physically consistent links: boxes with their mass on the x axis.
fn physical() -> impl Strategy<Value = Parameters> {
    let extent = || 0.02..0.4_f64;
    let link = || (extent(), extent(), extent(), 0.05..0.3_f64);
    (0.01..0.5_f64, link(), link(), 0.5..4.0_f64).prop_map(|(iz1, two, three, m3_kg)| {
        let moments = |m: f64, (x, y, z, r): (f64, f64, f64, f64)| {
            let shift = r * r;
            [y * y + z * z, x * x + z * z + shift, x * x + y * y + shift].map(|i| m * i)
        };
        let ([ix2, iy2, iz2], [ix3, iy3, iz3]) = (moments(M2_KG, two), moments(m3_kg, three));
        Parameters {
            iz1_kg_m2: iz1,
            ix2_kg_m2: ix2,
            iy2_kg_m2: iy2,
            iz2_kg_m2: iz2,
            m2r2_kg_m: M2_KG * two.3,
            ix3_kg_m2: ix3,
            iy3_kg_m2: iy3,
            iz3_kg_m2: iz3,
            m3r3_kg_m: m3_kg * three.3,
            m3_kg,
            ..Parameters::PUBLISHED
        }
    })
}

fn joints(max: f64) -> impl Strategy<Value = Vector<3>> {
    prop::array::uniform3(-max..max).prop_map(Vector::<3>::from)
}

proptest! {
    #![proptest_config(config(200, 20_260_201))]

    #[test]
    fn closed_form_equals_the_general_dynamics(
        parameters in physical(),
        q in joints(PI),
        qd in joints(2.0),
        qdd in joints(5.0),
    ) {
        let arm = arm(&parameters).expect("physically consistent");
        let close = |difference: f64| difference < 1e-12;
        let mass = parameters.mass_matrix(&q);
        prop_assert!(close((mass - dynamics::crba(&arm, &q)).amax()));
        prop_assert!(close((parameters.gravity(&q) - dynamics::gravity(&arm, &q)).amax() / 10.0));
        prop_assert!(close((parameters.coriolis(&q, &qd) - dynamics::coriolis(&arm, &q, &qd)).amax()));
        let torque = parameters.inverse_dynamics(&q, &qd, &qdd);
        prop_assert!(close((torque - dynamics::rnea(&arm, &q, &qd, &qdd)).amax() / 10.0));
        let tip = dynamics::tip_pose(&arm, &q).translation;
        prop_assert!(close((parameters.tip(&q) - tip).amax()));
    }

    #[test]
    fn christoffel_matrix_makes_the_power_balance_exact(q in joints(PI), qd in joints(2.0)) {
        let p = Parameters::PUBLISHED;
        let step = 1e-5;
        let slope = (p.mass_matrix(&(q + qd * step)) - p.mass_matrix(&(q - qd * step))) / (2.0 * step);
        let skew = slope - p.coriolis_matrix(&q, &qd) * 2.0;
        prop_assert!((skew + skew.transpose()).amax() < 1e-8);
    }

    #[test]
    fn torques_depend_only_on_the_base_parameters(
        q in joints(PI),
        qd in joints(2.0),
        qdd in joints(5.0),
        shift_2 in -0.5..0.5_f64,
        shift_3 in -0.5..0.5_f64,
    ) {
        let p = Parameters::PUBLISHED;
        let other = Parameters {
            iz1_kg_m2: p.iz1_kg_m2 - shift_2 - shift_3,
            ix2_kg_m2: p.ix2_kg_m2 + shift_2,
            iy2_kg_m2: p.iy2_kg_m2 + shift_2,
            ix3_kg_m2: p.ix3_kg_m2 + shift_3,
            iy3_kg_m2: p.iy3_kg_m2 + shift_3,
            ..p
        };
        for (a, b) in p.base().iter().zip(other.base()) {
            prop_assert!((a - b).abs() < 1e-15);
        }
        let difference = p.inverse_dynamics(&q, &qd, &qdd) - other.inverse_dynamics(&q, &qd, &qdd);
        prop_assert!(difference.amax() < 1e-12);
    }
}

#[test]
fn printed_set_has_the_property_of_a_least_norm_solution() {
    let p = Parameters::PUBLISHED;
    assert!((p.ix2_kg_m2 - p.iy2_kg_m2 - p.iz1_kg_m2).abs() < 1e-12);
    assert!((p.ix3_kg_m2 - p.iy3_kg_m2 - p.iz1_kg_m2).abs() < 1e-12);
}

#[test]
fn printed_link_3_is_inconsistent_and_link_2_can_be_consistent() {
    let p = Parameters::PUBLISHED;
    let shift = p.m3r3_kg_m * p.m3r3_kg_m / p.m3_kg;
    let others = p.iy3_kg_m2 + p.iz3_kg_m2 - 2.0 * shift;
    assert!((p.ix3_kg_m2 - 0.194).abs() < 5e-4 && (others - 0.101).abs() < 5e-4);
    let error = arm(&p).unwrap_err();
    assert!(matches!(error, ArmError::Body { joint: 2, .. }), "{error}");
    let joints = p.joints(M1_KG, M2_KG);
    joints[1].body.validate().unwrap();
    joints[2].body.validate().unwrap_err();
}

/// Changes of the unidentifiable parameters do not make link 3 consistent: its extent along the link,
/// `(Iy' + Iz' - Ix) / 2 - m r^2`, is a combination of base parameters.
#[test]
fn no_redistribution_makes_printed_link_3_consistent() {
    for shift in (-50..=50).map(|i| 0.01 * f64::from(i)) {
        let p = Parameters::PUBLISHED;
        let shifted = Parameters {
            ix3_kg_m2: p.ix3_kg_m2 + shift,
            iy3_kg_m2: p.iy3_kg_m2 + shift,
            ..p
        };
        assert!(
            shifted.joints(M1_KG, M2_KG)[2].body.validate().is_err(),
            "{shift}"
        );
    }
}

#[test]
fn printed_mass_matrix_is_positive_definite_over_the_workspace() {
    let range = |p: &Parameters| {
        let (mut smallest, mut h11) = (f64::INFINITY, [f64::INFINITY, 0.0_f64]);
        for i in 0..=360 {
            for j in 0..=360 {
                let angle = |k: i32| PI * (f64::from(k) / 180.0 - 1.0);
                let mass: Matrix3<f64> = p.mass_matrix(&Vector::<3>::new(0.0, angle(i), angle(j)));
                smallest = smallest.min(mass.symmetric_eigenvalues().min());
                h11 = [h11[0].min(mass[(0, 0)]), h11[1].max(mass[(0, 0)])];
            }
        }
        (smallest, h11)
    };
    let (smallest, [lowest, highest]) = range(&Parameters::PUBLISHED);
    println!("smallest eigenvalue {smallest:.4}, H11 {lowest:.4} to {highest:.4}");
    assert!((smallest - 0.048).abs() < 5e-4, "{smallest}");
    assert!(
        (lowest - 0.47).abs() < 5e-3 && (highest - 1.67).abs() < 5e-3,
        "{lowest} {highest}"
    );
}

/// Theta 2 is measured from the horizontal: at 0 the arm is stretched out horizontally; at 90 degrees it points up,
/// and the inertia about the base axis is minimal, as the paper states.
#[test]
fn angles_follow_the_definition_of_the_paper() {
    let description = Description::asset("paper3").unwrap();
    let arm = description.arm::<3>().unwrap();
    for (q, tip) in [
        ([0.0, 0.0, 0.0], [0.9, 0.0, 0.0]),
        ([0.0, 0.5 * PI, 0.0], [0.0, 0.0, 0.9]),
        ([0.5 * PI, 0.0, 0.5 * PI], [0.0, 0.55, 0.35]),
    ] {
        let q = Vector::<3>::from(q);
        let found = dynamics::tip_pose(&arm, &q).translation;
        assert!((found - Vector3::from(tip)).amax() < 1e-12);
        assert!((Parameters::PUBLISHED.tip(&q) - found).amax() < 1e-12);
    }
    let base_inertia = |q2: f64| dynamics::crba(&arm, &Vector::<3>::new(0.0, q2, 0.0))[(0, 0)];
    let upright = base_inertia(0.5 * PI);
    assert!((0..=36).all(|i| base_inertia(PI * f64::from(i) / 36.0) >= upright - 1e-12));
}

#[test]
fn asset_has_the_friction_of_the_paper() {
    let description = Description::asset("paper3").unwrap();
    assert_eq!(description.friction(), Parameters::PUBLISHED.friction());
}

#[test]
fn names_and_entries_of_the_linear_form_match() {
    let p = Parameters::PUBLISHED;
    let entry = |name: &str| {
        let index = Parameters::PSI_NAMES
            .iter()
            .position(|n| *n == name)
            .expect(name);
        p.psi()[index]
    };
    for (index, name) in Parameters::BASE_NAMES.iter().enumerate() {
        let mut sum = 0.0;
        for part in name.split('+') {
            let mut signed = part.split('-');
            sum += entry(signed.next().unwrap());
            sum -= signed.map(entry).sum::<f64>();
        }
        assert!((sum - p.base()[index]).abs() < 1e-15, "{name}");
    }
}
