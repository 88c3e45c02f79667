//! An encoder whose sign is wrong from the middle of a move on: the arm comes to rest or its drives brake.

use crate::support::configs::four;
use crate::support::plant::{Plant, nothing};
use crate::support::rig::{Rig, bent};
use supple_core::controller::Request;
use supple_core::dynamics::jacobian;
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
