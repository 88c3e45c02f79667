//! Invariants under random requests and measurements for `SUPPLE_CYCLES` cycles (default 150,000;
//! 10 million in `./ci.sh cycles`), on a simulated arm that is pushed at random.
//!
//! Every cycle: torques finite, within the limits of joints, motors and rate; a fault is reported
//! exactly in mode fault, and stays until a reset; in a fault no term is stiff or fed forward;
//! modes change only as documented in `Mode`.
#![allow(
    clippy::disallowed_methods,
    reason = "reference values use other mathematical functions"
)]

#[path = "../support/mod.rs"]
mod support;

mod simulated_arm;

use simulated_arm::SimulatedArm;
use std::collections::BTreeMap;
use supple_core::config::{ApparentInertia, Role};
use supple_core::controller::{Mode, Request};
use supple_core::math::Matrix3;
use supple_core::{Config, Input, Output, Vector};
use support::configs::{four, seven, seven_active, three};
use support::random::Random;

/// Cycles after which the arm restarts in another pose.
const EPISODE: u64 = 2_000;
/// Time in which the safe action may ramp a joint from full torque to zero \[s\].
const STOP_TORQUE_S: f64 = 0.005;
/// Stiffness and feed-forward terms: none of them acts in a fault.
const STIFF_TERMS: [&str; 7] = [
    "friction",
    "jacobian_rate",
    "inertial",
    "stiffness",
    "force",
    "nullspace",
    "joint_pd",
];

/// Number of cycles for each of the three arms.
fn cycles() -> u64 {
    let all = std::env::var("SUPPLE_CYCLES").ok();
    let all = all.map(|all| all.parse().expect("SUPPLE_CYCLES is a whole number"));
    all.unwrap_or(150_000_u64).div_ceil(3)
}

fn survive<const N: usize>(mut config: Config<N>, seed: u64) {
    config.limits.stale_cycles = 6;
    config.limits.start_error_m = 2.0;
    let mut random = Random::new(seed);
    let mut seen = BTreeMap::<&str, u64>::new();
    let mut faults = BTreeMap::<&str, u64>::new();
    let mut left = cycles();
    while left > 0 {
        let mut simulated = SimulatedArm::new(config, &mut random);
        let mut last = simulated.begin();
        for _ in 0..left.min(EPISODE) {
            let input = simulated.input(&mut random, &last);
            let output = simulated.step(&input);
            let torque = Sums::of(&output);
            assert_limits(&simulated, &last, &output);
            assert_modes(&last, &input, &output, &torque);
            if let (Some(fault), None) = (&output.fault, &last.fault) {
                *faults.entry(fault.name()).or_default() += 1;
            }
            *seen.entry(output.mode.name()).or_default() += 1;
            simulated.advance(&output, &mut random);
            last = output;
        }
        left -= left.min(EPISODE);
    }
    let active = config.roles.iter().filter(|role| **role == Role::Active);
    let has_pose = active.count() >= 6;
    for mode in supple_core::codes::MODES {
        if mode == Mode::TrackPose && !has_pose {
            assert_eq!(seen.get(mode.name()), None);
            continue;
        }
        let count = seen.get(mode.name()).copied().unwrap_or_default();
        assert!(
            count > cycles() / 2_000,
            "{mode:?} was hardly reached: {seen:?}"
        );
    }
    assert!(faults.len() >= 6, "few faults came: {faults:?}");
}

/// Largest entry of each term.
struct Sums(Vec<(&'static str, f64)>);

impl Sums {
    fn of<const N: usize>(output: &Output<N>) -> Sums {
        let named = output.torques.named();
        Sums(
            named
                .iter()
                .map(|(name, torque)| (*name, torque.amax()))
                .collect(),
        )
    }

    fn get(&self, wanted: &str) -> f64 {
        let found = self.0.iter().find(|(name, _)| *name == wanted);
        found.expect("a term of this name").1
    }
}

fn assert_limits<const N: usize>(
    simulated: &SimulatedArm<N>,
    last: &Output<N>,
    output: &Output<N>,
) {
    let controller = &simulated.rig.controller;
    let config = controller.config();
    let limits = &config.limits;
    let motors = controller.motors().motor_torque_nm(&output.torque_nm);
    let within = |value: f64, limit: f64| value.abs() <= limit * (1.0 + 1e-12);
    for i in 0..N {
        let (torque, fallback) = (output.torque_nm[i], output.fallback_torque_nm[i]);
        assert!(within(torque, limits.joint_torque_nm[i]), "{output:?}");
        assert!(within(fallback, limits.joint_torque_nm[i]), "{output:?}");
        assert!(within(motors[i], limits.motor_torque_nm[i]), "{output:?}");
        let mut rate = limits.torque_rate_nm_per_s[i];
        if output.fault.is_some() {
            rate = rate.max(limits.joint_torque_nm[i] / STOP_TORQUE_S);
        }
        let step = (torque - last.torque_nm[i]).abs();
        // The one exception: a torque that is not finite is dropped, not ramped.
        let dropped = torque == 0.0;
        assert!(
            step <= rate * config.period_s * (1.0 + 1e-9) || dropped,
            "{output:?}"
        );
    }
    for gain in output.gains.stiffness_n_per_m.iter() {
        assert!(gain.is_finite() && *gain >= 0.0);
    }
    for gain in output.gains.damping_n_s_per_m.iter() {
        assert!(gain.is_finite() && *gain >= 0.0);
    }
    assert!((0.0..=1.0).contains(&output.friction_share));
}

fn assert_modes<const N: usize>(
    last: &Output<N>,
    input: &Input<N>,
    output: &Output<N>,
    torque: &Sums,
) {
    let describe = || {
        format!(
            "{:?} to {:?} by {input:?}: {output:?}",
            last.mode, output.mode
        )
    };
    assert_eq!(
        output.mode == Mode::Fault,
        output.fault.is_some(),
        "{}",
        describe()
    );
    let fresh = input.cycle != last.cycle;
    let bad = input.position_rad.iter().flatten().any(|x| !x.is_finite());
    assert!(
        !(bad && fresh) || output.mode == Mode::Fault,
        "{}",
        describe()
    );
    assert!(
        output.refusal.is_none() || input.request.is_some(),
        "{}",
        describe()
    );
    if output.fault.is_some() {
        for term in STIFF_TERMS {
            assert_eq!(
                torque.get(term),
                0.0,
                "{term} acts in a fault: {}",
                describe()
            );
        }
    }
    let request = input.request.as_ref().filter(|_| output.refusal.is_none());
    let documented = match (last.mode, output.mode) {
        (_, Mode::Fault) => true,
        (Mode::Fault, Mode::Idle | Mode::GravityHold) => matches!(request, Some(Request::Reset)),
        (Mode::Fault, _) => false,
        (from, to) if from == to => true,
        (_, Mode::Idle) => matches!(request, Some(Request::Idle)),
        // A completed breakaway ends in gravity hold; so does every activity while the drives are
        // idle.
        (from, Mode::GravityHold) => {
            let torque_released = from != Mode::Idle && simulated_arm::drives_are_idle(input);
            matches!(request, Some(Request::GravityHold))
                || from == Mode::Breakaway
                || torque_released
        }
        (Mode::Idle, _) => false,
        (_, Mode::Move) => matches!(request, Some(Request::Move { .. })),
        // Set-points change no mode.
        (_, Mode::Track | Mode::Probe) => matches!(request, Some(Request::Track(_))),
        (_, Mode::Excite) => matches!(request, Some(Request::Excite(_))),
        (_, Mode::Breakaway) => matches!(request, Some(Request::Breakaway(_))),
        (_, Mode::Float) => matches!(request, Some(Request::Float)),
        (_, Mode::TrackPose) => matches!(request, Some(Request::TrackPose { .. })),
        (_, Mode::JointImpedance) => matches!(request, Some(Request::JointImpedance { .. })),
    };
    assert!(documented, "{}", describe());
}

#[test]
fn three_joints_and_a_force_sensor() {
    let mut config = three();
    config.law.inertia = ApparentInertia::Chosen(Matrix3::from_diagonal_element(2.0));
    survive(config, 3);
}

#[test]
fn four_joints_one_of_them_held() {
    survive(four(), 4);
}

#[test]
fn seven_joints_three_of_them_held() {
    let mut config = seven();
    config.friction = support::configs::friction();
    config.latch.fade = true;
    survive(config, 7);
}

#[test]
fn seven_joints_all_active() {
    survive(seven_active(), 8);
}

/// Checks the properties themselves: each fails for an output that violates it.
#[test]
fn the_invariants_detect_violations() {
    let mut random = Random::new(1);
    let mut simulated = SimulatedArm::new(four(), &mut random);
    let last = simulated.begin();
    let input = simulated.rig.input();
    let good = simulated.step(&input);
    let breaks = |change: &dyn Fn(&mut Output<4>)| {
        let mut output = good;
        change(&mut output);
        let checked = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            assert_limits(&simulated, &last, &output);
            assert_modes(&last, &input, &output, &Sums::of(&output));
        }));
        checked.is_err()
    };
    assert!(!breaks(&|_| {}));
    let fault = supple_core::controller::Fault::MassMatrix;
    assert!(breaks(&|o| o.torque_nm[1] = f64::NAN));
    assert!(breaks(&|o| o.torque_nm[1] = 1e3));
    assert!(breaks(&|o| o.torque_nm[3] = last.torque_nm[3] + 1.5));
    assert!(breaks(
        &|o| o.fallback_torque_nm = Vector::repeat(f64::INFINITY)
    ));
    assert!(breaks(&|o| o.mode = Mode::Fault));
    assert!(breaks(&|o| o.fault = Some(fault)));
    assert!(breaks(&|o| o.mode = Mode::Track));
    assert!(breaks(&|o| {
        o.mode = Mode::Fault;
        o.fault = Some(fault);
        o.torques.joint_pd[2] = 1e-9;
    }));
}
