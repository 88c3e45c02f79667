//! Nothing is learned from what is not the arm.

use crate::support::configs::four;
use crate::support::size;
use crate::world::{Truth, World, exciting, model};
use supple_core::controller::{LearningSwitch, Mode, Request};
use supple_core::learned::LearnedParameters;
use supple_core::math::Vector3;
use supple_learning::Frozen;

/// Greatest change over the bound of each number.
fn change(world: &World<4>, from: &LearnedParameters<4>, to: &LearnedParameters<4>) -> f64 {
    let mut difference = *to;
    difference.each(from, |_, _, to, from| *to -= from);
    let mut bounds = world.rig.controller.learned_bounds().parameters;
    let mut largest = 0.0_f64;
    bounds.each(&difference, |_, _, bound, change| {
        largest = largest.max((change / *bound).abs());
    });
    largest
}

fn trained() -> World<4> {
    let truth = Truth {
        payload_kg: 0.05,
        ..Truth::none()
    };
    let mut world = World::new(model(four()), truth);
    world.request(Request::Excite(exciting::<4>(60.0)));
    world.run(25.0, Vector3::zeros());
    world
}

/// A person leans on the arm for 10 s in its motion: no learned number changes by more than 2 % of its bound, nor by
/// more than 5 % in the 10 s after, than without the person.
#[test]
fn person_leaning_on_the_arm_changes_nothing() {
    for force_n in [
        Vector3::new(0.0, 0.0, -4.0),
        Vector3::new(0.0, 3.0, 0.0),
        Vector3::new(-3.0, 0.0, 2.0),
    ] {
        let mut world = trained();
        let mut alone = trained();
        let before = world.run(0.001, Vector3::zeros()).learned;
        alone.run(0.001, Vector3::zeros());
        let pushed = world.run(10.0, force_n).learned;
        let at_rest = alone.run(10.0, Vector3::zeros()).learned;
        // What was on its way when the push began still comes into force.
        let drift = change(&world, &before, &at_rest);
        let pushed = change(&world, &before, &pushed);
        assert!(
            pushed < drift + 0.02,
            "{force_n:?}: {pushed}, alone {drift}"
        );
        assert!(world.learner.report().disturbances > 0);
        let after = world.run(10.0, Vector3::zeros()).learned;
        let alone = alone.run(10.0, Vector3::zeros()).learned;
        let left = change(&world, &alone, &after);
        assert!(
            left < 0.05,
            "{force_n:?}: {left} of a bound is left of the push"
        );
    }
}

#[test]
fn nothing_is_learned_while_off_and_in_modes_in_which_people_push() {
    let truth = Truth {
        payload_kg: 0.03,
        ..Truth::none()
    };
    let mut world = World::new(model(four()), truth);
    assert_eq!(world.learner.report().frozen, Some(Frozen::Mode));
    for is_compliant in [false, true] {
        let target_rad = world.plant.q;
        world.request(match is_compliant {
            false => Request::Float,
            true => Request::JointImpedance {
                target_rad,
                duration_s: 0.5,
            },
        });
        // A hand moves the arm about.
        for k in 0..4000 {
            let t = f64::from(k) * 1e-3;
            let force = Vector3::new(0.0, (2.0 * t).sin(), (1.5 * t).cos());
            let output = world.cycle(None, force);
            assert_eq!(output.fault, None);
        }
        assert_eq!(world.learner.report().frozen, Some(Frozen::Mode));
    }
    assert!(world.requests.is_empty());

    let mut world = World::new(model(four()), truth);
    world.request(Request::Learning(LearningSwitch::Off));
    world.request(Request::Excite(exciting::<4>(10.0)));
    let output = world.run(9.0, Vector3::zeros());
    assert_eq!(output.mode, Mode::Excite);
    assert_eq!(world.learner.report().frozen, Some(Frozen::Off));
    assert!(world.requests.is_empty());
    assert_eq!(size(&output.torques.learned), 0.0);
}

/// A change of the arm that stays, as a tool that was changed in motion, is learned after a while.
#[test]
fn lasting_change_is_learned_in_the_end() {
    let mut world = World::new(model(four()), Truth::none());
    world.request(Request::Excite(exciting::<4>(120.0)));
    world.run(25.0, Vector3::zeros());
    world.add_payload(0.15);
    let soon = world.run(5.0, Vector3::zeros()).learned;
    assert!(soon.payload_kg.abs() < 0.03, "{soon:?}");
    let late = world.run(60.0, Vector3::zeros()).learned;
    assert!((late.payload_kg - 0.15).abs() < 0.05, "{late:?}");
}

/// A constant force that stays, as of a weight without inertia, is not learned soon either; in the end payload, offset and tilt
/// together carry most of it, the payload alone two thirds.
#[test]
fn lasting_force_is_compensated_in_the_end() {
    let mut world = World::new(model(four()), Truth::none());
    world.request(Request::Excite(exciting::<4>(120.0)));
    world.run(25.0, Vector3::zeros());
    let force_n = Vector3::new(0.0, 0.0, -0.15 * 9.81);
    // The stiff loops carry what the feed-forward lacks.
    let mut feedback_nm = |seconds: u32| {
        let (mut sum, mut learned) = (0.0, LearnedParameters::zero());
        for _ in 0..seconds * 1000 {
            let output = world.cycle(None, force_n);
            assert_eq!(output.fault, None);
            sum += output.torques.joint_pd.norm_squared();
            learned = output.learned;
        }
        ((sum / f64::from(seconds * 1000)).sqrt(), learned)
    };
    let (before_nm, soon) = feedback_nm(5);
    assert!(soon.payload_kg.abs() < 0.03, "{soon:?}");
    feedback_nm(55);
    let (after_nm, late) = feedback_nm(5);
    assert!((late.payload_kg - 0.15).abs() < 0.05, "{late:?}");
    assert!(
        after_nm < 0.4 * before_nm,
        "{before_nm} N m before, {after_nm} N m after"
    );
}

/// Resetting discards the samples too.
#[test]
fn reset_forgets() {
    let mut world = trained();
    assert!(world.learner.report().learned_s.iter().any(|s| *s > 5.0));
    world.request(Request::Learning(LearningSwitch::Reset));
    let report = world.learner.report();
    assert_eq!(report.learned_s, [0.0; 4]);
    assert_eq!(report.terms, world.rig.controller.config().learned);
}
