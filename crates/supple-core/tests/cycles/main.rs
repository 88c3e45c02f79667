//! Whatever is asked for and whatever is measured, for as many cycles as one has time for: `SUPPLE_CYCLES` of them
//! (150,000 by default; 10 million in `./ci.sh cycles`), on an arm that moves as the torques and the bumps have it.
//!
//! Every cycle: torques finite, within the limits of joints, motors and rate; a fault is there exactly in mode
//! fault, and stays until a reset; in it no term is stiff or fed forward; modes change only as `Mode` says.
#![allow(
    clippy::disallowed_methods,
    reason = "references take their mathematics elsewhere"
)]

#[path = "../support/mod.rs"]
mod support;

mod world;

use std::collections::BTreeMap;
use supple_core::config::ApparentInertia;
use supple_core::controller::{Mode, Request};
use supple_core::math::Matrix3;
use supple_core::{Config, Input, Output, Vector};
use support::configs::{four, seven, three};
use world::{Random, World};

/// Cycles after which the arm begins anew elsewhere.
const EPISODE: u64 = 2_000;
/// The safe action may take a joint's whole torque away in this time \[s\].
const STOP_TORQUE_S: f64 = 0.005;
/// Terms of the law that are springs, or motion that somebody wants: none of them acts in a fault.
const WANTED: [&str; 7] = [
    "friction",
    "jacobian_rate",
    "inertial",
    "stiffness",
    "force",
    "nullspace",
    "joint_pd",
];

/// Cycles of each of the three arms.
fn cycles() -> u64 {
    let all = std::env::var("SUPPLE_CYCLES").ok();
    let all = all.map(|all| all.parse().expect("SUPPLE_CYCLES is a whole number"));
    all.unwrap_or(150_000_u64).div_ceil(3)
}

fn survive<const N: usize>(mut config: Config<N>, seed: u64) {
    config.limits.stale_cycles = 6;
    config.limits.start_error_m = 2.0;
    let mut random = Random(seed);
    let mut seen = BTreeMap::<&str, u64>::new();
    let mut faults = BTreeMap::<&str, u64>::new();
    let mut left = cycles();
    while left > 0 {
        let mut world = World::new(config, &mut random);
        let mut last = world.begin();
        for _ in 0..left.min(EPISODE) {
            let input = world.input(&mut random, &last);
            let output = world.step(&input);
            let torque = Sums::of(&output);
            assert_limits(&world, &last, &output);
            assert_modes(&last, &input, &output, &torque);
            if let (Some(fault), None) = (&output.fault, &last.fault) {
                *faults.entry(fault.name()).or_default() += 1;
            }
            *seen.entry(output.mode.name()).or_default() += 1;
            world.advance(&output, &mut random);
            last = output;
        }
        left -= left.min(EPISODE);
    }
    for mode in supple_core::codes::MODES {
        let count = seen.get(mode.name()).copied().unwrap_or_default();
        assert!(
            count > cycles() / 2_000,
            "{mode:?} was hardly reached: {seen:?}"
        );
    }
    assert!(faults.len() >= 6, "few faults came: {faults:?}");
}

/// Greatest entry of each term.
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

fn assert_limits<const N: usize>(world: &World<N>, last: &Output<N>, output: &Output<N>) {
    let controller = &world.rig.controller;
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
    let say = || {
        format!(
            "{:?} to {:?} by {input:?}: {output:?}",
            last.mode, output.mode
        )
    };
    assert_eq!(
        output.mode == Mode::Fault,
        output.fault.is_some(),
        "{}",
        say()
    );
    let fresh = input.cycle != last.cycle;
    let bad = input.position_rad.iter().flatten().any(|x| !x.is_finite());
    assert!(!(bad && fresh) || output.mode == Mode::Fault, "{}", say());
    assert!(
        output.refusal.is_none() || input.request.is_some(),
        "{}",
        say()
    );
    if output.fault.is_some() {
        for term in WANTED {
            assert_eq!(torque.get(term), 0.0, "{term} acts in a fault: {}", say());
        }
    }
    let request = input.request.as_ref().filter(|_| output.refusal.is_none());
    let documented = match (last.mode, output.mode) {
        (_, Mode::Fault) => true,
        (Mode::Fault, Mode::Idle | Mode::GravityHold) => matches!(request, Some(Request::Reset)),
        (Mode::Fault, _) => false,
        (from, to) if from == to => true,
        (_, Mode::Idle) => matches!(request, Some(Request::Idle)),
        // A breakaway that is done ends in gravity hold; so does all work while the drives are idle.
        (from, Mode::GravityHold) => {
            let let_go = from != Mode::Idle && world::drives_are_idle(input);
            matches!(request, Some(Request::GravityHold)) || from == Mode::Breakaway || let_go
        }
        (Mode::Idle, _) => false,
        (_, Mode::Move) => matches!(request, Some(Request::Move { .. })),
        (_, Mode::Track | Mode::Probe) => matches!(request, Some(Request::Track(_))),
        (_, Mode::Excite) => matches!(request, Some(Request::Excite(_))),
        (_, Mode::Breakaway) => matches!(request, Some(Request::Breakaway(_))),
    };
    assert!(documented, "{}", say());
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

/// What the properties are worth: each of them is broken by an output that breaks it.
#[test]
fn the_properties_can_be_broken() {
    let mut random = Random(1);
    let mut world = World::new(four(), &mut random);
    let last = world.begin();
    let input = world.rig.input();
    let good = world.step(&input);
    let breaks = |change: &dyn Fn(&mut Output<4>)| {
        let mut output = good;
        change(&mut output);
        let checked = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            assert_limits(&world, &last, &output);
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
