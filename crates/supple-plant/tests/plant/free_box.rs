//! A box that stands on the ground beside the arm.

use crate::common::{tip_spring, wam4, wam4_at, weight};
use supple_core::nalgebra::{SMatrix, Vector3};
use supple_core::{Vector, dynamics::jacobian};
use supple_plant::{FreeBox, Ground, Material, Object, ObjectKind, Plant, PlantConfig, Scene};

const GROUND_M: f64 = -0.4;
const MASS_KG: f64 = 2.0;
const SIZE_M: [f64; 3] = [0.1, 0.1, 0.2];
/// Height of the pushing tip above the ground.
const LEVER_M: f64 = 0.18;

/// The tip half a millimetre before the box's near face.
fn beside_box(friction: f64, q_dot: impl Fn(&Vector<4>) -> Vector<4>) -> Plant<4> {
    let arm = wam4();
    let scene = Scene {
        ground: Some(Ground {
            height_m: GROUND_M,
            material: "grip".to_owned(),
        }),
        free_boxes: vec![FreeBox {
            name: "carton".to_owned(),
            mass_kg: MASS_KG,
            center_m: [0.75, 0.0, GROUND_M + 0.5 * SIZE_M[2]],
            size_m: SIZE_M,
            rpy_rad: [0.0; 3],
            material: "grip".to_owned(),
            layer: None,
        }],
        materials: vec![Material {
            name: "grip".to_owned(),
            friction,
            ..Material::wood()
        }],
        ..Scene::default()
    };
    let config = PlantConfig {
        scene,
        ..PlantConfig::ideal(arm)
    };
    let q = wam4_at(&arm, 0.7 - config.tip_radius_m - 5e-4, GROUND_M + LEVER_M);
    Plant::new(config, q, q_dot(&q)).unwrap()
}

fn carton(plant: &Plant<4>) -> Object {
    let mut objects = plant.objects();
    objects.find(|o| o.kind == ObjectKind::FreeBox).unwrap()
}

/// Angle between the box's axis and the vertical.
fn tilt_rad(plant: &Plant<4>) -> f64 {
    carton(plant).pose.rotation[(2, 2)].min(1.0).acos()
}

/// Pushes with a force that grows over two seconds and then stays constant, by a spring with its target ahead.
fn pushed(friction: f64, force_n: f64) -> Plant<4> {
    let mut plant = beside_box(friction, |_| Vector::zeros());
    let start = plant.truth().tip_position_m;
    let stiffness = 100.0;
    for cycle in 0..3_000 {
        let share = (f64::from(cycle) / 2000.0).min(1.0);
        let ahead = 5e-4 + share * force_n / stiffness;
        let target = start + Vector3::new(ahead, 0.0, 0.0);
        let tau = tip_spring(&plant, &target, stiffness, 30.0);
        plant.cycle(&tau);
    }
    plant
}

#[test]
fn an_untouched_box_does_not_move() {
    let mut plant = beside_box(0.6, |_| Vector::zeros());
    for _ in 0..2_000 {
        let hold = weight(&plant);
        plant.cycle(&hold);
    }
    let pose = carton(&plant).pose;
    assert!((pose.translation - Vector3::new(0.75, 0.0, GROUND_M + 0.1)).norm() < 1e-4);
    assert!(tilt_rad(&plant) < 1e-5);
}

#[test]
fn a_box_does_not_fall_in_an_impact() {
    let arm = wam4();
    let mut plant = beside_box(0.6, |q| {
        let j = jacobian(&arm, q);
        let a = SMatrix::<f64, 2, 2>::new(j[(0, 1)], j[(0, 3)], j[(2, 1)], j[(2, 3)]);
        let qd = a.try_inverse().unwrap() * Vector::<2>::from([0.04, 0.0]);
        Vector::from([0.0, qd[0], 0.0, qd[1]])
    });
    let (mut struck, mut rocked) = (0.0_f64, 0.0_f64);
    for _ in 0..2_000 {
        let hold = weight(&plant) - plant.truth().velocity_rad_per_s * 2.0;
        plant.cycle(&hold);
        struck = struck.max(plant.measurement().force_n.norm());
        rocked = rocked.max(tilt_rad(&plant));
    }
    assert!(struck > 2.0, "{struck}");
    assert!(rocked > 1e-4, "{rocked}");
    assert!(tilt_rad(&plant) < 2e-3, "{}", tilt_rad(&plant));
}

/// A box tips about its far edge if `F h > m g w / 2`.
#[test]
fn a_box_tips_at_the_analytic_threshold() {
    let threshold_n = MASS_KG * 9.81 * 0.5 * SIZE_M[0] / LEVER_M;
    let below = pushed(0.9, 0.985 * threshold_n);
    assert!(tilt_rad(&below) < 1.5e-3, "{}", tilt_rad(&below));
    let force = below.truth().contact_force_n;
    assert!(
        (force.x + 0.985 * threshold_n).abs() < 0.01 * threshold_n,
        "{force}"
    );
    let above = pushed(0.9, 1.015 * threshold_n);
    assert!(tilt_rad(&above) > 4e-3, "{}", tilt_rad(&above));
    assert!(
        tilt_rad(&pushed(0.9, 5.0 * threshold_n)) > 1.0,
        "pushed hard, it falls"
    );
}

/// A box slides if `F > mu m g`.
#[test]
fn a_box_slides_at_the_friction_limit() {
    let limit_n = 0.2 * MASS_KG * 9.81;
    let moved = |plant: &Plant<4>| carton(plant).pose.translation.x - 0.75;
    let below = moved(&pushed(0.2, 0.97 * limit_n));
    let above = moved(&pushed(0.2, 1.2 * limit_n));
    assert!(below < 1e-4, "{below}");
    assert!(above > 2e-3, "{above}");
}
