//! A joint that oscillates with growing speed is a fault before it is fast; other oscillations are no fault.

use crate::support::configs::four;
use crate::support::plant::{Plant, nothing};
use crate::support::rig::{Rig, bent};
use std::collections::VecDeque;
use std::f64::consts::TAU;
use supple_core::controller::{Fault, SafeAction};
use supple_core::{Output, Vector};
use supple_random::Random;

/// Simulates the arm in gravity hold after an impact of 0.02 rad/s, with torques that are delayed by this much more than in the
/// configuration. Returns the output at the first fault within 4 s, and the kinetic energy \[J\].
fn late(cycles: usize) -> Option<(Output<4>, f64)> {
    let config = four();
    let mut rig = Rig::holding(config, bent());
    let mut plant = Plant::at_rest(config.arm, bent());
    let mut pending = VecDeque::from(vec![rig.cycle().torque_nm; cycles]);
    plant.qd[2] += 0.02;
    for _ in 0..4000 {
        rig.q = plant.q;
        let output = rig.cycle();
        if output.fault.is_some() {
            let mass_matrix = supple_core::dynamics::crba(&config.arm, &plant.q);
            return Some((output, 0.5 * plant.qd.dot(&(mass_matrix * plant.qd))));
        }
        pending.push_back(output.torque_nm);
        let acting = pending.pop_front().expect("a torque for each cycle");
        plant.advance(&acting, nothing, 1e-3, 4);
    }
    None
}

#[test]
fn torques_that_come_late_are_a_fault_before_the_arm_is_fast() {
    let most = four().limits.joint_speed_rad_per_s;
    for cycles in [8, 10, 12] {
        let (output, energy_j) = late(cycles).expect("a fault");
        let fault = output.fault.expect("a fault");
        let Fault::Oscillation {
            joint,
            value_rad_per_s,
            limit_rad_per_s,
        } = fault
        else {
            panic!("{cycles}: {fault}");
        };
        assert!(value_rad_per_s > limit_rad_per_s && value_rad_per_s < 0.6 * most[joint]);
        assert!(energy_j < 0.1, "{cycles}: {energy_j} J");
        assert_eq!(fault.safe_action(), SafeAction::Brake);
    }
    assert!(late(0).is_none());
}

/// Returns whether an oscillation of joint 3 with this frequency and first peak, which grows by this factor in each swing, is a
/// fault.
fn is_fault(frequency_hz: f64, peak_rad_per_s: f64, growth: f64) -> bool {
    let mut rig = Rig::holding(four(), bent());
    let start_s = 20e-3;
    for cycle in 0..800 {
        let time_s = 1e-3 * f64::from(cycle);
        let swings = 2.0 * frequency_hz * (time_s - start_s).max(0.0);
        let amplitude_rad = peak_rad_per_s * growth.powf(swings) / (TAU * frequency_hz);
        if amplitude_rad * TAU * frequency_hz > 0.6 {
            break;
        }
        let phase = TAU * frequency_hz * (time_s - start_s).max(0.0);
        rig.q = bent() + Vector::from([0.0, 0.0, 0.0, amplitude_rad * (1.0 - phase.cos())]);
        match rig.cycle().fault {
            None => {}
            Some(Fault::Oscillation { joint: 3, .. }) => return true,
            Some(other) => panic!("{frequency_hz} Hz, {growth}: {other}"),
        }
    }
    false
}

#[test]
fn only_quick_swings_that_grow_are_a_fault() {
    for frequency_hz in [8.0, 10.0, 14.0] {
        assert!(is_fault(frequency_hz, 0.1, 1.15), "{frequency_hz} Hz");
        assert!(!is_fault(frequency_hz, 0.4, 0.9), "{frequency_hz} Hz");
        assert!(
            !is_fault(frequency_hz, 0.05, 1.01),
            "{frequency_hz} Hz, slow"
        );
    }
    for frequency_hz in [2.0, 4.0, 6.0] {
        assert!(!is_fault(frequency_hz, 0.1, 1.15), "{frequency_hz} Hz");
    }
}

/// Encoder noise at rest appears as small oscillations that may grow by chance; a joint that then begins to move does not
/// oscillate.
#[test]
fn a_joint_that_starts_to_move_after_noise_at_rest_is_no_growing_oscillation() {
    let (count_rad, rest_cycles) = (1e-3, 150);
    for seed in 0..100 {
        let mut rig = Rig::holding(four(), bent());
        let mut random = Random::new(seed);
        for cycle in 0..rest_cycles + 40 {
            let count = match cycle < rest_cycles {
                true => (1.1 * random.signed()).trunc(),
                false => 0.0,
            };
            let moving_s = 1e-3 * f64::from((cycle - rest_cycles).max(0));
            let moved = (15.0 * moving_s * moving_s / count_rad).round();
            let angle_rad = (moved + count) * count_rad;
            rig.q = bent() + Vector::from([0.0, 0.0, 0.0, angle_rad]);
            let output = rig.cycle();
            assert!(
                output.fault.is_none(),
                "{seed}, {cycle}: {:?}",
                output.fault
            );
        }
    }
}
