//! Motors that give different shares of what is commanded.

use crate::support::{Noise, motion, random_arm};
use supple_core::{Arm, Friction};
use supple_ident::{FrictionColumns, Options, torque_scales};

/// Relative noise of the torques.
const NOISE: f64 = 0.02;

fn heavier(truth: &Arm<6>) -> Arm<6> {
    let mut links = *truth.links();
    for (k, link) in links.iter_mut().enumerate() {
        let factor = [1.3, 0.8, 1.1, 0.75, 1.2, 0.9][k];
        link.mass *= factor;
        link.first_moment *= factor;
        link.inertia *= factor;
    }
    Arm::from_links(
        links,
        truth.armature(),
        truth.joint_from_tip(),
        truth.gravity(),
    )
    .expect("an arm")
}

#[test]
fn of_ten_arms_are_found_within_two_percent() {
    let joints = [0, 1, 2, 3, 4, 5];
    let friction = [Friction::coulomb(0.6, 0.5); 6];
    for seed in 0..10 {
        let truth = random_arm::<6>(seed);
        let mut noise = Noise::new(seed + 500);
        // Commanded torque over real torque: 1.30 to 1.49.
        let over: Vec<f64> = (0..6).map(|_| 1.395 + 0.095 * noise.draw()).collect();
        let mean = over.iter().map(|over| -over.ln()).sum::<f64>() / 6.0;
        let mut motions = [seed, seed + 100, seed + 200]
            .map(|seed| motion(&truth, &friction, &joints, 1500, seed));
        for motion in &mut motions {
            for (joint, over) in over.iter().enumerate() {
                let size = motion.tau.column(joint).norm() / 1500_f64.sqrt();
                for torque in motion.tau.column_mut(joint).iter_mut() {
                    *torque = *torque * over + NOISE * size * noise.draw();
                }
            }
        }
        let options = Options {
            friction: FrictionColumns::OFFSET,
            ..Options::default()
        };
        let found = torque_scales(&heavier(&truth), &motions, &joints, &options).expect("scales");
        let product: f64 = found.scale.iter().product();
        assert!((product - 1.0).abs() < 1e-9, "{product}");
        for joint in joints {
            let expected = (-over[joint].ln() - mean).exp();
            let off = found.scale[joint] / expected - 1.0;
            assert!(
                off.abs() < 0.02,
                "seed {seed}, joint {joint}: {off:.4}, deviation {:.4}",
                found.deviation[joint]
            );
        }
    }
}
