//! Terms that the motion excites converge to the true values; no term leaves its bounds.

use crate::support::configs::{four, seven, three};
use crate::support::rig::bent;
use crate::support::size;
use crate::world::{Truth, World, exciting, model, size_of_joint};
use core::f64::consts::PI;
use proptest::prelude::*;
use supple_core::controller::Request;
use supple_core::dynamics::{gravity, rnea};
use supple_core::learned::{LearnedBounds, LearnedTerms};
use supple_core::math::Vector3;
use supple_core::trajectory::Fourier;
use supple_core::{Arm, Config, Vector};

fn truth<const N: usize>() -> impl Strategy<Value = Truth<N>> {
    let joints = |reach: f64| {
        proptest::collection::vec(-reach..reach, N).prop_map(|v| Vector::from_column_slice(&v))
    };
    (
        joints(0.25),
        joints(0.25),
        joints(0.3),
        -0.05..0.15_f64,
        [-0.02..0.02_f64, -0.02..0.02],
    )
        .prop_map(|(viscous, coulomb, offset_nm, payload_kg, [x, y])| Truth {
            viscous,
            coulomb,
            offset_nm: Vector::from_fn(|i, _| offset_nm[i] * size_of_joint(i)),
            payload_kg,
            tilt_rad: Vector3::new(x, y, 0.0),
        })
}

/// After 40 s of motion the error of the controller's predicted torque is less than a fifth of its initial value,
/// RMS along a motion of the same joints, and no learned number is beyond its bound.
fn learns<const N: usize>(config: Config<N>, truth: Truth<N>) -> Result<(), TestCaseError> {
    let config = model(config);
    let mut world = World::new(config, truth);
    let series = exciting::<N>(40.0);
    world.request(Request::Excite(series));
    let mut missed = [0.0_f64; 2];
    let bounds = LearnedBounds::new(&config.friction, &config.limits.joint_torque_nm);
    let mut feedback = |output: &supple_core::Output<N>, late: usize| {
        missed[late] += output.torques.joint_pd.norm_squared();
    };
    for k in 0..39_000 {
        let output = world.cycle(None, Vector3::zeros());
        prop_assert_eq!(output.fault, None);
        prop_assert!(bounds.check(&output.learned).is_ok());
        // The stiff loops supply the torque that the feed-forward lacks: before the first terms, and at the end.
        match k {
            1000..4000 => feedback(&output, 0),
            36_000..39_000 => feedback(&output, 1),
            _ => {}
        }
    }
    let [before, after] = missed.map(|sum| (sum / 3000.0_f64).sqrt());
    prop_assert!(
        after < 0.2 * before + 0.02,
        "{:.3} N m before, {:.3} N m after",
        before,
        after
    );
    Ok(())
}

/// With a fast estimator, encoder steps cause velocity noise. With an exact model this noise is not learned: all terms stay
/// near zero.
#[test]
fn velocity_noise_does_not_change_the_estimate() {
    let mut config = model(four());
    config.estimator_rad_per_s = 400.0;
    let mut world = World::new(config, Truth::none());
    world.encoder_step_rad = 4e-4;
    world.request(Request::Excite(exciting::<4>(12.0)));
    let mut greatest = 0.0_f64;
    for _ in 0..11_000 {
        let output = world.cycle(None, Vector3::zeros());
        assert_eq!(output.fault, None);
        greatest = greatest.max(output.torques.learned.amax());
    }
    assert!(world.requests.len() >= 5);
    assert!(greatest < 0.02, "{greatest} N m");
}

fn check<const N: usize>(cases: u32, config: Config<N>) {
    let settings = crate::support::settings::config(cases, 20_261_123);
    crate::support::property::run(settings, truth::<N>(), |truth| learns(config, truth));
}

#[test]
fn terms_of_three_joints_converge() {
    check(3, three());
}

#[test]
fn terms_of_four_joints_converge() {
    check(3, four());
}

#[test]
fn terms_of_seven_joints_converge() {
    check(2, seven());
}

/// The learned payload and tilt are those of the arm, not an accidental fit: their gravity torque in
/// poses outside of the motion has an error below a tenth of the torque, and friction below a tenth of the change.
#[test]
fn a_single_deviation_is_attributed_to_its_own_parameter() {
    let config = model(four());
    let learned = |truth: Truth<4>| {
        let mut world = World::new(config, truth);
        world.request(Request::Excite(exciting::<4>(60.0)));
        world.run(58.0, Vector3::zeros()).learned
    };
    let payload = learned(Truth {
        payload_kg: 0.12,
        ..Truth::none()
    });
    assert!((payload.payload_kg - 0.12).abs() < 0.03, "{payload:?}");
    let tilt = learned(Truth {
        tilt_rad: Vector3::new(0.015, -0.01, 0.0),
        ..Truth::none()
    });
    let off = tilt.tilt_rad - Vector3::new(0.015, -0.01, 0.0);
    assert!(off.x.abs() < 4e-3 && off.y.abs() < 4e-3, "{tilt:?}");
    let friction = learned(Truth {
        viscous: Vector::repeat(0.2),
        coulomb: Vector::repeat(0.2),
        ..Truth::none()
    });
    for i in 0..4 {
        // The map explains a small part of the torque.
        let coulomb = friction.coulomb_nm[i];
        assert!((coulomb - 0.08).abs() < 0.02, "joint {i}: {coulomb} N m");
        let viscous = friction.viscous_nm_s_per_rad[i];
        assert!((viscous - 0.16).abs() < 0.05, "joint {i}: {viscous}");
    }
}

/// Friction of 1.8 times the model's is beyond the bound of half: the learned change stops at the bound.
#[test]
fn estimates_of_deviations_beyond_the_bounds_stop_at_the_bounds() {
    let config = model(three());
    let truth = Truth {
        coulomb: Vector::repeat(0.8),
        viscous: Vector::repeat(0.8),
        ..Truth::none()
    };
    let mut world = World::new(config, truth);
    world.request(Request::Excite(exciting::<3>(40.0)));
    let bounds = *world.rig.controller.learned_bounds();
    let mut largest = 0.0_f64;
    for _ in 0..39_000 {
        let output = world.cycle(None, Vector3::zeros());
        assert_eq!(output.fault, None);
        assert!(
            bounds.check(&output.learned).is_ok(),
            "{:?}",
            output.learned
        );
        let share = output.torques.learned.component_div(&bounds.torque_nm);
        assert!(size(&share) <= 1.0);
        let learned = &output.learned.coulomb_nm;
        let coulomb = learned.component_div(&bounds.parameters.coulomb_nm);
        largest = largest.max(size(&coulomb));
    }
    assert!(
        largest > 0.99,
        "a Coulomb friction of {largest} of its bound"
    );
}

/// Joints that do not move keep the model's values, independent of the forces on them.
#[test]
fn joints_at_rest_keep_the_models_values() {
    let config = model(four());
    let truth = Truth {
        coulomb: Vector::repeat(0.2),
        offset_nm: Vector::repeat(0.2),
        ..Truth::none()
    };
    let mut world = World::new(config, truth);
    let mut series = exciting::<4>(20.0);
    for columns in series.sine_rad.iter_mut().chain(&mut series.cosine_rad) {
        columns[0] = 0.0;
        columns[2] = 0.0;
    }
    series.centre_rad[0] = world.plant.q[0];
    series.centre_rad[2] = world.plant.q[2];
    world.request(Request::Excite(series));
    let learned = world.run(19.0, Vector3::zeros()).learned;
    for i in [0, 2] {
        assert!(learned.coulomb_nm[i].abs() < 1e-9, "{learned:?}");
        assert!(learned.viscous_nm_s_per_rad[i].abs() < 1e-9, "{learned:?}");
        assert!(learned.offset_nm[i].abs() < 1e-9, "{learned:?}");
    }
    for i in [1, 3] {
        assert!(learned.coulomb_nm[i] > 0.04, "{learned:?}");
    }
}

/// Compares the learner's regressor with inverse dynamics of a changed arm: the test fails with a wrong sign.
#[test]
fn the_prediction_error_has_the_sign_of_the_missing_torque() {
    let config = model(three());
    let truth = Truth {
        payload_kg: 0.1,
        ..Truth::none()
    };
    let mut world = World::new(config, truth);
    world.request(Request::Excite(exciting::<3>(20.0)));
    let learned = world.run(15.0, Vector3::zeros()).learned;
    let q = world.plant.q;
    let change = gravity(&world.plant.arm, &q) - gravity(&config.arm, &q);
    let rest = Vector::zeros();
    let missing: Vector<3> = rnea(&world.plant.arm, &q, &rest, &rest) - gravity(&config.arm, &q);
    assert!((change - missing).norm() < 1e-9);
    let with = |kg: f64| {
        let arm: Arm<3> = config.arm;
        let lever = supple_core::dynamics::jacobian(&arm, &q);
        lever.fixed_rows::<3>(0).tr_mul(&(-arm.gravity() * kg))
    };
    assert!(
        with(learned.payload_kg).dot(&missing) > 0.5 * missing.norm_squared(),
        "{learned:?}"
    );
}

#[test]
fn same_records_give_the_same_requests() {
    let run = || {
        let truth = Truth {
            payload_kg: 0.1,
            ..Truth::none()
        };
        let mut world = World::new(model(three()), truth);
        world.request(Request::Excite(exciting::<3>(10.0)));
        world.run(8.0, Vector3::zeros());
        world.requests
    };
    let first = run();
    assert!(first.len() >= 4, "{} requests", first.len());
    assert_eq!(first, run());
}

/// All joints move by twice the amplitude in one direction for 10 s, then back.
fn there_and_back(amplitude_rad: f64) -> Fourier<4> {
    let mut series = Fourier::at_rest(bent::<4>(), 0.1 * PI);
    series.cosine_rad[0] = Vector::repeat(-amplitude_rad);
    series.centre_rad -= series.at(0.0).position_rad - series.centre_rad;
    series.duration_s = 40.0;
    series
}

/// In one direction, dry friction is not told apart from an offset: the learner requests nothing before a joint has moved back.
#[test]
fn an_estimate_waits_for_both_directions() {
    for presliding_rad in [0.0, 1e-3, 4e-3] {
        let mut config = model(four());
        for friction in &mut config.friction {
            friction.presliding_rad = presliding_rad;
        }
        waits_for_both_directions(config);
    }
}

fn waits_for_both_directions(config: Config<4>) {
    let truth = Truth {
        coulomb: Vector::repeat(0.2),
        ..Truth::none()
    };
    let mut world = World::new(config, truth);
    world.request(Request::Excite(there_and_back(0.5)));
    world.run(9.0, Vector3::zeros());
    let report = world.learner.report();
    assert_eq!((report.learned_s, report.frozen), ([0.0; 4], None));
    assert_eq!(report.terms, LearnedTerms::zero());
    assert_eq!(world.requests, []);
    world.run(28.0, Vector3::zeros());
    let report = world.learner.report();
    assert!(
        report.learned_s.iter().all(|s| *s > 8.0),
        "{:?}",
        report.learned_s
    );
    assert!(world.requests.len() > 40, "{}", world.requests.len());
    let learned = report.terms.parameters;
    for (joint, friction) in config.friction.iter().enumerate() {
        let (found_nm, expected_nm) = (learned.coulomb_nm[joint], 0.2 * friction.coulomb_nm);
        assert!(
            found_nm > 0.3 * expected_nm,
            "joint {joint}: {found_nm} of {expected_nm} N m"
        );
    }
}

/// A joint that creeps may never reverse: the difference of its friction is learned from the one direction.
#[test]
fn joints_that_creep_are_used_in_one_direction() {
    let mut config = model(four());
    for friction in &mut config.friction {
        friction.presliding_rad = 1e-3;
    }
    let truth = Truth {
        coulomb: Vector::repeat(-0.2),
        ..Truth::none()
    };
    let mut world = World::new(config, truth);
    world.request(Request::Excite(there_and_back(0.05)));
    // Forwards, and still faster than a joint that rests.
    let output = world.run(7.5, Vector3::zeros());
    let learned_s = world.learner.report().learned_s;
    for (joint, friction) in config.friction.iter().enumerate() {
        let expected_nm = truth.coulomb[joint] * friction.coulomb_nm;
        let found_nm = output.torques.learned[joint];
        assert!(
            learned_s[joint] > 1.0 && (found_nm - expected_nm).abs() < 0.3 * expected_nm.abs(),
            "joint {joint}: {found_nm} of {expected_nm} N m after {} s",
            learned_s[joint]
        );
    }
}

/// Joints that reverse again and again, slower than 0.08 rad/s.
fn slow() -> Fourier<4> {
    let mut series = exciting::<4>(60.0);
    for amplitudes in series.sine_rad.iter_mut().chain(&mut series.cosine_rad) {
        *amplitudes *= 0.1;
    }
    let start = series.at(0.0).position_rad - series.centre_rad;
    series.centre_rad = bent::<4>() - start;
    series
}

/// The dry friction of slow joints is learned if the presliding distance is known, and not otherwise.
#[test]
fn slow_joints_are_used_if_the_presliding_distance_is_known() {
    let truth = Truth {
        coulomb: Vector::repeat(0.2),
        ..Truth::none()
    };
    for presliding_rad in [0.0, 1e-3, 4e-3] {
        let mut config = model(four());
        for friction in &mut config.friction {
            friction.presliding_rad = presliding_rad;
        }
        let mut world = World::new(config, truth);
        world.request(Request::Excite(slow()));
        let output = world.run(55.0, Vector3::zeros());
        let learned_s = world.learner.report().learned_s;
        if presliding_rad == 0.0 {
            assert_eq!(learned_s, [0.0; 4]);
            continue;
        }
        for (joint, friction) in config.friction.iter().enumerate() {
            let expected_nm = truth.coulomb[joint] * friction.coulomb_nm;
            let terms = &world.learner.report().terms;
            let map = &terms.map[joint].dry_nm;
            let mean_nm = map.iter().sum::<f64>() / map.len() as f64;
            let found_nm = terms.parameters.coulomb_nm[joint] + mean_nm;
            assert!(
                learned_s[joint] > 5.0 && (found_nm - expected_nm).abs() < 0.3 * expected_nm,
                "travel {presliding_rad} rad, joint {joint}: {found_nm} of {expected_nm} N m after {} s, {:?}",
                learned_s[joint],
                output.learned
            );
        }
    }
}
