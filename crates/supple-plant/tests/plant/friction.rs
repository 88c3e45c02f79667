//! Joint friction: breakaway, sliding, dissipation, load.

use crate::common::{self, wam4, wam4_at};
use supple_core::dynamics::{gravity, kinetic_energy};
use supple_core::nalgebra::Vector3;
use supple_core::{Arm, Body, Friction, Joint, Pose, Vector};
use supple_plant::{LuGre, Plant, PlantConfig};

const LAW: Friction = Friction {
    viscous_nm_s_per_rad: 1.2,
    coulomb_nm: 1.5,
    breakaway_nm: 1.5,
    stribeck_rad_per_s: 0.05,
    offset_nm: 0.0,
    band_rad_per_s: 0.01,
    ..Friction::NONE
};

/// A wheel on a horizontal axis through its centre of mass: only inertia and friction.
fn wheel(friction: LuGre) -> Plant<1> {
    let joint = Joint {
        parent_from_link: Pose::IDENTITY,
        axis: Vector3::y(),
        body: Body::ball(2.0, 0.3, Vector3::zeros()),
        armature_kg_m2: 0.1,
    };
    let arm = Arm::new(&[joint], Pose::IDENTITY, None, common::DOWN).unwrap();
    let config = PlantConfig {
        friction: [friction],
        ..PlantConfig::ideal(arm)
    };
    Plant::new(config, Vector::zeros(), Vector::zeros()).unwrap()
}

fn true_friction() -> LuGre {
    LuGre::from_friction(&LAW).without_load()
}

#[test]
fn friction_built_from_a_law_equals_the_law_in_steady_sliding() {
    let plain = true_friction();
    for v in [0.5, -0.5, 2.0] {
        assert!((plain.steady_torque_nm(v, 0.0) - LAW.torque_nm(v)).abs() < 1e-12);
    }
    assert!((plain.steady_torque_nm(1e-9, 0.0) - 1.1 * 1.5).abs() < 1e-6);
    let dip = Friction {
        breakaway_nm: 2.0,
        offset_nm: 0.3,
        ..LAW
    };
    let dipped = LuGre::from_friction(&dip).without_load();
    for v in [0.011, -0.03, 0.06, 0.2] {
        assert!((dipped.steady_torque_nm(v, 0.0) - dip.torque_nm(v)).abs() < 1e-12);
    }
    assert_eq!(dipped.steady_torque_nm(0.0, 0.0), 0.3);
    assert_eq!(
        LuGre::from_friction(&Friction::NONE).steady_torque_nm(1.0, 1.0),
        0.0
    );
}

#[test]
fn a_torque_ramp_starts_sliding_at_the_breakaway_torque() {
    for sign in [1.0, -1.0] {
        let mut plant = wheel(true_friction());
        let rate_nm_per_s = 0.1;
        let mut torque_nm = 0.0;
        while plant.truth().velocity_rad_per_s[0].abs() < 0.02 {
            torque_nm += rate_nm_per_s * 1e-3;
            assert!(torque_nm < 3.0, "never broke loose");
            plant.cycle(&Vector::from([sign * torque_nm]));
        }
        let share = torque_nm / 1.65;
        assert!((0.99..1.03).contains(&share), "{torque_nm}");
    }
}

/// Under slow loading the bristle deflects by `x = -(g / s0) ln(1 - tau / g)`, on unloading it returns by
/// `(g / s0) ln(1 + tau / g)`: the presliding curve of the model, with the breakaway torque as `g` at rest.
#[test]
fn below_breakaway_the_joint_follows_the_presliding_curve_and_returns() {
    let (friction, torque_nm) = (true_friction(), 1.5);
    let mut plant = wheel(friction);
    let mut angle_after = |cycles: i32, torque_nm: &dyn Fn(f64) -> f64| {
        for cycle in 0..cycles {
            plant.cycle(&Vector::from([torque_nm(
                f64::from(cycle) / f64::from(cycles),
            )]));
        }
        assert!(plant.truth().velocity_rad_per_s[0].abs() < 2e-3);
        (
            plant.truth().position_rad[0],
            plant.truth().friction_torque_nm[0],
        )
    };
    let loaded = angle_after(5_000, &|share| share * torque_nm);
    let settled = angle_after(5_000, &|_| torque_nm);
    let held = angle_after(20_000, &|_| torque_nm);
    let released = angle_after(5_000, &|share| (1.0 - share) * torque_nm);
    let g = friction.breakaway_nm;
    let give = g / friction.bristle_stiffness_nm_per_rad;
    assert!(
        (loaded.0 / (-give * (1.0 - torque_nm / g).ln()) - 1.0).abs() < 0.02,
        "{loaded:?}"
    );
    assert!((held.0 - settled.0).abs() < 1e-9, "{held:?} {settled:?}");
    assert!((held.1 - torque_nm).abs() < 1e-9, "{held:?}");
    let back = held.0 - released.0;
    assert!(
        (back / (give * (1.0 + torque_nm / g).ln()) - 1.0).abs() < 0.02,
        "{back}"
    );
}

#[test]
fn steady_sliding_follows_the_stribeck_curve() {
    for speed in [-0.3, -0.05, 0.01, 0.03, 0.1, 1.0] {
        let mut plant = wheel(true_friction());
        for _ in 0..4_000 {
            let v = plant.truth().velocity_rad_per_s[0];
            plant.cycle(&Vector::from([LAW.torque_nm(speed) + 50.0 * (speed - v)]));
        }
        let truth = plant.truth();
        let v = truth.velocity_rad_per_s[0];
        assert!((v - speed).abs() < 0.01);
        let steady = true_friction().steady_torque_nm(v, 0.0);
        let found = truth.friction_torque_nm[0];
        assert!((found - steady).abs() < 1e-6, "{speed}: {found} {steady}");
    }
}

#[test]
fn friction_is_dissipative() {
    // From rest around a closed path in velocity, the work done on friction is positive, at any speed.
    for amplitude in [1e-4, 1e-3, 1e-2, 0.1, 1.0] {
        for hertz in [0.5, 5.0, 50.0] {
            let friction = true_friction();
            let (mut z, dt, mut work) = (0.0, 2e-4, 0.0);
            for i in 0..(2.0 / hertz / dt) as usize {
                let v = amplitude * (core::f64::consts::TAU * hertz * i as f64 * dt).sin();
                work += friction.advance(&mut z, v, 0.0, dt) * v * dt;
            }
            assert!(work > 0.0, "{amplitude} rad/s, {hertz} Hz: {work}");
        }
    }
}

#[test]
fn a_coasting_arm_stops_and_stays() {
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
        ..PlantConfig::ideal(arm)
    };
    let q = wam4_at(&arm, 0.6, 0.0);
    let mut plant = Plant::new(config, q, Vector::from([1.0, -0.8, 1.0, 0.9])).unwrap();
    let mut kinetic = f64::MAX;
    for cycle in 0..6_000 {
        let tau = gravity(&arm, &plant.truth().position_rad);
        plant.cycle(&tau);
        let truth = plant.truth();
        if cycle % 500 == 499 {
            let now = kinetic_energy(&arm, &truth.position_rad, &truth.velocity_rad_per_s);
            assert!(now < kinetic.max(1e-9), "{cycle}: {now} {kinetic}");
            kinetic = now;
        }
    }
    assert!(kinetic < 1e-12, "{kinetic}");
}

#[test]
fn the_load_dependent_part_depends_on_load_and_direction_and_stays_within_its_fraction() {
    let friction = LuGre::from_friction(&LAW);
    assert_eq!(friction.load_fraction, 0.02);
    let share = |v: f64, load: f64| {
        let dry = |f: &LuGre, load| f.steady_torque_nm(v, load) - LAW.viscous_nm_s_per_rad * v;
        dry(&friction, load) / dry(&true_friction(), 0.0) - 1.0
    };
    assert!((share(0.5, 1.0) - 0.02).abs() < 1e-12);
    assert!((share(-0.5, 1.0) - 0.02 / 3.0).abs() < 1e-12);
    assert!((share(0.5, 0.5) - 0.01).abs() < 1e-12);
    assert_eq!(share(0.5, 0.0), 0.0);
}

#[test]
fn load_is_the_gravity_moment_relative_to_the_stretched_arm() {
    let arm = wam4();
    let load = |q: [f64; 4]| {
        let plant = Plant::new(PlantConfig::ideal(arm), Vector::from(q), Vector::zeros());
        plant.unwrap().load()
    };
    let half = core::f64::consts::FRAC_PI_2;
    let (level, upright) = (load([0.0, half, 0.0, 0.0]), load([0.0; 4]));
    for joint in 0..4 {
        assert!(level[joint] <= 1.0 && level[joint] > 0.5 * f64::from(u8::from(joint > 0)));
        assert!(upright[joint] < 0.2 * level[joint].max(0.3));
    }
    let turned = load([1.0, half, 0.0, 0.0]);
    assert!(
        (turned - level).norm() < 1e-12,
        "the same for every base angle"
    );
}
