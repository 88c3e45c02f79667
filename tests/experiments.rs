//! Tests of the required results of the paper's experiments, for any seed.

use supple_core::Trajectory;
use supple_core::controller::Mode;
use supple_core::dynamics::gravity;
use supple_core::inverse_kinematics::inverse_kinematics;
use supple_core::trajectory::Sinusoid;
use supple_experiment::effects::calibrated;
use supple_experiment::metrics::{LineFit, median, spread};
use supple_experiment::probing::{Stroke, effective_mass_kg, median_stroke, probe, strokes};
use supple_experiment::{
    ExperimentError, Mismatch, Plan, Run, SegmentErrorAccumulator, Setup, Variant, run, scenario,
    track_pose,
};
use supple_model::Description;
use supple_plant::{PlantOptions, Scene};

fn perturbed(seed: u64) -> Variant {
    Variant {
        mismatch: Some(Mismatch::identified(seed)),
        ..Variant::EXACT
    }
}

fn wam4() -> Setup<4> {
    let description = Description::asset("wam4").expect("a built-in arm");
    Setup::new(&description, 1).expect("four joints")
}

fn plan(setup: &Setup<4>, variant: &Variant, trajectory: Trajectory, duration_s: f64) -> Plan<4> {
    let mut config = setup.config(variant).expect("a physical model");
    config.law.gains = scenario::gains(scenario::STIFFNESS_N_PER_M);
    Plan {
        name: "test".to_owned(),
        config,
        plant: setup.plant(variant, Scene::default()),
        trajectory,
        duration_s,
        learning: false,
        gain_change: None,
    }
}

fn sinusoid(variant: &Variant) -> Run {
    let (trajectory, duration_s) = scenario::sinusoid(1.0);
    run(
        &plan(&wam4(), variant, trajectory, duration_s),
        &mut |_, _| Ok(()),
    )
    .expect("the sinusoid runs")
}

fn probing(variant: &Variant, stiffness_n_per_m: f64) -> Stroke {
    let setup = wam4();
    let (probe, _) = scenario::probe(setup.tip_radius_m());
    let mut plan = plan(&setup, variant, Trajectory::Probe(probe), probe.cycle_s());
    plan.config.law.gains = scenario::gains(stiffness_n_per_m);
    plan.plant.scene = scenario::block();
    median_stroke(&strokes(&plan).expect("probing runs"))
}

/// Applies `f` to every item on two threads.
fn side_by_side<I: Sync, O: Send>(items: &[I], f: impl Fn(&I) -> O + Sync) -> Vec<O> {
    let (front, back) = items.split_at(items.len() / 2);
    std::thread::scope(|scope| {
        let later = scope.spawn(|| back.iter().map(&f).collect::<Vec<_>>());
        let mut results: Vec<O> = front.iter().map(&f).collect();
        results.extend(later.join().expect("no experiment panics"));
        results
    })
}

#[test]
fn perturbed_models_track_the_sinusoid_at_5_n_per_m() {
    let seeds: Vec<u64> = (0..10).collect();
    let runs = side_by_side(&seeds, |seed| sinusoid(&perturbed(*seed)));
    for (seed, run) in runs.iter().enumerate() {
        assert_eq!(run.ended, None, "seed {seed}");
        for joint in &run.torque_rms {
            assert!(joint.gravity > joint.friction, "seed {seed}: {joint:?}");
            assert!(joint.friction > joint.feedback, "seed {seed}: {joint:?}");
        }
    }
    let errors: Vec<f64> = runs.iter().map(|run| run.rms_error_m).collect();
    let worst = errors
        .iter()
        .fold(0.0_f64, |worst, error| worst.max(*error));
    let middle = median(&errors).expect("ten runs");
    assert!(middle <= 0.012 && worst <= 0.025, "{errors:?}");
}

#[test]
fn a_perturbed_model_has_the_stated_error() {
    let setup = wam4();
    let exact = setup.config(&Variant::EXACT).expect("valid").arm;
    for seed in 0..10 {
        let off = setup.config(&perturbed(seed)).expect("valid").arm;
        let (mut difference, mut whole) = (0.0, 0.0);
        for k in 0..50 {
            let x = f64::from(k);
            let q = [0.1 * x, (0.7 * x).sin(), 0.0, 1.0 + (1.3 * x).cos()].into();
            let (a, b) = (gravity(&exact, &q), gravity(&off, &q));
            difference += (a - b).norm_squared();
            whole += a.norm_squared();
        }
        let relative = (difference / whole).sqrt();
        // The signs are mixed, so the errors partly cancel.
        assert!((1e-4..2e-3).contains(&relative), "seed {seed}: {relative}");
    }
}

#[test]
fn an_exact_model_tracks_better() {
    let exact = |stribeck| {
        sinusoid(&Variant {
            stribeck,
            load: false,
            ..Variant::EXACT
        })
    };
    assert!(exact(false).rms_error_m <= 6e-3);
    assert!(exact(true).rms_error_m <= 3e-3);
}

#[test]
fn the_law_as_printed_diverges_and_ends_in_a_fault() {
    let run = sinusoid(&Variant {
        law_as_printed: true,
        stribeck: false,
        ..perturbed(0)
    });
    let ended = run.ended.expect("a fault ends the run");
    assert!(ended.ended_s > 0.5, "{ended:?}");
    assert!(run.max_error_m <= 0.26, "{} m", run.max_error_m);
}

#[test]
fn the_impulse_depends_on_stiffness_and_the_first_transient_does_not() {
    let stiffness = &scenario::PROBING_STIFFNESS_N_PER_M[3..];
    let strokes = side_by_side(stiffness, |k| probing(&Variant::EXACT, *k));
    let peaks: Vec<f64> = strokes.iter().map(|s| s.peak_filtered_n).collect();
    let over_speed: Vec<f64> = strokes
        .iter()
        .map(|s| s.peak_filtered_n / s.approach_m_per_s)
        .collect();
    let middle = median(&peaks).expect("six runs");
    assert!((15.0..=25.0).contains(&middle), "{peaks:?}");
    assert!(spread(&peaks).expect("six runs") <= 0.35, "{peaks:?}");
    assert!(
        spread(&over_speed).expect("six runs") <= 0.15,
        "{over_speed:?}"
    );
    assert!(strokes[0].rest_force_n <= 0.5, "{:?}", strokes[0]);

    let points: Vec<(f64, f64)> = stiffness
        .iter()
        .zip(&strokes)
        .map(|(k, stroke)| (*k, stroke.impulse_newton_s))
        .collect();
    let fit = LineFit::new(&points).expect("a line");
    assert!(fit.slope > 0.0 && fit.r2 >= 0.97, "{fit:?}");
}

/// At low stiffness, the impulse consists of the impact and the effect of friction. The impact depends on the apparent mass of
/// the arm at the tip, and not on the stiffness.
#[test]
fn the_impulse_of_a_soft_contact_is_mostly_that_of_the_impact() {
    let stiffness = [0.5, 1.0, 2.0, 125.0];
    let strokes = side_by_side(&stiffness, |k| probing(&perturbed(0), *k));
    let setup = wam4();
    let config = setup.config(&Variant::EXACT).expect("valid");
    let touch_m = [0.70, 0.0, scenario::FACE_M + setup.tip_radius_m()].into();
    let bent = [0.0, 1.0, 0.0, 1.4].into();
    let (arm, roles, limits) = (&config.arm, &config.roles, &config.limits);
    let touch = inverse_kinematics(arm, roles, limits, &bent, &touch_m);
    assert!(touch.reached());
    let mass_kg = effective_mass_kg(arm, &touch.position_rad, &[0.0, 0.0, 1.0].into());
    let mass_kg = mass_kg.expect("a regular pose");
    for stroke in &strokes {
        let speed = stroke.approach_m_per_s * (1.0 + stroke.restitution);
        let ratio = stroke.impact_newton_s / (mass_kg * speed);
        // The ratio is 1.11 to 1.17, because joint friction also acts during the impact.
        assert!((0.9..=1.2).contains(&ratio), "{ratio} {stroke:?}");
    }
    for stroke in &strokes[..3] {
        assert!(stroke.impulse_newton_s >= stroke.impact_newton_s);
        assert!(stroke.impulse_newton_s <= 0.4, "{stroke:?}");
    }
}

/// With the model error of an identification, but without the travel over which friction reverses, the arm presses with the force of
/// the spring at 125 N/m. At 5 N/m, the 0.2 N of the
/// spring are a tenth of the friction at rest: the arm may press less, but not more.
#[test]
fn the_pressing_force_is_that_of_the_spring() {
    let cases: Vec<(u64, f64)> = (0..5)
        .flat_map(|seed| [(seed, 5.0), (seed, 125.0)])
        .collect();
    let strokes = side_by_side(&cases, |(seed, k)| probing(&perturbed(*seed), *k));
    for ((seed, k), stroke) in cases.iter().zip(&strokes) {
        let beyond_n = stroke.pressing_force_n - stroke.spring_force_n;
        let (min_n, max_n) = match *k {
            5.0 => (-0.2, 0.1),
            _ => (-0.05 * stroke.spring_force_n, 0.05 * stroke.spring_force_n),
        };
        let within = (min_n..=max_n).contains(&beyond_n);
        assert!(within, "{k} N/m, model {seed}: {stroke:?}");
    }
}

/// With a model identified on the arm, dry friction follows the measured motion through impact and rebounds, so that the force on the
/// block is that of the spring: within 0.1 N of 0.2 N at 5 N/m and within 2 % at 125 N/m, for blocks of several heights. At 200 N/m the
/// block holds the arm so still that its encoders do not change: that is no fault.
#[test]
fn an_identified_model_presses_with_the_force_of_the_spring() {
    let description = Description::asset("wam4").expect("a built-in arm");
    let setups = side_by_side(&[0, 1], |seed| {
        let model = calibrated::<4>(&description, &PlantOptions::default(), *seed);
        let model = model.expect("the arm is calibrated");
        let friction = &model.config::<4>().expect("valid").friction;
        assert!(friction.iter().all(|of| of.presliding_rad > 0.0));
        Setup::<4>::with_model(&description, &model, *seed).expect("four joints")
    });
    let cases: Vec<(usize, f64, f64)> = (0..2)
        .flat_map(|seed| [5.0, 125.0, 200.0].map(|k| (seed, k)))
        .flat_map(|(seed, k)| [-3e-4, -1e-4, 1e-4, 3e-4].map(|higher_m| (seed, k, higher_m)))
        .collect();
    let forces = side_by_side(&cases, |(seed, stiffness_n_per_m, higher_m)| {
        let setup = &setups[*seed];
        let (path, _) = scenario::probe(setup.tip_radius_m());
        let duration_s = path.cycle_s();
        let mut plan = plan(setup, &Variant::EXACT, Trajectory::Probe(path), duration_s);
        plan.config.law.gains = scenario::gains(*stiffness_n_per_m);
        plan.plant.scene = scenario::block();
        plan.plant.scene.fixed_blocks[0].center_m[2] += higher_m;
        let found = probe(&plan).expect("probing runs");
        assert_eq!(found.ended, None, "{stiffness_n_per_m} N/m");
        let stroke = median_stroke(&found.strokes);
        (stroke.pressing_force_n, stroke.spring_force_n)
    });
    for (case, (pressing_n, spring_n)) in cases.iter().zip(&forces) {
        let bound_n = match case.1 {
            5.0 => 0.1,
            _ => 0.02 * spring_n,
        };
        let excess_n = pressing_n - spring_n;
        assert!(
            excess_n.abs() <= bound_n,
            "{case:?}: {pressing_n} of {spring_n} N"
        );
    }
}

#[test]
fn without_fading_the_friction_feed_forward_becomes_contact_force() {
    let faded = probing(&Variant::EXACT, 5.0);
    let left_on = probing(
        &Variant {
            fade: false,
            ..Variant::EXACT
        },
        5.0,
    );
    assert!(
        left_on.rest_force_n > 2.0 * faded.rest_force_n.max(0.1),
        "{left_on:?} {faded:?}"
    );
    assert!(left_on.impulse_newton_s > 1.5 * faded.impulse_newton_s);
    let latched_s = faded.latched_after_s.expect("contact is detected");
    assert!(latched_s < 0.02, "{latched_s} s");
}

#[test]
fn the_error_after_a_corner_decays_along_the_edge() {
    let setup = wam4();
    let (quadrant, duration_s) = scenario::quadrant(scenario::QUADRANT_SPEED_M_PER_S);
    let trajectory = Trajectory::Quadrant(quadrant);
    let mut accumulator = SegmentErrorAccumulator::new(quadrant);
    run(
        &plan(&setup, &Variant::EXACT, trajectory, duration_s),
        &mut |cycle, time_s| {
            if let (Some(time_s), Some(reference)) = (time_s, cycle.output.reference) {
                let error = reference.position - cycle.truth.tip_position_m;
                accumulator.add_cycle(time_s, error.norm());
            }
            Ok(())
        },
    )
    .expect("the quadrant runs");
    let edges = accumulator.finish();
    assert_eq!(edges.len(), 6);
    for edge in edges.iter().filter(|edge| !edge.from_rest) {
        assert!(
            edge.last_quarter_error_m < 0.5 * edge.peak_error_m,
            "{edge:?}"
        );
    }
}

#[test]
fn reruns_are_bit_identical() {
    let torques = || {
        let setup = wam4();
        let (trajectory, _) = scenario::sinusoid(1.0);
        let mut bits = Vec::new();
        run(
            &plan(&setup, &perturbed(5), trajectory, 1.0),
            &mut |cycle, _| {
                bits.extend(cycle.output.torque_nm.iter().map(|t| t.to_bits()));
                Ok(())
            },
        )
        .expect("the sinusoid runs");
        bits
    };
    assert_eq!(torques(), torques());
}

#[test]
fn no_contact_is_detected_in_free_motion() {
    for (trajectory, duration_s) in [scenario::sinusoid(1.0), scenario::arc()] {
        for seed in [0, 4] {
            let plan = plan(&wam4(), &perturbed(seed), trajectory, duration_s);
            run(&plan, &mut |cycle, time_s| {
                let output = &cycle.output;
                assert!(
                    !output.in_contact,
                    "seed {seed} at {time_s:?} s: {output:?}"
                );
                Ok(())
            })
            .expect("it runs");
        }
    }
}

#[test]
fn an_unreachable_point_is_rejected_with_point_and_distance() {
    let setup = wam4();
    let trajectory = Trajectory::Hold([1.5, 0.0, 0.0].into());
    let plan = plan(&setup, &Variant::EXACT, trajectory, 1.0);
    let error = run(&plan, &mut |_, _| Ok(())).expect_err("out of reach");
    assert!(matches!(error, ExperimentError::BeyondJointStop { .. }));
    let text = error.to_string();
    assert!(text.contains("1.500") && text.contains("test"), "{text}");
}

#[test]
fn a_run_starts_with_gravity_hold_and_a_move() {
    let (trajectory, _) = scenario::sinusoid(1.0);
    let plan = plan(&wam4(), &perturbed(2), trajectory, 0.5);
    let mut modes = Vec::new();
    run(&plan, &mut |cycle, _| {
        if modes.last() != Some(&cycle.output.mode) {
            modes.push(cycle.output.mode);
        }
        Ok(())
    })
    .expect("it runs");
    assert_eq!(modes, [Mode::GravityHold, Mode::Move, Mode::Track]);
}

#[test]
fn perturbed_models_track_a_pose_at_5_n_per_m_and_half_a_n_m_per_rad() {
    let description = Description::asset("wam7").expect("a built-in arm");
    let setup = Setup::<7>::new(&description, 1).expect("seven joints");
    let seeds: Vec<u64> = (0..10).collect();
    let found = side_by_side(&seeds, |seed| {
        track_pose(&setup, &perturbed(*seed)).expect("the pose is tracked")
    });
    for (seed, tracking) in found.iter().enumerate() {
        println!("model {seed}: {tracking:?}");
        assert!(tracking.rms_error_m <= 0.015, "model {seed}: {tracking:?}");
        assert!(
            tracking.rms_rotation_rad <= 2_f64.to_radians(),
            "model {seed}: {tracking:?}"
        );
    }
}

/// With seven active joints, the position task leaves four directions free, including the wrist.
#[test]
fn the_sinusoid_runs_with_seven_active_joints() {
    let description = Description::asset("wam7")
        .and_then(|arm| arm.with_all_joints_active())
        .expect("the 7-joint arm");
    let setup = Setup::<7>::new(&description, 1).expect("seven joints");
    let mut config = setup.config(&perturbed(1)).expect("a physical model");
    config.law.gains = scenario::gains(scenario::STIFFNESS_N_PER_M);
    let (trajectory, duration_s) = scenario::sinusoid(1.0);
    let plan = Plan {
        name: "seven".to_owned(),
        config,
        plant: setup.plant(&perturbed(1), Scene::default()),
        trajectory,
        duration_s,
        learning: false,
        gain_change: None,
    };
    let run = run(&plan, &mut |_, _| Ok(())).expect("the sinusoid runs");
    println!("{:.1} mm", run.rms_error_m * 1e3);
    assert_eq!(run.ended, None);
    assert!(run.rms_error_m < 0.015, "{} m", run.rms_error_m);
}

/// Tracks sinusoids with the arms with geared motors, at 5 N/m with a model that has the error of an identification. In the
/// sagittal plane of the OpenArm, joint 2 stands still, as the base of the paper's arm does. Outside this plane, it moves slightly
/// and reverses, with a short lever arm: its dry friction then causes a greater error. Measured: 3.5 and 4.1, 3.0 and 4.4, 5.0 and 7.6 mm.
#[test]
fn openarm_and_yam_track_a_sinusoid_at_5_n_per_m() {
    fn rms_error_m<const N: usize>(name: &str, centre_m: [f64; 3], seed: u64) -> f64 {
        let description = Description::asset(name).expect("a built-in arm");
        let setup = Setup::<N>::new(&description, 1).expect("its joints");
        let mut config = setup.config(&perturbed(seed)).expect("a physical model");
        config.law.gains = scenario::gains_like(&config.law.gains, scenario::STIFFNESS_N_PER_M);
        let sinusoid = Sinusoid {
            centre_m: centre_m.into(),
            amplitude_m: [0.08, 0.0, 0.0].into(),
            ..Sinusoid::paper(1.0)
        };
        let plan = Plan {
            name: name.to_owned(),
            config,
            plant: setup.plant(&perturbed(seed), Scene::default()),
            trajectory: Trajectory::Sinusoid(sinusoid),
            duration_s: 2.0 * sinusoid.period_s(),
            learning: false,
            gain_change: None,
        };
        let run = run(&plan, &mut |_, _| Ok(())).unwrap_or_else(|error| panic!("{name}: {error}"));
        println!("{name}, model {seed}: {:.1} mm", run.rms_error_m * 1e3);
        assert_eq!(run.ended, None, "{name}");
        run.rms_error_m
    }
    let seeds: Vec<u64> = (0..2).collect();
    let found = side_by_side(&seeds, |seed| {
        [
            rms_error_m::<7>("openarm", [0.31, -0.149, 0.42], *seed),
            rms_error_m::<6>("yam", [0.40, 0.0, 0.42], *seed),
            rms_error_m::<7>("openarm", [0.31, -0.23, 0.43], *seed),
        ]
    });
    for errors_m in found {
        let [openarm, yam, oblique] = errors_m;
        assert!(openarm < 0.007 && yam < 0.007, "{errors_m:?}");
        assert!(oblique < 0.012, "{errors_m:?}");
    }
}

/// The arms with geared motors probe at every stiffness of figure 5: their damping ratio is possible with the delay of the loop at the greatest,
/// too, where a request of more damping is refused.
#[test]
fn openarm_and_yam_begin_to_probe_at_the_greatest_stiffness() {
    fn runs<const N: usize>(name: &str, damping_factor: f64) -> bool {
        let given = Description::asset(name).expect("a built-in arm");
        // With the place of the block, as the programs derive it.
        let description = given.completed().expect("a place in reach").description;
        let setup = Setup::<N>::new(&description, 1).expect("its joints");
        let greatest = scenario::PROBING_STIFFNESS_N_PER_M;
        let greatest = greatest.iter().copied().fold(0.0, f64::max);
        let mut config = setup.config(&perturbed(1)).expect("a physical model");
        config.law.gains = scenario::gains_like(&config.law.gains, greatest);
        config.law.gains.damping_n_s_per_m *= damping_factor;
        let paths = setup.paths();
        let (probe, _) = paths.probe(setup.tip_radius_m());
        let plan = Plan {
            name: name.to_owned(),
            config,
            plant: setup.plant(&perturbed(1), scenario::block_at(&paths)),
            trajectory: Trajectory::Probe(probe),
            duration_s: 0.5,
            learning: false,
            gain_change: None,
        };
        run(&plan, &mut |_, _| Ok(())).is_ok_and(|run| run.ended.is_none())
    }
    assert!(runs::<7>("openarm", 1.0) && runs::<6>("yam", 1.0));
    assert!(!runs::<6>("yam", 1.1), "the limit is 16.4 N s/m");
}
