//! The step is a pure function: equal inputs give bit-identical outputs, and a copied state
//! continues identically.

use crate::support::configs::{four, friction, seven};
use crate::support::rig::{Rig, bent, probe_at};
use supple_core::config::Gains;
use supple_core::controller::Request;
use supple_core::math::Vector3;
use supple_core::{Config, Input, Output, State, Vector, step};

/// Inputs of a run through six modes: idle, gravity hold, move, probe, a fault, track.
fn script<const N: usize>(config: Config<N>) -> Vec<Input<N>> {
    let mut rig = Rig::new(config, bent());
    let mut inputs = Vec::new();
    for k in 0_u32..1200 {
        let t = 1e-3 * f64::from(k);
        rig.q = bent::<N>() + Vector::<N>::from_fn(|i, _| 2e-3 * (3.0 * t + i as f64).sin());
        let mut input = rig.input();
        input.tip_force_n = Some(Vector3::new(t.sin(), t.cos(), 0.1));
        input.request = match k {
            5 => Some(Request::GravityHold),
            200 => Some(Request::Move {
                target_rad: bent(),
                duration_s: 0.2,
            }),
            500 => Some(Request::Track(probe_at(&rig.tip()))),
            600 => Some(Request::Gains {
                gains: Gains::isotropic(25.0, 4.0),
                ramp_s: 0.1,
            }),
            1000 => Some(Request::Reset),
            1001 => Some(rig.hold_tip_request()),
            _ => None,
        };
        // A lost reply of an encoder, which the estimator bridges.
        if k % 97 == 3 {
            input.position_rad[1] = None;
        }
        // A force of the optional sensor that is not finite: the fault.
        if k == 900 {
            input.tip_force_n = Some(Vector3::repeat(f64::NAN));
        }
        rig.cycle += 1;
        inputs.push(input);
    }
    inputs
}

/// Every number of an output, bit for bit: Debug prints floats so that they parse to the same bits,
/// NaNs apart.
fn written<const N: usize>(output: &Output<N>) -> String {
    format!("{output:?}")
}

fn same_bits<const N: usize>(mut config: Config<N>) {
    config.friction = friction();
    let inputs = script(config);
    let run = |config: Config<N>| -> Vec<String> {
        let mut rig = Rig::new(config, bent());
        inputs
            .iter()
            .map(|input| written(&rig.step(input)))
            .collect()
    };
    let first = run(config);
    assert_eq!(first, run(config));
    for mode in ["Idle", "GravityHold", "Move", "Track", "Probe", "Fault"] {
        let entered = first
            .iter()
            .any(|text| text.contains(&format!("mode: {mode}")));
        assert!(entered, "the script reaches {mode}");
    }

    // Copied at any cycle, the copy and the original continue identically.
    let mut rig = Rig::new(config, bent());
    for (k, input) in inputs.iter().enumerate() {
        if k % 151 == 0 {
            let mut copy: State<N> = rig.state;
            for (later, expected) in inputs.iter().zip(&first).skip(k).take(40) {
                let output = step(&rig.controller, &mut copy, later);
                assert_eq!(&written(&output), expected);
            }
        }
        rig.step(input);
    }
}

#[test]
fn of_4_joints() {
    same_bits(four());
}

#[test]
fn of_7_joints() {
    same_bits(seven());
}

/// A controller depends on its own state alone: two alternating controllers do not affect each
/// other.
#[test]
fn alternating_controllers_are_independent() {
    let inputs = script(four());
    let (mut a, mut b) = (Rig::new(four(), bent()), Rig::new(four(), bent()));
    let alone: Vec<_> = inputs.iter().map(|input| a.step(input)).collect();
    let mut a = Rig::new(four(), bent());
    for (input, expected) in inputs.iter().zip(&alone) {
        assert_eq!(a.step(input), *expected);
        assert_eq!(b.step(input), *expected);
    }
}
