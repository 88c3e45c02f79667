//! Contact of the tip with a fixed block.

use crate::common::{above_block, block, descent, tip_spring, wam4, wam4_at, wam4_in, weight};
use supple_core::dynamics::{aba, crba, gravity, jacobian, kinetic_energy, tip_pose};
use supple_core::nalgebra::Vector3;
use supple_core::{Arm, Vector};
use supple_plant::{Layer, Material, Plant, PlantConfig, Scene};

/// Results of an impact.
#[derive(Clone, Copy, Debug, Default)]
struct Impact {
    peak_n: f64,
    filtered_n: f64,
    impulse_ns: f64,
    contact_s: f64,
    speed_m_per_s: f64,
}

/// 40 ms from just above the face, gravity compensated.
fn impact(mut plant: Plant<4>) -> Impact {
    let step_s = plant.config().step_s;
    let mut impact = Impact::default();
    for _ in 0..40 {
        let tau = weight(&plant);
        plant.cycle(&tau);
        for step in plant.steps() {
            let z = step.force_n.z;
            impact.peak_n = impact.peak_n.max(z);
            impact.filtered_n = impact.filtered_n.max(step.filtered_force_n.z);
            impact.impulse_ns += z * step_s;
            impact.contact_s += if z > 0.0 { step_s } else { 0.0 };
        }
    }
    impact.speed_m_per_s = plant.truth().tip_velocity_m_per_s.z;
    impact
}

/// A plant above a block of one material, with the tip moving straight down.
fn above(material: Material, speed_m_per_s: f64, step_s: f64) -> Plant<4> {
    let arm = wam4();
    let config = PlantConfig {
        scene: Scene {
            materials: vec![material],
            ..block()
        },
        step_s,
        ..PlantConfig::ideal(arm)
    };
    let q = wam4_at(&arm, 0.72, config.tip_radius_m + 1e-4);
    Plant::new(config, q, descent(&arm, &q, speed_m_per_s)).unwrap()
}

fn slippery() -> Material {
    Material {
        friction: 0.0,
        ..Material::wood()
    }
}

/// Effective mass of the tip in the vertical direction.
fn effective_mass(arm: &Arm<4>, q: &Vector<4>) -> f64 {
    let up = jacobian(arm, q).row(2).transpose();
    1.0 / up.dot(&(crba(arm, q).try_inverse().unwrap() * up))
}

#[test]
fn an_impact_agrees_with_runge_kutta_on_the_articulated_body_algorithm() {
    let (arm, wood, speed) = (wam4(), slippery(), 0.04);
    let radius_m = 0.02;
    let mut q = wam4_at(&arm, 0.72, radius_m + 1e-4);
    let mut qd = descent(&arm, &q, speed);
    let force = |q: &Vector<4>, qd: &Vector<4>| {
        let depth = radius_m - tip_pose(&arm, q).translation.z;
        let rate = -jacobian(&arm, q).row(2).transpose().dot(qd);
        wood.normal_force_n(depth, rate)
    };
    let acceleration = |q: &Vector<4>, qd: &Vector<4>| {
        let push = jacobian(&arm, q).row(2).transpose() * force(q, qd);
        aba(&arm, q, qd, &(gravity(&arm, q) + push))
    };
    let (h, mut peak_n, mut impulse_ns) = (1e-5, 0.0_f64, 0.0);
    for _ in 0..4000 {
        let (k1, l1) = (qd, acceleration(&q, &qd));
        let (k2, l2) = (
            qd + l1 * (h / 2.0),
            acceleration(&(q + k1 * (h / 2.0)), &(qd + l1 * (h / 2.0))),
        );
        let (k3, l3) = (
            qd + l2 * (h / 2.0),
            acceleration(&(q + k2 * (h / 2.0)), &(qd + l2 * (h / 2.0))),
        );
        let (k4, l4) = (qd + l3 * h, acceleration(&(q + k3 * h), &(qd + l3 * h)));
        q += (k1 + k2 * 2.0 + k3 * 2.0 + k4) * (h / 6.0);
        qd += (l1 + l2 * 2.0 + l3 * 2.0 + l4) * (h / 6.0);
        peak_n = peak_n.max(force(&q, &qd));
        impulse_ns += force(&q, &qd) * h;
    }
    let found = impact(above(wood.clone(), speed, 1e-5));
    assert!(
        (found.peak_n / peak_n - 1.0).abs() < 3e-3,
        "{found:?} {peak_n}"
    );
    assert!(
        (found.impulse_ns / impulse_ns - 1.0).abs() < 5e-4,
        "{found:?} {impulse_ns}"
    );
}

/// Reference values from `impact_oracle.py`: MuJoCo with the same contact law, Runge-Kutta at 10 us.
#[test]
fn an_impact_agrees_with_mujoco() {
    let expected: serde_json::Value =
        serde_json::from_str(include_str!("../impact_mujoco.json")).unwrap();
    let relative = |found: f64, name: &str| found / expected[name].as_f64().unwrap() - 1.0;
    let found = impact(above(slippery(), 0.04, 1e-5));
    for (value, name, bound) in [
        (found.impulse_ns, "impulse_newton_s", 5e-5),
        (found.speed_m_per_s, "rebound_m_per_s", 1e-3),
        (found.peak_n, "peak_n", 4e-3),
    ] {
        assert!(relative(value, name).abs() < bound, "{name}: {found:?}");
    }
}

/// For one body against a wall the law integrates: `c (v + v') = ln((1 + c v) / (1 - c v'))`.
#[test]
fn rebound_speed_and_impulse_follow_the_closed_form_of_the_law() {
    let arm = wam4();
    let mass_kg = effective_mass(&arm, &wam4_at(&arm, 0.72, 0.02));
    assert!((1.0..1.6).contains(&mass_kg), "{mass_kg}");
    for speed in [0.02, 0.04, 0.08] {
        let c = slippery().dissipation_s_per_m;
        let (mut low, mut high) = (0.0, speed);
        for _ in 0..60 {
            let back = 0.5 * (low + high);
            let lost = c * (speed + back) - ((1.0 + c * speed) / (1.0 - c * back)).ln();
            if lost > 0.0 { low = back } else { high = back }
        }
        let found = impact(above(slippery(), speed, 5e-5));
        assert!(
            (found.speed_m_per_s / low - 1.0).abs() < 0.01,
            "{found:?} {low}"
        );
        let impulse = mass_kg * (speed + low);
        assert!(
            (found.impulse_ns / impulse - 1.0).abs() < 0.01,
            "{found:?} {impulse}"
        );
    }
}

#[test]
fn an_impact_converges_at_first_order_and_is_accurate_at_the_default_step() {
    let run = |step_s| impact(above_block(1e-4, 0.04, step_s));
    let (default, fine, finer) = (run(2e-4), run(5e-5), run(2.5e-5));
    let finest = run(1.25e-5);
    let near = |a: f64, b: f64, share: f64| assert!((a / b - 1.0).abs() < share, "{a} {b}");
    near(default.filtered_n, finest.filtered_n, 0.01);
    near(default.impulse_ns, finest.impulse_ns, 0.005);
    near(default.peak_n, finest.peak_n, 0.06);
    near(default.contact_s, finest.contact_s, 0.05);
    // Differences halve with the step.
    let ratio = (fine.filtered_n - finer.filtered_n) / (finer.filtered_n - finest.filtered_n);
    assert!((1.6..2.5).contains(&ratio), "{ratio}");
}

#[test]
fn the_filtered_transient_at_the_default_speed_matches_the_paper() {
    let found = impact(above_block(1e-4, 0.04, 2e-4));
    assert!((15.0..22.0).contains(&found.filtered_n), "{found:?}");
    assert!((3e-3..5e-3).contains(&found.contact_s), "{found:?}");
}

/// A contact much shorter than the filter's time constant gives the filter's impulse response: the reported peak
/// depends only on the momentum change.
#[test]
fn the_filtered_peak_scales_with_effective_mass_and_speed() {
    let arm = wam4();
    let mut ratios = Vec::new();
    for (x, z) in [(0.72, 0.0), (0.6, 0.0), (0.55, -0.2)] {
        let q = wam4_at(&arm, x, z + 0.02 + 1e-4);
        let mass_kg = effective_mass(&arm, &q);
        for speed in [0.02, 0.04, 0.08] {
            let mut scene = block();
            scene.fixed_blocks[0].center_m = [x, 0.0, z - 0.05];
            let config = PlantConfig {
                scene,
                ..PlantConfig::ideal(arm)
            };
            let found = impact(Plant::new(config, q, descent(&arm, &q, speed)).unwrap());
            let momentum = mass_kg * (speed + found.speed_m_per_s);
            ratios.push(found.filtered_n / momentum);
        }
    }
    // The maximum of the filter's impulse response, sqrt(2) w exp(-w t / sqrt(2))
    // sin(w t / sqrt(2)); a longer contact reaches less of it.
    let limit = core::f64::consts::TAU * 100.0 * (-core::f64::consts::FRAC_PI_4).exp();
    for ratio in &ratios {
        assert!((0.75..1.0).contains(&(ratio / limit)), "{ratios:?} {limit}");
    }
}

#[test]
fn at_rest_the_force_is_stiffness_times_error() {
    for (stiffness, below_m) in [(5.0, 0.06), (25.0, 0.06), (125.0, 0.06), (125.0, 0.002)] {
        let mut plant = above_block(1e-4, 0.0, 2e-4);
        let target = Vector3::new(0.72, 0.0, 0.02 - below_m);
        for _ in 0..4000 {
            let tau = tip_spring(&plant, &target, stiffness, 20.0);
            plant.cycle(&tau);
        }
        let truth = *plant.truth();
        let expected = (truth.tip_position_m - target) * stiffness;
        assert!(truth.tip_velocity_m_per_s.norm() < 1e-7);
        let error = (truth.contact_force_n - expected).norm() / expected.norm();
        assert!(error < 1e-4, "{error} {truth:?}");
        assert!((plant.measurement().force_n - expected).norm() < 1e-4 * expected.norm());
    }
}

/// Without gravity and torque only the contact acts, so all energy is kinetic.
#[test]
fn no_impact_adds_energy() {
    let arm = wam4_in(Vector3::zeros());
    for (dissipation, friction) in [(40.0, 0.3), (40.0, 0.0), (0.0, 0.3), (0.0, 0.0)] {
        for slide in [-0.3, 0.0, 0.2] {
            let config = PlantConfig {
                scene: Scene {
                    materials: vec![Material {
                        dissipation_s_per_m: dissipation,
                        friction,
                        ..Material::wood()
                    }],
                    ..block()
                },
                ..PlantConfig::ideal(arm)
            };
            let q = wam4_at(&arm, 0.72, 0.0201);
            let mut qd = descent(&arm, &q, 0.1);
            qd[0] = slide;
            let mut plant = Plant::new(config, q, qd).unwrap();
            let energy = |plant: &Plant<4>| {
                let truth = plant.truth();
                kinetic_energy(&arm, &truth.position_rad, &truth.velocity_rad_per_s)
            };
            let before = energy(&plant);
            let mut touched = false;
            for _ in 0..30 {
                plant.cycle(&Vector::zeros());
                touched |= plant.steps().iter().any(|s| s.force_n.z > 0.0);
            }
            assert!(
                touched && plant.truth().contact_force_n.z == 0.0,
                "it bounced"
            );
            let share = energy(&plant) / before;
            if dissipation > 0.0 {
                assert!(share < 0.9, "{share}");
            } else {
                // The elastic law returns the absorbed energy, to the order of the step.
                assert!(share < 1.0 + 2e-3, "{share}");
            }
            if dissipation == 0.0 && friction == 0.0 {
                assert!(share > 1.0 - 2e-3, "{share}");
            }
        }
    }
}

#[test]
fn the_surface_holds_the_tip_up_to_the_coulomb_limit() {
    let run = |pull_n: f64| {
        let mut plant = above_block(1e-5, 0.0, 2e-4);
        let mut press = |pull_n: f64| {
            let (q, tip) = (plant.truth().position_rad, plant.truth());
            let force = Vector3::new(0.0, pull_n, -10.0) - tip.tip_velocity_m_per_s * 10.0;
            let j = jacobian(&plant.config().arm, &q);
            let mut tau = weight(&plant) + j.fixed_rows::<3>(0).transpose() * force;
            // With a free roll joint the tip would roll.
            tau[2] -= 2000.0 * q[2] + 20.0 * plant.truth().velocity_rad_per_s[2];
            plant.cycle(&tau);
            (
                plant.truth().tip_position_m.y,
                plant.truth().contact_force_n,
            )
        };
        let settled = (0..1000).map(|_| press(0.0)).last().unwrap();
        let pulled = (0..1500).map(|i| press(pull_n * (f64::from(i) / 500.0).min(1.0)));
        let (y, force) = pulled.last().unwrap();
        (y - settled.0, force)
    };
    let (held, force) = run(2.9);
    // Deflection of the bristle: 2.9 N at 2e4 N/m.
    assert!((held - 1.45e-4).abs() < 1e-5, "{held}");
    assert!((force.y + 2.9).abs() < 1e-3, "{force}");
    let (slid, force) = run(4.0);
    assert!(slid > 0.05, "{slid}");
    assert!(
        (force.y.hypot(force.x) / force.z - 0.3).abs() < 1e-9,
        "{force}"
    );
}

#[test]
fn rubber_is_softer_than_wood_until_it_is_fully_compressed() {
    let layered = |thickness_m: f64| {
        let arm = wam4();
        let mut scene = block();
        scene.fixed_blocks[0].layer = Some(Layer {
            thickness_m,
            material: "rubber".to_owned(),
        });
        let config = PlantConfig {
            scene,
            ..PlantConfig::ideal(arm)
        };
        let q = wam4_at(&arm, 0.72, 0.02 + thickness_m + 1e-4);
        impact(Plant::new(config, q, descent(&arm, &q, 0.04)).unwrap())
    };
    let (wood, thick, thin) = (
        impact(above_block(1e-4, 0.04, 2e-4)),
        layered(5e-3),
        layered(5e-5),
    );
    assert!((0.010..0.020).contains(&thick.contact_s), "{thick:?}");
    assert!(thick.peak_n < 0.5 * wood.peak_n, "{thick:?} {wood:?}");
    assert!(
        thin.peak_n > 1.2 * thick.peak_n && thin.peak_n < wood.peak_n,
        "{thin:?}"
    );
}
