//! The control step allocates nothing: a counting global allocator checks it.
#![allow(
    clippy::disallowed_methods,
    reason = "reference values use other mathematical functions"
)]

#[path = "../../../tests/support/counting.rs"]
mod counting;
mod support;

use counting::count_allocations;
use supple_core::codes::MODES;
use supple_core::config::Gains;
use supple_core::controller::{LearningSwitch, Mode, Request, SetPoint};
use supple_core::learned::{JointMap, LearnedParameters};
use supple_core::math::Vector3;
use supple_core::{Config, Vector};
use support::configs::{four, friction, seven, seven_active};
use support::rig::{Rig, bent, bent_wrist, probe_at};

/// Runs through the modes of the paper's experiments, a refusal and three kinds of fault.
fn step_allocates_nothing<const N: usize>(mut config: Config<N>) {
    config.friction = friction();
    let mut rig = Rig::new(config, bent());
    let mut modes = [false; 6];
    let count = count_allocations(|| {
        for k in 0..2000 {
            let mut input = rig.input();
            input.request = request(&rig, k);
            match k {
                1200 => input.tip_force_n = Some(Vector3::repeat(f64::NAN)),
                1500 | 1501 => input.position_rad[1] = None,
                1800 => input.cycle = 2,
                _ => {}
            }
            let output = rig.step(&input);
            modes[output.mode as usize] = true;
        }
    });
    assert_eq!(modes, [true; 6], "each of these modes was run");
    assert_eq!(count, 0);
}

fn request<const N: usize>(rig: &Rig<N>, cycle: u32) -> Option<Request<N>> {
    match cycle {
        5 | 1450 => Some(Request::GravityHold),
        300 => Some(Request::Move {
            target_rad: rig.q,
            duration_s: 0.1,
        }),
        301 => Some(Request::Gains {
            gains: Gains::isotropic(f64::NAN, 0.0),
            ramp_s: 0.0,
        }),
        600 => Some(Request::Track(probe_at(&rig.tip()))),
        900 => Some(rig.hold_tip_request()),
        910 | 915 => Some(Request::SetPoint(SetPoint {
            position_m: rig.tip(),
            velocity_m_per_s: Vector3::zeros(),
            acceleration_m_per_s2: Vector3::zeros(),
            at_cycle: rig.cycle + 20,
        })),
        1400 | 1700 => Some(Request::Reset),
        _ => None,
    }
}

/// Enters every mode with learning on and learned terms that come into force or are refused.
fn learning_in_every_mode_allocates_nothing<const N: usize>(config: Config<N>, q: Vector<N>) {
    let mut parameters = LearnedParameters::zero();
    parameters.payload_kg = 0.1;
    let mut map = JointMap::ZERO;
    map.torque_nm.fill(0.01);
    for mode in MODES {
        if mode == Mode::TrackPose && N < 6 {
            continue;
        }
        let mut rig = Rig::new(config, q);
        let mut learned = false;
        let count = count_allocations(|| {
            rig.bring_to(mode);
            rig.request(Request::Learning(LearningSwitch::On));
            rig.request(Request::LearnedParameters(parameters));
            rig.request(Request::LearnedMap { joint: 1, map });
            learned = rig.rest().torques.learned.amax() > 0.0;
        });
        assert_eq!(count, 0, "{mode:?}");
        assert_eq!(learned, mode.allows_learning(), "{mode:?}");
    }
}

#[test]
fn of_every_mode_with_learning() {
    learning_in_every_mode_allocates_nothing(four(), bent());
    learning_in_every_mode_allocates_nothing(seven_active(), bent_wrist());
}

#[test]
fn of_4_joints() {
    step_allocates_nothing(four());
}

#[test]
fn of_7_joints() {
    step_allocates_nothing(seven());
}

/// Checks that the counter itself works: it also counts the release.
#[test]
fn the_counter_counts_an_allocation() {
    let count = count_allocations(|| drop(std::hint::black_box(Box::new(Mode::Idle))));
    assert_eq!(count, 2);
}
