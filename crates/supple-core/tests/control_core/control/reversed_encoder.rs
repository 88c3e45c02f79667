//! An encoder whose sign is wrong from the middle of a motion on: the arm comes to rest or its drives brake.

use crate::support::configs::four;
use crate::support::plant::{Plant, nothing, push};
use crate::support::rig::{Rig, bent};
use supple_core::controller::{Fault, Request};
use supple_core::dynamics::inverse_kinematics::inverse_kinematics;
use supple_core::dynamics::{jacobian, tip_pose};
use supple_core::math::Vector3;
use supple_core::trajectory::{Sinusoid, Trajectory};
use supple_core::{Arm, Output, Vector};

/// Time at which the sign changes, and time after the fault from which on the arm must be slow \[cycles\].
const REVERSED: u64 = 500;
const SLOW_AFTER: u64 = 500;
/// Tip speed of an arm at rest \[m/s\].
const SLOW_M_PER_S: f64 = 0.25;
/// Ratio of damping to stiffness of a wall \[s\]: the tip keeps most of its speed.
const WALL_DAMPING_S: f64 = 2e-4;

/// Output, tip speed \[m/s\] and cycles since the fault, for each cycle of a move of the joint and two seconds more.
fn reversed(joint: usize) -> Vec<(Output<4>, f64, Option<u64>)> {
    let config = four();
    let mut rig = Rig::holding(config, bent());
    let mut plant = Plant::at_rest(config.arm, bent());
    let mut target_rad = bent::<4>();
    target_rad[joint] += 0.6;
    rig.request(Request::Move {
        target_rad,
        duration_s: 2.0,
    });
    let (mut fault, mut cycles) = (None, Vec::new());
    for cycle in 0..4000 {
        rig.q = plant.q;
        if cycle >= REVERSED {
            rig.q[joint] = -plant.q[joint];
        }
        let output = rig.cycle();
        // The brakes of the drives hold the arm, so the controller no longer affects the motion.
        if output.torque_off {
            plant.qd = Vector::zeros();
        } else {
            plant.advance(&output.torque_nm, nothing, 1e-3, 4);
        }
        let tip = jacobian(&config.arm, &plant.q).fixed_rows::<3>(0) * plant.qd;
        fault = fault.or(output.fault.map(|_| cycle));
        let since = fault.map(|fault| cycle - fault);
        cycles.push((output, tip.norm(), since));
    }
    cycles
}

#[test]
fn the_arm_comes_to_rest() {
    for joint in [0, 1, 3] {
        let cycles = reversed(joint);
        let since = cycles.last().and_then(|(_, _, since)| *since);
        assert!(
            since.is_some_and(|since| since > 2 * SLOW_AFTER),
            "no fault"
        );
        for (output, tip_m_per_s, since) in cycles {
            let slow = tip_m_per_s < SLOW_M_PER_S;
            assert!(
                slow || since.is_none_or(|since| since < SLOW_AFTER),
                "joint {joint}: {tip_m_per_s} m/s in {:?}, {since:?} ms after the fault",
                output.mode
            );
        }
    }
}

/// Fault while the tip follows the paper's sinusoid, and cycles from the event until then; `None` if there is no fault within
/// 0.15 s. The event is `before` cycles before the tip passes the centre with its maximum speed. From then on the encoder of
/// `joint` measures the fraction `shown` of the further rotation, and `wall_n_per_m` is the stiffness of a wall at the centre.
/// The second value is whether the measured motion of the joint reversed.
fn fault_after(
    joint: usize,
    before: u64,
    shown: impl Fn(f64) -> f64,
    wall_n_per_m: f64,
) -> (Option<(Fault, u64)>, bool) {
    let mut config = four();
    config.plausible.against_share = 0.05;
    config.estimator_rad_per_s = 500.0;
    let seed = Vector::<4>::new(0.0, 0.4, 0.0, 1.4);
    let sinusoid = Sinusoid::paper(1.0);
    let start = inverse_kinematics(
        &config.arm,
        &config.roles,
        &config.limits,
        &seed,
        &sinusoid.centre_m,
    );
    let mut rig = Rig::holding(config, start.position_rad);
    let mut plant = Plant::at_rest(config.arm, start.position_rad);
    rig.accept(Request::Track(Trajectory::Sinusoid(sinusoid)));
    // With the ramp, the tip passes the centre with its maximum speed after 4.5 s.
    let reversed = 4500 - before;
    let (mut at_rad, mut before_rad_per_s, mut turned_round) = (0.0, 0.0, false);
    for cycle in 0..reversed + 150 {
        rig.q = plant.q;
        if cycle == reversed {
            (at_rad, before_rad_per_s) = (plant.q[joint], plant.qd[joint]);
        }
        if cycle >= reversed {
            rig.q[joint] = at_rad + shown(plant.q[joint] - at_rad);
        }
        let output = rig.cycle();
        turned_round |= output.velocity_rad_per_s[joint] * before_rad_per_s < 0.0;
        if let Some(fault) = output.fault {
            return (Some((fault, cycle - reversed)), turned_round);
        }
        let wall = |arm: &Arm<4>, q: &Vector<4>, qd: &Vector<4>| {
            let depth_m = sinusoid.centre_m.x - tip_pose(arm, q).translation.x;
            let closing_m_per_s = -(jacobian(arm, q).fixed_rows::<3>(0) * qd).x;
            let force_n = wall_n_per_m * (depth_m + WALL_DAMPING_S * closing_m_per_s);
            let touches = depth_m > 0.0 && force_n > 0.0;
            push(
                arm,
                q,
                &Vector3::new(if touches { force_n } else { 0.0 }, 0.0, 0.0),
            )
        };
        plant.advance(&output.torque_nm, wall, 1e-3, 8);
    }
    (None, turned_round)
}

#[test]
fn a_reversed_encoder_while_tracking_is_detected_soon() {
    for joint in [1, 3] {
        for before in [0, 100, 200] {
            let (found, _) = fault_after(joint, before, |turned_rad| -turned_rad, 0.0);
            assert!(
                matches!(found, Some((Fault::MotionAgainstTorque { joint: named, .. }, after))
                    if named == joint && after <= 60),
                "joint {joint}, {before} cycles before: {found:?}"
            );
        }
    }
}

/// Returns whether the test for sudden reversals has detected the fault: its limit is six times that of the other test, 4 N m for
/// this arm.
fn is_sudden_reversal(found: Option<(Fault, u64)>) -> bool {
    matches!(found, Some((Fault::MotionAgainstTorque { limit_nm, .. }, _)) if limit_nm > 5.0)
}

/// An encoder that continues with the opposite sign and half of the speed is detected later, by the other test.
#[test]
fn a_joint_that_returns_with_half_of_its_speed_is_no_reversed_encoder() {
    for joint in [1, 3] {
        let (found, turned_round) = fault_after(joint, 0, |turned_rad| -0.5 * turned_rad, 0.0);
        assert!(turned_round, "joint {joint}");
        assert!(!is_sudden_reversal(found), "joint {joint}: {found:?}");
    }
}

/// Fixed before the run: if the tip hits a hard wall at its maximum speed and rebounds with most of it, no reversed encoder is
/// reported.
#[test]
fn a_rebound_from_a_wall_is_no_reversed_encoder() {
    for wall_n_per_m in [5e3, 2e4, 1e5] {
        let (found, turned_round) = fault_after(3, 20, |turned_rad| turned_rad, wall_n_per_m);
        assert!(turned_round, "no contact");
        assert!(!is_sudden_reversal(found), "{wall_n_per_m} N/m: {found:?}");
    }
}

/// Fault if friction opposes joint 1 with `friction_nm` \[N m\] while it speeds up by this much
/// \[rad/s^2\] for half a second, guided by a person.
fn guided(friction_nm: f64, acceleration_rad_per_s2: f64) -> Option<Fault> {
    let mut config = four();
    config.plausible.against_share = 0.05;
    for friction in &mut config.friction {
        (friction.coulomb_nm, friction.breakaway_nm) = (friction_nm, friction_nm);
    }
    let mut rig = Rig::holding(config, bent());
    let mut speed_rad_per_s = 0.0;
    (0..500).find_map(|_| {
        speed_rad_per_s += acceleration_rad_per_s2 * 1e-3;
        rig.q[0] += speed_rad_per_s * 1e-3;
        rig.cycle().fault
    })
}

/// A hand that guides a joint slowly overcomes its friction; a faster acceleration against the joint's torque is not caused by a
/// hand.
#[test]
fn a_hand_that_guides_against_friction_is_no_reversed_encoder() {
    let limit_nm = 0.05 * four().limits.joint_torque_nm[0];
    assert_eq!(guided(2.0 * limit_nm, 0.1), None);
    let fault = guided(2.0 * limit_nm, 10.0);
    assert!(
        matches!(fault, Some(Fault::MotionAgainstTorque { joint: 0, .. })),
        "{fault:?}"
    );
}
