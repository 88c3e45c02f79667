//! An arm that rests beyond a position limit, for example because it has sunk with idle drives: it is not accelerated abruptly,
//! and it can move back.
//!
//! Criterion, fixed before the first run: from gravity hold, a reset or drives that come back, at any angle of the soft
//! zone and up to 0.1 rad beyond the limit, no joint is faster than 0.15 rad/s, no fault latches, and within 8 s the joint
//! is back at the edge of its zone, where its limit is that of the configuration.

use super::workspace::bordered;
use crate::support::configs::{four, three};
use crate::support::plant::{Plant, nothing, push};
use crate::support::property::{Outcome, check};
use crate::support::rig::{Rig, bent};
use proptest::prelude::*;
use supple_core::config::{Border, Collision, Config};
use supple_core::controller::{Fault, Mode, Request, SafeAction};
use supple_core::dynamics::tip_pose;
use supple_core::math::Vector3;
use supple_core::{Input, Vector};

const MAX_JOINT_RAD_PER_S: f64 = 0.15;
const CYCLES: usize = 8000;

/// Event after which the limits are enforced.
#[derive(Clone, Copy, Debug)]
enum Entry {
    GravityHold,
    Reset,
    DrivesBack,
}

/// An arm that rests at `q`, held by its brakes or by gravity compensation, with this request in the next cycle.
fn resting<const N: usize>(
    config: Config<N>,
    q: Vector<N>,
    entry: Entry,
) -> (Rig<N>, Option<Request<N>>) {
    let mut rig = Rig::new(config, q);
    rig.drives_active = false;
    rig.cycle();
    rig.accept(Request::GravityHold);
    if let Entry::DrivesBack = entry {
        rig.rest();
    }
    rig.drives_active = true;
    match entry {
        Entry::GravityHold | Entry::DrivesBack => (rig, None),
        Entry::Reset => {
            let output = rig.step(&Input {
                tip_force_n: Some(Vector3::repeat(f64::NAN)),
                ..rig.input()
            });
            assert_eq!(output.safe_action, Some(SafeAction::Stop));
            rig.rest();
            (rig, Some(Request::Reset))
        }
    }
}

fn beyond<const N: usize>(
    config: Config<N>,
    joint: usize,
    side: f64,
    beyond_rad: f64,
    entry: Entry,
) -> Outcome {
    let limit_rad = side * config.limits.position_upper_rad[joint];
    let edge_rad = limit_rad - side * config.limits.soft_zone_rad;
    let mut q = bent::<N>();
    q[joint] = limit_rad + side * beyond_rad;
    let (mut rig, mut request) = resting(config, q, entry);
    let mut plant = Plant::at_rest(config.arm, q);
    for cycle in 0..CYCLES {
        let output = rig.drive(&mut plant, request.take(), nothing);
        prop_assert_eq!(output.refusal, None);
        prop_assert_eq!(output.fault, None, "cycle {}", cycle);
        prop_assert!(
            plant.qd.amax() <= MAX_JOINT_RAD_PER_S,
            "{} rad/s in cycle {cycle}",
            plant.qd.amax()
        );
    }
    let left_rad = side * (plant.q[joint] - edge_rad);
    prop_assert!(left_rad < 0.02, "{left_rad} rad in the zone at the end");
    // From here on the limit is the configuration's.
    rig.q = plant.q;
    while side * rig.q[joint] <= side * limit_rad {
        rig.q[joint] += side * 1e-4;
        let output = rig.cycle();
        let within = side * rig.q[joint] <= side * limit_rad;
        let named = matches!(
            output.fault,
            Some(Fault::JointPosition { joint: named, limit_rad: at_rad, .. })
                if named == joint && at_rad == limit_rad
        );
        prop_assert!(
            if within {
                output.fault.is_none()
            } else {
                named
            },
            "{:?} at {}",
            output.fault,
            rig.q[joint]
        );
    }
    Ok(())
}

#[test]
fn a_joint_beyond_its_limit_moves_back_slowly() {
    let entries = prop_oneof![
        Just(Entry::GravityHold),
        Just(Entry::Reset),
        Just(Entry::DrivesBack)
    ];
    let case = (0..3_usize, any::<bool>(), -0.1..0.1_f64, entries);
    check(60, case, |(joint, above, beyond_rad, entry)| {
        let side = if above { 1.0 } else { -1.0 };
        beyond::<3>(three(), joint, side, beyond_rad, entry)?;
        // The shoulder roll is held elsewhere.
        let joint = [0, 1, 3][joint];
        beyond::<4>(four(), joint, side, beyond_rad, entry)?;
        // A gravity hold that keeps the pose moves its set-point with the joint.
        let config = Config {
            hold_pose: true,
            ..four()
        };
        beyond::<4>(config, joint, side, beyond_rad, entry)
    });
}

/// A joint that is pushed further out is a fault, like any joint beyond its limit.
#[test]
fn a_joint_beyond_its_limit_must_not_move_further_out() {
    for side in [1.0, -1.0] {
        let config = four();
        let mut q = bent::<4>();
        q[1] = side * (config.limits.position_upper_rad[1] + 0.01);
        let (mut rig, _) = resting(config, q, Entry::GravityHold);
        for k in 1..=199 {
            rig.q[1] = q[1] + side * 1e-4 * f64::from(k);
            assert_eq!(rig.cycle().fault, None, "{k}");
        }
        rig.q[1] = q[1] + side * 0.0201;
        let output = rig.cycle();
        assert!(
            matches!(output.fault, Some(Fault::JointPosition { joint: 1, .. })),
            "{:?}",
            output.fault
        );
        assert_eq!(output.mode, Mode::Fault);
    }
}

/// A tip that rests in the margin of a wall or beyond it is not accelerated abruptly.
#[test]
fn a_tip_beyond_a_border_moves_back_slowly() {
    for beyond_m in [-0.03, 0.0, 0.04, 0.2] {
        let mut config = four();
        config.collision = Collision::disabled();
        let tip_m = Rig::new(config, bent()).tip();
        config.workspace = bordered(Border::Wall {
            normal: Vector3::new(0.0, 0.0, -1.0),
            offset_m: -beyond_m - tip_m.z,
        });
        let (mut rig, mut request) = resting(config, bent(), Entry::GravityHold);
        let mut plant = Plant::at_rest(config.arm, bent());
        for cycle in 0..CYCLES {
            let output = rig.drive(&mut plant, request.take(), nothing);
            assert_eq!(output.fault, None, "{beyond_m} m, cycle {cycle}");
            let m_per_s = output.tip_velocity_m_per_s.norm();
            assert!(m_per_s < 0.15, "{beyond_m} m: {m_per_s} m/s in {cycle}");
        }
        let wanted_m = beyond_m + config.workspace.margin_m;
        let moved_m = rig.tip().z - tip_m.z;
        assert!(moved_m > wanted_m - 0.01, "{moved_m} of {wanted_m} m");
    }
}

/// Fixed before the run: a joint that is further beyond its limit than an arm can sink has a wrong angle and is a fault; so is
/// a joint that moves beyond its limit while its drives are idle for a cycle.
#[test]
fn a_joint_far_beyond_its_limit_or_moving_beyond_it_faults() {
    for (beyond_rad, faults) in [(0.09, false), (0.11, true), (1.0, true)] {
        let config = four();
        let mut q = bent::<4>();
        q[1] = config.limits.position_upper_rad[1] + beyond_rad;
        let (mut rig, _) = resting(config, q, Entry::GravityHold);
        let fault = rig.cycle().fault;
        assert_eq!(fault.is_some(), faults, "{beyond_rad} rad: {fault:?}");
    }
    let config = four();
    let limit_rad = config.limits.position_upper_rad[1];
    let mut q = bent::<4>();
    q[1] = limit_rad - 0.3;
    let mut rig = Rig::holding(config, q);
    let fault = (0..400).find_map(|k| {
        rig.q[1] += 1e-3;
        // At 1 rad/s, 0.03 rad before the limit.
        rig.drives_active = k != 270;
        rig.cycle().fault.map(|fault| (fault, rig.q[1]))
    });
    assert!(
        matches!(fault, Some((Fault::JointPosition { joint: 1, .. }, at_rad)) if at_rad < limit_rad + 0.0015),
        "{fault:?}"
    );
}

/// Fixed before the run: a hand moves a joint out of its zone within half a second, long before the edge would have returned.
/// From then on the soft stop is that of the configuration.
#[test]
fn the_edge_of_a_soft_zone_follows_a_joint_that_a_person_moves_back() {
    let config = four();
    let upper_rad = config.limits.position_upper_rad[1];
    let edge_rad = upper_rad - config.limits.soft_zone_rad;
    let depth_rad = 0.2 * config.limits.soft_zone_rad;
    let pushed_nm = -moved_out_and_in(
        config,
        1,
        [upper_rad + 0.05, edge_rad - 0.05, edge_rad + depth_rad],
    )[1];
    let spring_nm = config.limits.soft_stiffness_nm_per_rad[1] * depth_rad;
    assert!(
        (0.9..1.1).contains(&(pushed_nm / spring_nm)),
        "{pushed_nm} of {spring_nm} N m"
    );
}

/// The same for the margin of a workspace.
#[test]
fn a_margin_follows_a_tip_that_a_person_moves_back() {
    let mut config = four();
    let at_rad = bent::<4>()[1];
    let tip_m = |angle_rad: f64| {
        let mut q = bent::<4>();
        q[1] = angle_rad;
        tip_pose(&config.arm, &q).translation
    };
    let [beyond, outside, inside] = [at_rad, at_rad - 0.3, at_rad - 0.15];
    let towards = (tip_m(beyond) - tip_m(outside)).normalize();
    // The hand leaves the tip in the middle of the margin.
    let depth_m = 0.025;
    config.workspace = bordered(Border::Wall {
        normal: towards,
        offset_m: tip_m(inside).dot(&towards) + 0.05 - depth_m,
    });
    assert!(tip_m(beyond).dot(&towards) > tip_m(inside).dot(&towards) + 0.05 - depth_m);
    let torque_nm = moved_out_and_in(config, 1, [beyond, outside, inside]);
    let mut q = bent::<4>();
    q[1] = inside;
    let force_n = towards * (-config.workspace.stiffness_n_per_m * depth_m);
    let expected_nm = push(&config.arm, &q, &force_n);
    assert!(
        (torque_nm - expected_nm).norm() < 0.1 * expected_nm.norm(),
        "{torque_nm} instead of {expected_nm}"
    );
}

/// Torque of the soft stops after a hand has moved `joint` from the first of these angles, at which it rested, to the second and
/// third angle, in half a second each.
fn moved_out_and_in(config: Config<4>, joint: usize, angles_rad: [f64; 3]) -> Vector<4> {
    let mut config = config;
    config.collision = Collision::disabled();
    let mut q = bent::<4>();
    q[joint] = angles_rad[0];
    let (mut rig, _) = resting(config, q, Entry::GravityHold);
    assert!(rig.cycle().torques.soft_stop.norm() < 1.0, "thrown off");
    for [from_rad, to_rad] in [
        [angles_rad[0], angles_rad[1]],
        [angles_rad[1], angles_rad[2]],
    ] {
        for k in 1..=500 {
            rig.q[joint] = from_rad + (to_rad - from_rad) * f64::from(k) / 500.0;
            assert_eq!(rig.cycle().fault, None, "{}", rig.q[joint]);
        }
    }
    // The velocity estimate settles, so that the soft stops damp nothing.
    let output = rig.cycles(50);
    assert_eq!((output.mode, output.fault), (Mode::GravityHold, None));
    output.torques.soft_stop
}
