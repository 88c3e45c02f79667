//! An encoder whose sign is wrong from the middle of a motion on: the arm comes to rest or its drives brake.

use crate::support::configs::four;
use crate::support::plant::{Plant, nothing};
use crate::support::rig::{Rig, bent};
use supple_core::controller::{Fault, Request};
use supple_core::dynamics::inverse_kinematics::inverse_kinematics;
use supple_core::dynamics::jacobian;
use supple_core::trajectory::{Sinusoid, Trajectory};
use supple_core::{Output, Vector};

/// Time at which the sign changes, and from when on the arm must be slow after the fault \[cycles\].
const REVERSED: u64 = 500;
const SLOW_AFTER: u64 = 500;
/// Tip speed of an arm at rest \[m/s\].
const SLOW_M_PER_S: f64 = 0.25;

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
        // Drives that brake hold the arm: what follows does not depend on the controller.
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

/// Cycles from the reversal until the fault while the tip follows the paper's sinusoid, if there is one within 0.15 s, for a
/// reversal `before` cycles before the joint is fastest; what the encoder shows from then on, of the true angle since then.
fn named_after(joint: usize, before: u64, shown: impl Fn(f64) -> f64) -> Option<(Fault, u64)> {
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
    // With its ramp it passes its centre, fastest, after 4.5 s.
    let reversed = 4500 - before;
    let mut at_rad = 0.0;
    for cycle in 0..reversed + 150 {
        rig.q = plant.q;
        if cycle == reversed {
            at_rad = plant.q[joint];
        }
        if cycle >= reversed {
            rig.q[joint] = at_rad + shown(plant.q[joint] - at_rad);
        }
        let output = rig.cycle();
        if let Some(fault) = output.fault {
            return Some((fault, cycle - reversed));
        }
        plant.advance(&output.torque_nm, nothing, 1e-3, 4);
    }
    None
}

#[test]
fn a_reversal_while_tracking_is_named_soon() {
    for joint in [1, 3] {
        for before in [0, 100, 200] {
            let found = named_after(joint, before, |turned_rad| -turned_rad);
            assert!(
                matches!(found, Some((Fault::MotionAgainstTorque { joint: named, .. }, after))
                    if named == joint && after <= 60),
                "joint {joint}, {before} cycles before: {found:?}"
            );
        }
    }
}

/// What bounces has less than its speed afterwards. That an encoder which goes on so is wrong shows later, by another rule with a
/// lower limit.
#[test]
fn a_rebound_is_no_reversed_encoder() {
    for joint in [1, 3] {
        let found = named_after(joint, 0, |turned_rad| -0.5 * turned_rad);
        assert!(
            !matches!(found, Some((Fault::MotionAgainstTorque { limit_nm, .. }, _)) if limit_nm > 5.0),
            "joint {joint}: {found:?}"
        );
    }
}
