//! The move mode, term by term, and its end.

use crate::support::configs::{four, friction, seven, three, unlimited};
use crate::support::plant::{Plant, nothing};
use crate::support::rig::{Rig, bent};
use crate::support::{assert_close, size};
use supple_core::config::Role;
use supple_core::controller::{Mode, Request};
use supple_core::dynamics::{coriolis, crba, gravity};
use supple_core::{Config, Friction, Output, Vector};

const DURATION_S: f64 = 0.8;

fn target<const N: usize>(config: &Config<N>) -> Vector<N> {
    Vector::from_fn(|i, _| match config.roles[i] {
        Role::Active => bent::<N>()[i] + 0.2 - 0.1 * i as f64,
        Role::Held { position_rad, .. } => position_rad,
    })
}

/// Minimum jerk in joint space, by its polynomial: angles, speeds, accelerations at `time_s`.
fn planned<const N: usize>(displacement: &Vector<N>, time_s: f64) -> [Vector<N>; 3] {
    let x = (time_s / DURATION_S).min(1.0);
    let share = 10.0 * x.powi(3) - 15.0 * x.powi(4) + 6.0 * x.powi(5);
    let rate_per_s = (30.0 * x.powi(2) - 60.0 * x.powi(3) + 30.0 * x.powi(4)) / DURATION_S;
    let acceleration_per_s2 =
        (60.0 * x - 180.0 * x.powi(2) + 120.0 * x.powi(3)) / DURATION_S.powi(2);
    [
        bent::<N>() + displacement * share,
        displacement * rate_per_s,
        displacement * acceleration_per_s2,
    ]
}

/// Checks for model feed-forward along the reference and a stiff loop about it, without the loops
/// of held joints.
fn is_the_move<const N: usize>(config: &Config<N>, output: &Output<N>) {
    let displacement = target(config) - bent::<N>();
    let [position, velocity, acceleration] = planned(&displacement, output.mode_time_s);
    let (q, qd, torques) = (
        &output.position_rad,
        &output.velocity_rad_per_s,
        &output.torques,
    );
    let loops = config
        .move_gains
        .stiffness_nm_per_rad
        .component_mul(&(position - q))
        + config
            .move_gains
            .damping_nm_s_per_rad
            .component_mul(&(velocity - qd));
    assert_close(&torques.gravity, &gravity(&config.arm, q), 1e-10);
    assert_close(&torques.coriolis, &coriolis(&config.arm, q, qd), 1e-10);
    let inertial = crba(&config.arm, q) * acceleration;
    assert_close(&torques.inertial, &inertial, 1e-9);
    assert_close(&torques.joint_pd, &loops, 1e-8);
    let load_nm = gravity(&config.arm, q);
    let rubbing = Vector::<N>::from_fn(|i, _| {
        config.friction[i]
            .at_load(load_nm[i])
            .torque_nm(velocity[i])
    });
    assert_close(&torques.friction, &rubbing, 1e-9);
    for (name, torque) in torques.named() {
        let expected = [
            "gravity", "coriolis", "inertial", "joint_pd", "friction", "handover",
        ];
        assert!(expected.contains(&name) || size(torque) == 0.0, "{name}");
    }
    assert_close(&output.torque_nm, &torques.total(), 1e-9);
}

fn moves<const N: usize>(mut config: Config<N>) {
    unlimited(&mut config);
    config.friction = friction().map(|friction| Friction {
        load_coefficient: 0.08,
        coulomb_at_nm: 2.0,
        ..friction
    });
    config.handover_s = 0.05;
    let mut rig = Rig::holding(config, bent());
    let mut output = rig.accept(Request::Move {
        target_rad: target(&config),
        duration_s: DURATION_S,
    });
    let displacement = target(&config) - bent::<N>();
    for k in 0..1000_u32 {
        assert_eq!((output.mode, output.fault), (Mode::Move, None));
        is_the_move(&config, &output);
        // The arm follows with a small lag and noise, held joints too.
        let [position, ..] = planned(&displacement, 1e-3 * f64::from(k.saturating_sub(4)));
        rig.q = position.add_scalar(2e-3 * (0.02 * f64::from(k)).sin());
        output = rig.cycle();
    }
    assert_eq!(output.torques.handover, Vector::<N>::zeros());
}

#[test]
fn of_3_joints() {
    moves(three());
}

#[test]
fn of_4_joints() {
    moves(four());
}

#[test]
fn of_7_joints() {
    moves(seven());
}

/// With the arm in the loop and an exact model the move reaches its target and holds it.
#[test]
fn a_move_ends_at_its_target_and_holds_it() {
    let config = four();
    let mut rig = Rig::holding(config, bent());
    let mut plant = Plant::at_rest(config.arm, bent());
    let request = Request::Move {
        target_rad: target(&config),
        duration_s: DURATION_S,
    };
    rig.drive(&mut plant, Some(request), nothing);
    for k in 0..3000 {
        let output = rig.run(&mut plant);
        assert_eq!((output.mode, output.fault), (Mode::Move, None));
        if k > 2000 {
            let error = plant.q - target(&config);
            assert!(size(&error) < 1e-4, "{error} after {k} cycles");
        }
    }
}

/// The held roll joint has only the loop of the move, not a second one of its own.
#[test]
fn a_held_joint_has_one_loop_in_a_move() {
    let mut config = four();
    unlimited(&mut config);
    let mut rig = Rig::new(config, bent());
    rig.bring_to(Mode::Move);
    rig.q[2] = 0.01;
    let torque = rig.rest().torques.joint_pd[2];
    assert!((torque + 600.0 * 0.01).abs() < 1e-6, "{torque} N m");
}
