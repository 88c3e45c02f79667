//! Prints how many times faster than real time the plant runs on one core, at its default step.
//!
//! `cargo run --release -p supple-plant --example speed`

#[path = "../tests/common/mod.rs"]
mod common;

use common::{block, tip_spring, wam4, wam4_at};
use std::time::Instant;
use supple_core::nalgebra::Vector3;
use supple_core::{Friction, Vector};
use supple_plant::{
    ActuatorModel, FreeBox, Ground, LuGre, Plant, PlantConfig, PlantOptions, Scene,
};

const DURATION_S: f64 = 10.0;

fn plant(scene: Scene, options: &PlantOptions) -> Plant<4> {
    let arm = wam4();
    let friction = [
        (1.605, 1.648),
        (0.533, 2.364),
        (0.372, 0.811),
        (0.642, 0.601),
    ]
    .map(|(coulomb, viscous)| LuGre::from_friction(&Friction::coulomb(viscous, coulomb)));
    let config = PlantConfig {
        friction,
        actuators: ActuatorModel {
            counts_per_motor_revolution: Vector::repeat(4096.0),
            motor_torque_quantum_nm: Vector::repeat(1.0 / 2700.0),
            torque_delay_cycles: 1,
            ..ActuatorModel::direct()
        },
        scene,
        ..PlantConfig::ideal(arm)
    };
    let q = wam4_at(&arm, 0.72, 0.06);
    let config = options.apply(config);
    match config.and_then(|config| Plant::new(config, q, Vector::zeros())) {
        Ok(plant) => plant,
        Err(error) => panic!("{error}"),
    }
}

/// Moves the tip up and down by 10 cm once per second about the block's face. Returns the speed relative to real time
/// and the fraction of the time in contact.
fn probe(mut plant: Plant<4>) -> (f64, f64) {
    let (mut plant_wall_s, mut contact_fraction) = (0.0, 0.0);
    let cycles = (DURATION_S / 1e-3) as u32;
    for cycle in 0..cycles {
        let phase = core::f64::consts::TAU * f64::from(cycle) * 1e-3;
        let target = Vector3::new(0.72, 0.0, 0.02 + 0.05 * phase.cos());
        let tau = tip_spring(&plant, &target, 300.0, 20.0);
        let start = Instant::now();
        let measured = plant.cycle(&tau);
        plant_wall_s += start.elapsed().as_secs_f64();
        contact_fraction += f64::from(u8::from(measured.force_n.z > 0.1)) / f64::from(cycles);
    }
    (DURATION_S / plant_wall_s, contact_fraction)
}

fn main() {
    let with_box = Scene {
        ground: Some(Ground {
            height_m: -0.4,
            material: "wood".to_owned(),
        }),
        free_boxes: vec![FreeBox {
            name: "carton".to_owned(),
            mass_kg: 2.0,
            center_m: [0.3, 0.6, -0.3],
            size_m: [0.1, 0.1, 0.2],
            rpy_rad: [0.0; 3],
            material: "wood".to_owned(),
            layer: None,
        }],
        ..block()
    };
    let (none, realistic) = (PlantOptions::default(), PlantOptions::realistic());
    for (name, scene, options) in [
        ("empty space", Scene::default(), &none),
        ("empty space, realistic", Scene::default(), &realistic),
        ("fixed block", block(), &none),
        ("fixed block, realistic", block(), &realistic),
        ("fixed block and free box", with_box, &none),
    ] {
        let (speed, contact_fraction) = probe(plant(scene, options));
        println!(
            "{name}: {speed:.1} times real time, in contact {:.0} % of the time",
            100.0 * contact_fraction
        );
    }
}
