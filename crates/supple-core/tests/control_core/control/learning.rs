//! Learned terms in the controller: their torques compared with inverse dynamics of a changed arm, their bounds, and their
//! application without a torque step and only in permitted modes.

use crate::support::configs::{four, seven, three};
use crate::support::property::{Outcome, check, per_joint, vector3};
use crate::support::rig::{Rig, bent};
use crate::support::{assert_close, size};
use proptest::prelude::*;
use supple_core::controller::{LearningSwitch, Mode, Refusal, Request};
use supple_core::dynamics::{Terms, gravity, rnea, terms};
use supple_core::learned::{
    JointMap, LearnedBounds, LearnedParameters, LearnedTerms, MAP_KNOTS, MapWeights,
};
use supple_core::learned_torque::{LearnedAtPose, payload_torque_nm, tilt_torque_nm};
use supple_core::math::{Matrix3, Vector3};
use supple_core::nalgebra::Rotation3;
use supple_core::{Arm, Config, Friction, Vector};

/// The arm with a point mass at `tip_m` in the tip frame.
fn loaded<const N: usize>(arm: &Arm<N>, mass_kg: f64, tip_m: &Vector3<f64>) -> Arm<N> {
    let mut links = *arm.links();
    let at = arm.joint_from_tip().transform_point(tip_m);
    let last = &mut links[N - 1];
    last.mass += mass_kg;
    last.first_moment += at * mass_kg;
    last.inertia += (Matrix3::identity() * at.dot(&at) - at * at.transpose()) * mass_kg;
    Arm::from_links(links, arm.armature(), arm.joint_from_tip(), arm.gravity())
        .expect("a physical arm")
}

fn terms_of<const N: usize>(arm: &Arm<N>, q: &Vector<N>, qd: &Vector<N>) -> Terms<N> {
    let mut all = Terms::default();
    terms(arm, q, qd, &mut all);
    all
}

/// A payload's torque equals the difference of the inverse dynamics of the loaded and the empty arm. A wrong sign of
/// mass, moment or acceleration would cause at least twice the tolerated error.
#[test]
fn payload_torque_equals_the_torque_of_a_loaded_arm() {
    fn agrees<const N: usize>(config: Config<N>) -> Outcome {
        let arm = config.arm;
        let case = (
            per_joint::<N>(1.5),
            per_joint::<N>(1.0),
            per_joint::<N>(2.0),
            vector3(0.1),
        );
        check(64, case, |(q, qd, qdd, tip_m)| {
            let mass_kg = 0.3;
            let beside = loaded(&arm, mass_kg, &tip_m);
            // For a mass at the tip, the acceleration of the point is known: the torque is exact in motion.
            let at_tip = terms_of(&arm, &q, &qd);
            let accel = at_tip.jacobian.fixed_rows::<3>(0) * qdd
                + at_tip.jacobian_dot_qd.fixed_rows::<3>(0);
            let moving = loaded(&arm, mass_kg, &Vector3::zeros());
            let expected = rnea(&moving, &q, &qd, &qdd) - rnea(&arm, &q, &qd, &qdd);
            let force = accel - arm.gravity();
            let found = payload_torque_nm(&at_tip, &force, mass_kg, &Vector3::zeros());
            assert_close(&found, &expected, 1e-9);
            // For a mass at a distance from the tip, the torque is exact at rest.
            let expected = gravity(&beside, &q) - gravity(&arm, &q);
            let found = payload_torque_nm(&at_tip, &-arm.gravity(), mass_kg, &(tip_m * mass_kg));
            assert_close(&found, &expected, 1e-9);
            Ok(())
        });
        Ok(())
    }
    agrees(three()).expect("three joints");
    agrees(four()).expect("four joints");
    agrees(seven()).expect("seven joints");
}

#[test]
fn tilt_torque_equals_the_torque_of_rotated_gravity() {
    fn agrees<const N: usize>(config: Config<N>) {
        let arm = config.arm;
        check(64, (per_joint::<N>(1.5), vector3(1e-4)), |(q, tilt_rad)| {
            let turned = Rotation3::from_scaled_axis(tilt_rad) * arm.gravity();
            let turned =
                Arm::from_links(*arm.links(), arm.armature(), arm.joint_from_tip(), turned)
                    .expect("a physical arm");
            let expected = gravity(&turned, &q) - gravity(&arm, &q);
            let found = terms_of(&arm, &q, &Vector::zeros());
            let found = tilt_torque_nm(&found, &arm.gravity(), &tilt_rad);
            // Second-order part of a rotation by 1e-4 rad.
            assert_close(&found, &expected, 1e-6);
            Ok(())
        });
    }
    agrees(three());
    agrees(four());
    agrees(seven());
}

#[test]
fn gravity_torque_is_its_gradient_times_gravity() {
    let arm = seven().arm;
    check(64, per_joint::<7>(1.5), |q| {
        let all = terms_of(&arm, &q, &Vector::zeros());
        assert_close(
            &all.gravity_gradient.tr_mul(&arm.gravity()),
            &all.gravity,
            1e-12,
        );
        Ok(())
    });
}

/// Weights are a partition of one, continuous with their slope, and constant beyond the range.
#[test]
fn map_is_smooth_over_the_range() {
    let knots: [f64; MAP_KNOTS] = core::array::from_fn(|k| (k as f64 * 1.7).sin());
    let value = |q: f64| MapWeights::new(q, -2.0, 1.5).of(&knots);
    let slope = |q: f64| (value(q + 1e-6) - value(q - 1e-6)) / 2e-6;
    for k in 0..2000 {
        let q = -2.4 + 4.3e-3 * f64::from(k) * 0.5;
        let weights = MapWeights::new(q, -2.0, 1.5).weights;
        assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        if (-1.99..1.49).contains(&q) {
            let change = slope(q + 1e-4) - slope(q - 1e-4);
            assert!(change.abs() < 0.02, "slope jumps by {change} at {q}");
        }
    }
    assert_eq!(value(-5.0), value(-2.0));
    assert_eq!(value(5.0), value(1.5));
    assert!(MapWeights::new(f64::NAN, -2.0, 1.5).first == 0);
}

/// Over a closed motion the part of the map that depends on the angle alone does no work, and the part against the
/// motion adds no energy: it compensates at most the friction of the model.
#[test]
fn learned_map_adds_no_energy() {
    let mut config = four();
    config.friction = [Friction::coulomb(1.0, 0.5); 4];
    let mut learned = LearnedTerms::<4>::zero();
    for (i, map) in learned.map.iter_mut().enumerate() {
        for (k, value) in map.torque_nm.iter_mut().enumerate() {
            *value = ((3 * i + 2 * k) as f64).sin();
        }
        map.dry_nm = [-5.0; MAP_KNOTS];
    }
    let pose = |t: f64| Vector::<4>::from_fn(|i, _| 0.5 * (t + i as f64).sin());
    let work = |dry: bool| {
        let mut learned = learned;
        if !dry {
            learned
                .map
                .iter_mut()
                .for_each(|map| map.dry_nm = [0.0; MAP_KNOTS]);
        } else {
            learned
                .map
                .iter_mut()
                .for_each(|map| map.torque_nm = [0.0; MAP_KNOTS]);
        }
        let steps = 20_000;
        let h = core::f64::consts::TAU / f64::from(steps);
        let mut work = 0.0;
        for k in 0..steps {
            let t = h * (f64::from(k) + 0.5);
            let (q, qd) = (pose(t), (pose(t + 0.5 * h) - pose(t - 0.5 * h)) / h);
            let at = LearnedAtPose::new(
                &learned,
                &config.friction,
                &config.limits,
                &config.arm.gravity(),
                &q,
                &terms_of(&config.arm, &q, &qd),
                &Vector3::zeros(),
            );
            work += at
                .torque_nm(&learned, &config.friction, &qd, None, &Vector::repeat(1.0))
                .dot(&qd)
                * h;
        }
        work
    };
    assert!(work(false).abs() < 1e-6, "{} J", work(false));
    // Four joints over 2 rad each, against the whole Coulomb torque of the model and no more.
    assert!(
        (work(true) + 4.0 * 2.0 * 0.5).abs() < 0.02,
        "{} J",
        work(true)
    );
}

/// Parameters at `share` of their bounds, signs alternating.
fn within<const N: usize>(bounds: &LearnedBounds<N>, share: f64) -> LearnedParameters<N> {
    let mut parameters = LearnedParameters::zero();
    let mut sign = share;
    parameters.each(&bounds.parameters, |_, _, to, bound| {
        *to = sign * bound;
        sign = -sign;
    });
    parameters
}

fn with_friction<const N: usize>(config: Config<N>) -> Config<N> {
    Config {
        friction: [Friction::coulomb(1.0, 0.5); N],
        ..config
    }
}

/// While the tip rests, new terms move the torque by no more than a thousandth of the change in a cycle, and it ends
/// exactly at the new terms.
#[test]
fn new_learned_terms_cause_no_torque_step() {
    fn ramps<const N: usize>(config: Config<N>) {
        let mut rig = Rig::new(with_friction(config), bent());
        rig.bring_to(Mode::Track);
        rig.accept(Request::Learning(LearningSwitch::On));
        let parameters = within(rig.controller.learned_bounds(), 0.5);
        let before = rig.accept(Request::LearnedParameters(parameters));
        let map = JointMap {
            torque_nm: [0.3; MAP_KNOTS],
            dry_nm: [0.1; MAP_KNOTS],
        };
        let mut outputs = vec![before, rig.accept(Request::LearnedMap { joint: 1, map })];
        for _ in 0..1200 {
            outputs.push(rig.cycle());
        }
        let last = outputs[outputs.len() - 1];
        assert_eq!(last.learned, parameters);
        let whole = size(&(last.torques.learned - before.torques.learned));
        assert!(whole > 0.3, "{whole} N m");
        for pair in outputs.windows(2) {
            let step = size(&(pair[1].torques.learned - pair[0].torques.learned));
            assert!(step <= 2e-3 * whole, "{step} N m in a cycle of {whole}");
            assert!(!pair[1].torque_limited && pair[1].fault.is_none());
        }
        assert!(
            size(
                &last
                    .torques
                    .learned
                    .component_div(&rig.controller.learned_bounds().torque_nm)
            ) <= 1.0
        );
    }
    ramps(three());
    ramps(four());
    ramps(seven());
}

#[test]
fn terms_beyond_their_bounds_and_non_finite_terms_are_refused() {
    let mut rig = Rig::new(with_friction(four()), bent());
    rig.bring_to(Mode::Track);
    let zero = LearnedParameters::<4>::zero();
    let off = rig.request(Request::LearnedParameters(zero));
    assert_eq!(off.refusal, Some(Refusal::LearningOff));
    rig.accept(Request::Learning(LearningSwitch::On));
    let bounds = *rig.controller.learned_bounds();
    for entry in 0..LearnedParameters::<4>::COUNT {
        for value in [1.01, f64::NAN, f64::INFINITY] {
            let mut parameters = zero;
            let mut index = 0;
            parameters.each(&bounds.parameters, |_, _, to, bound| {
                if index == entry {
                    *to = value * bound;
                }
                index += 1;
            });
            let output = rig.request(Request::LearnedParameters(parameters));
            let refused = matches!(output.refusal, Some(Refusal::Value { .. }));
            assert!(refused, "{parameters:?}: {:?}", output.refusal);
        }
    }
    let mut map = JointMap::ZERO;
    map.dry_nm[MAP_KNOTS - 1] = -1.01 * bounds.map_nm[2];
    for (joint, map) in [(2, map), (4, JointMap::ZERO)] {
        let output = rig.request(Request::LearnedMap { joint, map });
        assert!(matches!(output.refusal, Some(Refusal::Value { .. })));
    }
    assert_eq!(rig.cycle().learned, zero);
}

/// In modes for hand guiding, in gravity hold, idle and in a fault new terms are refused. The present terms stay, except in a
/// fault and in idle, whose torque is that of the model.
#[test]
fn learned_terms_are_refused_while_learning_is_off() {
    for mode in [
        Mode::Idle,
        Mode::GravityHold,
        Mode::Float,
        Mode::JointImpedance,
        Mode::Breakaway,
        Mode::Fault,
    ] {
        let mut rig = Rig::new(with_friction(four()), bent());
        rig.cycle();
        rig.accept(Request::Learning(LearningSwitch::On));
        rig.bring_to(mode);
        let parameters = within(rig.controller.learned_bounds(), 0.5);
        let output = rig.request(Request::LearnedParameters(parameters));
        assert_eq!(output.refusal, Some(Refusal::Mode { mode }), "{mode:?}");
        let map = JointMap::ZERO;
        let output = rig.request(Request::LearnedMap { joint: 0, map });
        assert_eq!(output.refusal, Some(Refusal::Mode { mode }), "{mode:?}");
        assert!(rig.cycle().learning, "it stays on");
    }
}

#[test]
fn a_learning_reset_restores_the_terms_of_the_configuration() {
    let mut config = with_friction(four());
    config.learned.parameters.payload_kg = 0.1;
    let mut rig = Rig::new(config, bent());
    rig.bring_to(Mode::Track);
    let start = rig.cycle();
    assert_eq!(start.learned, config.learned.parameters);
    assert!(
        size(&start.torques.learned) > 0.1,
        "in force from the start"
    );
    rig.accept(Request::Learning(LearningSwitch::On));
    let parameters = within(rig.controller.learned_bounds(), 0.3);
    rig.accept(Request::LearnedParameters(parameters));
    rig.cycles(1500);
    // Also in a mode in which nothing is learned.
    rig.accept(Request::GravityHold);
    rig.accept(Request::Learning(LearningSwitch::Reset));
    rig.accept(Request::Learning(LearningSwitch::Off));
    let end = rig.cycles(1500);
    assert_eq!(end.learned, config.learned.parameters);
    assert!(!end.learning);
}

/// The observer includes the learned terms: a payload that the model lacks is no external force after it is learned.
#[test]
fn the_observer_includes_the_learned_terms() {
    let config = four();
    let seen = |payload_kg: f64| {
        let mut truth = config;
        truth.arm = loaded(&config.arm, 0.1, &Vector3::zeros());
        let mut model = config;
        model.learned.parameters.payload_kg = payload_kg;
        let mut rig = Rig::new(model, bent());
        let mut plant = crate::support::plant::Plant::at_rest(truth.arm, bent());
        rig.drive(
            &mut plant,
            Some(Request::GravityHold),
            crate::support::plant::nothing,
        );
        let mut last = rig.run(&mut plant);
        for _ in 0..1000 {
            last = rig.run(&mut plant);
        }
        last.external_force_n.norm()
    };
    assert!((seen(0.0) - 0.981).abs() < 0.1, "{} N", seen(0.0));
    assert!(seen(0.1) < 0.05, "{} N", seen(0.1));
}

proptest! {
    #![proptest_config(crate::support::settings::config(64, 20_260_103))]

    /// With any learned terms within their bounds, the learned torque stays within its bound.
    #[test]
    fn learned_torque_is_bounded(share in -1.0..1.0_f64, knots in proptest::collection::vec(-1.0..1.0_f64, MAP_KNOTS)) {
        let config = with_friction(seven());
        let mut rig = Rig::new(config, bent());
        let bounds = *rig.controller.learned_bounds();
        rig.bring_to(Mode::Track);
        rig.accept(Request::Learning(LearningSwitch::On));
        rig.accept(Request::LearnedParameters(within(&bounds, share)));
        for joint in 0..7 {
            let of = |k: usize| knots[k] * bounds.map_nm[joint];
            let map = JointMap { torque_nm: core::array::from_fn(of), dry_nm: core::array::from_fn(of) };
            rig.accept(Request::LearnedMap { joint, map });
        }
        let output = rig.cycles(1100);
        prop_assert_eq!(output.fault, None);
        for joint in 0..7 {
            prop_assert!(output.torques.learned[joint].abs() <= bounds.torque_nm[joint]);
        }
    }
}
