//! Idle and gravity hold, term by term; soft stops; held joints.

use crate::support::configs::{four, friction, rate_limited, seven, three, unlimited};
use crate::support::property::{check, per_joint};
use crate::support::rig::{Rig, bent};
use crate::support::{assert_close, size};
use proptest::prelude::*;
use supple_core::config::{Limits, Role};
use supple_core::controller::{Mode, Request, limit_torque};
use supple_core::dynamics::gravity;
use supple_core::{Config, Output, Vector};

/// Expected soft stop: a spring from the zone's edge, and a damper against motion further into the
/// zone that grows with the depth.
fn soft_stop<const N: usize>(limits: &Limits<N>, q: &Vector<N>, qd: &Vector<N>) -> Vector<N> {
    Vector::from_fn(|i, _| {
        let edges = [
            (limits.position_lower_rad[i] + limits.soft_zone_rad, 1.0),
            (limits.position_upper_rad[i] - limits.soft_zone_rad, -1.0),
        ];
        edges.into_iter().fold(0.0, |sum, (edge, inwards)| {
            let depth = inwards * (edge - q[i]);
            let approach = -inwards * qd[i];
            if depth <= 0.0 {
                return sum;
            }
            let spring = limits.soft_stiffness_nm_per_rad[i] * depth;
            let share = (depth / limits.soft_zone_rad).min(1.0);
            let damper = limits.soft_damping_nm_s_per_rad[i] * share * approach.max(0.0);
            sum + inwards * (spring + damper)
        })
    })
}

/// Checks that the torque consists of gravity, joint damping, loops of held joints and soft stops
/// only.
#[track_caller]
fn is_gravity_hold<const N: usize>(config: &Config<N>, output: &Output<N>) {
    let (q, qd) = (&output.position_rad, &output.velocity_rad_per_s);
    let torques = &output.torques;
    assert_close(&torques.gravity, &gravity(&config.arm, q), 1e-11);
    assert_close(&torques.soft_stop, &soft_stop(&config.limits, q, qd), 1e-9);
    for (i, role) in config.roles.iter().enumerate() {
        match role {
            Role::Active => {
                let damping = -config.hold_damping_nm_s_per_rad[i] * qd[i];
                assert_eq!((torques.damping[i], torques.joint_pd[i]), (damping, 0.0));
            }
            Role::Held {
                position_rad,
                stiffness_nm_per_rad,
                damping_nm_s_per_rad,
            } => {
                // The set-point has reached the held angle.
                let pd =
                    stiffness_nm_per_rad * (position_rad - q[i]) - damping_nm_s_per_rad * qd[i];
                assert!((torques.joint_pd[i] - pd).abs() < 1e-9);
                assert_eq!(torques.damping[i], 0.0);
            }
        }
    }
    for (name, torque) in torques.named() {
        let expected = ["gravity", "damping", "joint_pd", "soft_stop"].contains(&name);
        assert!(expected || size(torque) == 0.0, "{name} in gravity hold");
    }
    assert_close(&output.torque_nm, &torques.total(), 1e-9);
    assert_eq!(output.reference, None);
}

fn gravity_hold<const N: usize>(mut config: Config<N>) {
    unlimited(&mut config);
    // Without a reference motion there is no friction feed-forward.
    config.friction = friction();
    let reach = config.limits.position_upper_rad;
    let speeds = per_joint::<N>(0.5);
    check(20, (per_joint::<N>(0.95), speeds), |(share, speed)| {
        let start = reach.component_mul(&share);
        let mut start = start;
        for (i, role) in config.roles.iter().enumerate() {
            if *role != Role::Active {
                start[i] = 0.0;
            }
        }
        let mut rig = Rig::holding(config, start);
        for k in 0..40 {
            rig.q = start + speed * (1e-3 * f64::from(k));
            let output = rig.cycle();
            prop_assert_eq!((output.fault, output.mode), (None, Mode::GravityHold));
            if rig.state.mode() == Mode::GravityHold {
                is_gravity_hold(&config, &output);
            }
        }
        Ok(())
    });
}

#[test]
fn gravity_hold_of_3_joints() {
    gravity_hold(three());
}

#[test]
fn gravity_hold_of_4_joints() {
    gravity_hold(four());
}

#[test]
fn gravity_hold_of_7_joints() {
    gravity_hold(seven());
}

#[test]
fn idle_has_no_torque_and_no_fallback() {
    let mut rig = Rig::new(four(), bent());
    for _ in 0..20 {
        let output = rig.cycle();
        assert_eq!(output.torque_nm, Vector::<4>::zeros());
        assert_eq!(output.torques.total(), Vector::<4>::zeros());
        assert_eq!(output.fallback_torque_nm, Vector::<4>::zeros());
    }
    // Idle does not oppose external motion and does not check speeds and stops.
    for _ in 0..100 {
        rig.q[0] += 0.03;
        let output = rig.cycle();
        assert_eq!(
            (output.torque_nm, output.fault),
            (Vector::<4>::zeros(), None)
        );
    }
}

/// From idle the gravity torque rises at the rate limit, without blending.
#[test]
fn gravity_torque_rises_at_the_rate_limit() {
    let mut rig = Rig::new(four(), bent());
    let mut last = rig.cycle().torque_nm;
    let mut output = rig.accept(Request::GravityHold);
    let target = output.torques.gravity;
    let cycles = (target.amax() / 1000.0 / 1e-3).ceil() as usize;
    assert!(cycles > 5);
    for _ in 0..cycles {
        assert_eq!(output.torques.handover, Vector::<4>::zeros());
        let expected = rate_limited(&four(), &last, &target);
        assert_close(&output.torque_nm, &expected, 1e-9);
        assert_eq!(output.rate_limited, size(&(expected - target)) > 1e-9);
        last = output.torque_nm;
        output = rig.cycle();
    }
    assert_close(&output.torque_nm, &target, 1e-12);
}

/// On a change to idle the torque falls at the rate limit.
#[test]
fn torque_falls_to_idle_at_the_rate_limit() {
    let mut rig = Rig::holding(four(), bent());
    let before = rig.cycle().torque_nm;
    let output = rig.request(Request::Idle);
    assert_eq!(output.fallback_torque_nm, Vector::<4>::zeros());
    let expected = rate_limited(&four(), &before, &Vector::zeros());
    assert_close(&output.torque_nm, &expected, 1e-9);
    assert_eq!(output.torques.total(), Vector::<4>::zeros());
    assert_eq!(rig.rest().torque_nm, Vector::<4>::zeros());
}

#[test]
fn the_fallback_is_gravity_within_the_limits() {
    let mut config = four();
    config.limits.joint_torque_nm[1] = 9.0;
    let mut rig = Rig::holding(config, bent());
    let output = rig.cycle();
    let (allowed, limited) = limit_torque(
        &config.limits,
        rig.controller.motors(),
        &gravity(&config.arm, &rig.q),
    );
    assert!(limited, "the limit is below the weight");
    assert_close(&output.fallback_torque_nm, &allowed, 1e-12);
}

/// The soft stop is continuous at the zone's edge, pushes away from the stop, and does not damp
/// motion out of the zone.
#[test]
fn soft_stops_push_away() {
    let mut config = four();
    config.limits.joint_tracking_error_rad = f64::MAX;
    // The delay allows the roll joint, which has little inertia, no more damping in all of these poses.
    config.limits.soft_damping_nm_s_per_rad[2] = 5.0;
    config.roles[2] = Role::Held {
        position_rad: 0.0,
        stiffness_nm_per_rad: 600.0,
        damping_nm_s_per_rad: 0.2,
    };
    let limits = config.limits;
    for joint in 0..4 {
        for side in [1.0, -1.0] {
            let edge = side * (limits.position_upper_rad[joint] - limits.soft_zone_rad);
            let torque = |beyond: f64, speed: f64| {
                let mut q = bent::<4>();
                q[2] = 0.0;
                q[joint] = edge - side * 0.08;
                let mut rig = Rig::holding(config, q);
                // To the start of the motion, at 0.2 rad/s: an arm that starts in the zone is pushed less.
                let start = edge + side * (beyond - 0.08 * speed);
                while (rig.q[joint] - start).abs() > 2e-4 {
                    rig.q[joint] += (start - rig.q[joint]).clamp(-2e-4, 2e-4);
                    assert_eq!(rig.cycle().fault, None);
                }
                rig.q[joint] = start;
                rig.rest();
                for _ in 0..80 {
                    rig.q[joint] += side * speed * 1e-3;
                    assert_eq!(rig.cycle().fault, None);
                }
                let output = rig.cycle();
                (side * output.torques.soft_stop[joint], output)
            };
            assert_eq!(torque(-1e-9, 0.0).0, 0.0, "outside");
            assert!((torque(1e-9, 0.0).0 + 300e-9).abs() < 1e-9, "at the edge");
            assert!((torque(0.05, 0.0).0 + 15.0).abs() < 1e-9, "in the middle");
            let (entering, _) = torque(0.05, 0.3);
            let damping = limits.soft_damping_nm_s_per_rad[joint];
            let damped = -15.0 - 0.9 * 0.5 * damping * 0.3;
            assert!(entering < damped, "a damper on the way in, {entering}");
            let (leaving, output) = torque(0.05, -0.3);
            assert!(
                (leaving + 15.0).abs() < 0.5,
                "none on the way out, {leaving}"
            );
            assert!(side * output.velocity_rad_per_s[joint] < -0.1);
        }
    }
}

/// Beyond the stop itself the spring grows no further: such an angle may be invalid.
#[test]
fn a_soft_stop_pushes_no_harder_beyond_the_stop() {
    let mut rig = Rig::holding(four(), bent());
    let max = 300.0 * 0.1;
    for k in 0..4000 {
        rig.q[0] += 1e-3;
        let output = rig.cycle();
        let pushed = output.torques.soft_stop[0].abs();
        let damped = 10.0 * output.velocity_rad_per_s[0].abs();
        assert!(pushed <= max + damped + 1e-9, "{pushed} N m after {k}");
    }
    let output = rig.rest();
    assert_eq!(output.torques.soft_stop[0], 0.0, "no stiff loop in a fault");
    assert!(output.position_rad[0] > 4.0 && output.mode == Mode::Fault);
}

/// Set-point of the roll joint, computed from the torque of its loop.
fn set_point(output: &Output<4>) -> f64 {
    let pd = output.torques.joint_pd[2] + 10.0 * output.velocity_rad_per_s[2];
    output.position_rad[2] + pd / 600.0
}

/// The loop of a held joint engages without a jump: its set-point starts at the current angle and
/// moves to the held angle at 0.25 rad/s.
#[test]
fn held_set_point_approaches_slowly_from_the_current_angle() {
    for start in [0.7, -0.4, 1e-4, 0.0] {
        for entering_at in [0, 1, 20] {
            let mut q = bent::<4>();
            q[2] = start;
            // The arm of this rig does not move.
            let mut config = four();
            config.limits.joint_tracking_error_rad = 1.0;
            let mut rig = Rig::new(config, q);
            for _ in 0..entering_at {
                rig.cycle();
            }
            let mut output = rig.accept(Request::GravityHold);
            for k in 0..4000 {
                let travel = 0.25e-3 * f64::from(k + u32::from(entering_at > 0));
                let expected = start.signum() * (start.abs() - travel).max(0.0);
                let found = set_point(&output);
                assert!(
                    (found - expected).abs() < 1e-9,
                    "{found} is not {expected} after {k} cycles, entered at {entering_at}"
                );
                output = rig.cycle();
            }
        }
    }
}

/// While the loop is off, the set-point follows the joint.
#[test]
fn a_joint_moved_in_idle_is_held_from_its_new_angle() {
    let mut rig = Rig::holding(four(), bent());
    rig.request(Request::Idle);
    rig.rest();
    for _ in 0..500 {
        rig.q[2] += 1e-3;
        rig.cycle();
    }
    rig.rest();
    let output = rig.accept(Request::GravityHold);
    assert!((set_point(&output) - rig.q[2]).abs() < 1e-3);
    assert!(output.torques.joint_pd[2].abs() < 0.5);
}

/// With compliance the law uses the angles of the links, which gravity deflects from the encoder angles.
#[test]
fn joints_with_soft_loops_sag_under_gravity() {
    fn hangs<const N: usize>(config: Config<N>) {
        let config = Config {
            compliance_rad_per_nm: Vector::repeat(3e-4),
            ..config
        };
        let mut rig = Rig::holding(config, bent());
        let output = rig.cycle();
        let weight = gravity(&config.arm, &output.position_rad);
        assert_close(&(rig.q - weight * 3e-4), &output.position_rad, 1e-9);
        assert_close(&output.torques.gravity, &weight, 1e-9);
        assert_eq!(output.fault, None);
    }
    hangs(three());
    hangs(four());
    hangs(seven());
}
