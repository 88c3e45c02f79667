//! Tests of the closed-loop identification of the simulated arm: the result is compared with the plant and used to track at
//! 5 N/m. The fit uses only data that the arm logs.

use nalgebra::DMatrix;
use std::path::Path;
use supple_core::Vector;
use supple_core::controller::Request;
use supple_core::dynamics::gravity;
use supple_experiment::calibrate::{plant_of, preparation};
use supple_experiment::procedure::{
    InProcessArm, LOGS, Operator, ProcedureOptions, Sweep, calibrate_arm,
};
use supple_experiment::{
    Calibration, CalibrationResult, IdentifiedModelTracking, Mismatch, Plan, RequestSequence, Step,
    Wiring, breakaway, calibrate, identify_ripple, predict_tracking_error, run, scenario,
    track_with_identified_model,
};
use supple_ident::{Learning, Log, Motion, learn};
use supple_model::{Description, IdentifiedModel};
use supple_plant::PlantOptions;

const SEEDS: u64 = 10;

fn wam4() -> Description {
    Description::asset("wam4").expect("a built-in arm")
}

fn found(calibration: &Calibration) -> CalibrationResult<4> {
    calibrate::<4>(&wam4(), calibration, &mut |_| {}).expect("it is calibrated")
}

/// Tracks the sinusoid with the identified model on the plant that it was identified on.
fn sinusoid(found: &CalibrationResult<4>, calibration: &Calibration) -> IdentifiedModelTracking {
    let plant = plant_of::<4>(&wam4(), calibration).expect("four joints");
    track_with_identified_model(&found.description, &plant)
        .expect("the sinusoid runs")
        .expect("the arm reaches the sinusoid")
}

fn side_by_side<O: Send>(seeds: u64, f: impl Fn(u64) -> O + Sync) -> Vec<O> {
    std::thread::scope(|scope| {
        let odd = scope.spawn(|| (1..seeds).step_by(2).map(&f).collect::<Vec<_>>());
        let mut all: Vec<O> = (0..seeds).step_by(2).map(&f).collect();
        all.extend(odd.join().expect("no calibration panics"));
        all
    })
}

/// Returns a calibration whose plant has only friction that the model can represent, so that plant and model are comparable.
fn without_load(seed: u64) -> Calibration {
    Calibration {
        load: false,
        ..Calibration::new(seed)
    }
}

#[test]
fn the_identified_model_is_accurate_enough_for_5_n_per_m() {
    let results = side_by_side(SEEDS, |seed| {
        let calibration = without_load(seed);
        let found = found(&calibration);
        let errors = sinusoid(&found, &calibration);
        let plant = plant_of::<4>(&wam4(), &calibration).expect("four joints");
        let model = found.description.config::<4>().expect("four joints");
        let friction = model.friction.iter().zip(&plant.friction);
        let breakaway = friction.map(|(found, truth)| found.breakaway_nm / truth.breakaway_nm);
        let breakaway: Vec<f64> = breakaway.collect();
        (
            found.truth,
            breakaway,
            found.validation.positive_definite,
            errors,
        )
    });
    for (truth, breakaway, positive_definite, errors) in results {
        // Neither the presliding of the bristle model nor the friction band of the law hides the Stribeck effect.
        assert!(
            breakaway.iter().all(|ratio| (ratio - 1.0).abs() < 0.02),
            "{breakaway:?}"
        );
        let (coulomb_m, stribeck_m) = (errors.coulomb_m, errors.stribeck_m);
        println!("{truth:?} {coulomb_m} {stribeck_m}");
        assert!(truth.gravity_relative <= 5e-4, "{truth:?}");
        assert!(
            truth.friction_relative.iter().all(|f| *f <= 0.02),
            "{truth:?}"
        );
        assert_eq!(positive_definite, 1.0);
        assert!(coulomb_m <= 6e-3, "{coulomb_m} m with the Coulomb law");
        assert!(stribeck_m <= 3e-3, "{stribeck_m} m with the Stribeck law");
    }
}

/// Identifies a ripple of 0.3 N m at each joint from runs at constant speed.
#[test]
fn ripple_is_identified_and_compensated() {
    let errors = side_by_side(SEEDS, |seed| {
        let calibration = Calibration {
            ripple_nm: 0.3,
            ..without_load(seed)
        };
        let found = found(&calibration);
        assert!(
            found
                .ripple
                .iter()
                .all(|table| !table.harmonics().is_empty())
        );
        let with = sinusoid(&found, &calibration);
        // The error without compensation is measured for a few seeds only.
        let without = (seed < 2).then(|| {
            let mut without = found.clone();
            let model = without
                .description
                .toml()
                .replace("ripple = ", "# ripple = ");
            without.description =
                Description::from_text(&model, without.description.urdf()).expect("valid");
            sinusoid(&without, &calibration).coulomb_m
        });
        (with, without)
    });
    for (with, without) in errors {
        println!("{with:?}, not compensated {without:?}");
        assert!(with.coulomb_m <= 8e-3, "{with:?}");
        assert!(with.stribeck_m <= 8e-3, "{with:?}");
        if let Some(without_m) = without {
            assert!(
                with.coulomb_m < 0.7 * without_m,
                "{with:?} against {without_m} m"
            );
        }
    }
}

#[test]
fn load_dependent_friction_increases_the_error_little() {
    let calibration = Calibration {
        load: true,
        ..without_load(3)
    };
    let errors = sinusoid(&found(&calibration), &calibration);
    println!("{errors:?}");
    assert!(errors.coulomb_m <= 8e-3, "{errors:?}");
    assert!(errors.stribeck_m <= 8e-3, "{errors:?}");
}

#[test]
fn measured_breakaway_torque_matches_the_plant() {
    let calibration = without_load(0);
    let description = wam4();
    let config = description.config::<4>().expect("four joints");
    let off = calibration.start.apply(&config).expect("an arm");
    let plant = plant_of::<4>(&description, &calibration).expect("four joints");
    let pose = [0.0, 0.3, 0.0, 0.5].into();
    let found = breakaway(&off, &plant, &pose, &[1, 3], &mut |_| {}).expect("both slide");
    for (joint, found) in [1, 3].into_iter().zip(found) {
        let truth = plant.friction[joint].breakaway_nm;
        let relative = found.breakaway_nm() / truth - 1.0;
        assert!(
            relative.abs() < 0.08,
            "joint {joint}: {found:?} against {truth}"
        );
        // The difference between the directions is the error of the gravity model.
        let lacking_nm = (gravity(&config.arm, &pose) - gravity(&off.arm, &pose))[joint];
        let offset_nm = found.offset_nm();
        assert!(
            (offset_nm - lacking_nm).abs() < 0.02,
            "joint {joint}: {offset_nm} N m against {lacking_nm} N m"
        );
    }
}

/// Each joint has 0.3 N m of ripple; the ripple table is identified from slow motion before the model.
#[test]
fn ripple_compensation_improves_the_breakaway_measurement() {
    let calibration = Calibration {
        ripple_nm: 0.3,
        ..without_load(0)
    };
    let description = wam4();
    let config = description.config::<4>().expect("four joints");
    let off = calibration.start.apply(&config).expect("an arm");
    let plant = plant_of::<4>(&description, &calibration).expect("four joints");
    let home = description.home::<4>().expect("four joints");
    let mut compensated = off;
    compensated.ripple = identify_ripple(&off, &plant, &home).expect("ripple");
    let pose = [0.0, 0.3, 0.0, 0.5].into();
    let error_nm = |config| {
        let found = breakaway(config, &plant, &pose, &[1, 3], &mut |_| {}).expect("both slide");
        let errors = [1, 3].into_iter().zip(found);
        errors
            .map(|(joint, found)| (found.breakaway_nm() - plant.friction[joint].breakaway_nm).abs())
            .fold(0.0, f64::max)
    };
    let (with_nm, without_nm) = (error_nm(&compensated), error_nm(&off));
    println!("breakaway off by {with_nm} N m, {without_nm} N m without compensation");
    assert!(
        with_nm < 0.5 * without_nm,
        "{with_nm} N m against {without_nm} N m"
    );
    let relative = with_nm
        / plant.friction[1]
            .breakaway_nm
            .min(plant.friction[3].breakaway_nm);
    assert!(relative < 0.1, "{relative}");
}

#[test]
fn predicted_tracking_error_bounds_the_measured_one() {
    let calibration = without_load(2);
    let found = found(&calibration);
    let predicted = predict_tracking_error(&found.description, &found.fit, 3)
        .expect("it runs")
        .expect("the arm reaches the sinusoid");
    let measured = sinusoid(&found, &calibration).stribeck_m;
    assert!(
        predicted.verdict().starts_with("good for 5 N/m"),
        "{predicted:?}"
    );
    assert!(
        measured <= 2.0 * predicted.worst_m.expect("a run"),
        "{measured} m against {predicted:?}"
    );
}

/// Fast moves through the workspace, each followed by a rest, do not reach the collision thresholds that the calibration derives
/// from the model's residual; these thresholds are tighter than the default.
#[test]
fn identified_collision_thresholds_are_tight_and_not_reached_by_moves() {
    let calibration = without_load(3);
    let found = found(&calibration);
    let config = found.description.config::<4>().expect("four joints");
    let default_nm = wam4().config::<4>().expect("four joints").collision;
    let threshold_nm = config.collision.move_joint_torque_nm;
    let home = wam4().home::<4>().expect("four joints");
    let poses = [
        [0.8, -1.2, 0.0, 2.4],
        [-0.9, -0.7, 0.0, 1.6],
        [0.3, -1.7, 0.0, 2.8],
        [1.4, -0.4, 0.0, 1.9],
        [0.0, -1.8, 0.0, 2.9],
    ];
    let mut from = home;
    let mut steps = vec![Step::wait(Request::GravityHold, 0.5)];
    for pose in poses.into_iter().cycle().take(2 * poses.len()) {
        let target_rad = Vector::from(pose);
        // Mean speed of a minimum-jerk move with a peak of half of the joints' speed limit.
        let mean_rad_per_s = 0.5 * config.limits.joint_speed_rad_per_s[1] / 1.875;
        let duration_s = (target_rad - from).amax() / mean_rad_per_s;
        let request = Request::Move {
            target_rad,
            duration_s,
        };
        steps.push(Step::wait(request, duration_s + 0.5));
        from = target_rad;
    }
    let sequence = RequestSequence {
        name: "moves".to_owned(),
        config,
        plant: plant_of::<4>(&wam4(), &calibration).expect("four joints"),
        start_rad: home,
        steps,
    };
    let mut share = Vector::<4>::zeros();
    // The run returns a fault as an error.
    let done = sequence.perform(&mut |cycle, step| {
        if step > 0 {
            let external_nm = cycle.output.external_torque_nm.abs();
            share = share.sup(&external_nm.component_div(&threshold_nm));
        }
        Ok(())
    });
    let tighter = threshold_nm.component_div(&default_nm.move_joint_torque_nm);
    println!("thresholds {threshold_nm} N m, {tighter} of the default; reached {share}");
    done.expect("no move faults");
    assert!(tighter.max() <= 1.0 && tighter.min() < 0.5, "{tighter}");
    assert!(share.max() < 0.8, "{share}");
}

/// Friction is 10 % too small in every joint and is learnt only from each period's prediction error.
#[test]
fn a_friction_error_of_10_percent_is_learnt_within_four_periods() {
    let description = wam4();
    let plant = plant_of::<4>(&description, &without_load(0)).expect("four joints");
    let mut config = description.config::<4>().expect("four joints");
    config.law.gains = scenario::gains(scenario::STIFFNESS_N_PER_M);
    for friction in &mut config.friction {
        friction.viscous_nm_s_per_rad *= 0.9;
        friction.coulomb_nm *= 0.9;
        friction.breakaway_nm *= 0.9;
    }
    let moving = [1, 3];
    let mut errors = Vec::new();
    for period in 0..4 {
        let (trajectory, _) = scenario::sinusoid(1.0);
        let plan = Plan {
            name: format!("period {period}"),
            config,
            plant: plant.clone(),
            trajectory,
            duration_s: 8.5,
            learning: false,
            gain_change: None,
        };
        let mut rows: Vec<(f64, Vector<4>, Vector<4>)> = Vec::new();
        let done = run(&plan, &mut |cycle, time_s| {
            if let Some(t_s) = time_s {
                let q = cycle.measurement.position_rad;
                rows.push((t_s, q, cycle.output.torque_nm));
            }
            Ok(())
        })
        .expect("the sinusoid runs");
        errors.push(done.rms_error_m);
        let log = Log {
            t_s: rows.iter().map(|row| row.0).collect(),
            q_rad: DMatrix::from_fn(rows.len(), 4, |i, j| rows[i].1[j]),
            qd_rad_per_s: None,
            tau_nm: DMatrix::from_fn(rows.len(), 4, |i, j| rows[i].2[j]),
        };
        let prepare = preparation(config.period_s, 8.0);
        let (motion, _) = Motion::prepare(&log, 4, &moving, &prepare).expect("a log");
        let learning = Learning::default();
        config.friction = learn(&config, &[motion], &moving, &learning)
            .expect("it learns")
            .friction;
    }
    println!("{errors:?}");
    assert!(
        errors[0] > 6e-3,
        "the initial error is too small to test learning: {errors:?}"
    );
    assert!(errors[3] <= 6e-3, "{errors:?}");
}

/// Operator that confirms every question.
struct ConfirmingOperator;

impl Operator for ConfirmingOperator {
    fn progress(&mut self, _: &str) {}

    fn confirms(&mut self, _: &Sweep, _: &Path) -> bool {
        true
    }

    fn attaches_weight(&mut self, _: f64) -> bool {
        false
    }
}

/// Starts a calibration of a simulated arm with wrong wiring; returns the error.
fn refusal(wiring: Wiring<4>) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::create_dir_all(folder.path().join(LOGS)).expect("created");
    let (arm, calibration) = (wam4(), Calibration::new(0));
    let plant = plant_of::<4>(&arm, &calibration).expect("four joints");
    let home = arm.home().expect("four joints");
    let logs = folder.path().join(LOGS);
    let mut simulated =
        InProcessArm::new(plant, home, logs, Default::default()).with_wiring(wiring);
    let options = ProcedureOptions::new(folder.path().to_owned());
    let result = calibrate_arm(&mut simulated, &arm, &options, &mut ConfirmingOperator);
    result.expect_err("the calibration is refused").to_string()
}

/// The error names a joint whose motor moves the encoder of another joint, and a motor with reversed direction.
#[test]
fn the_error_of_wrong_wiring_names_the_joint() {
    let swapped = refusal(Wiring {
        encoder_of: Some([2, 1, 0, 3]),
        ..Wiring::AS_DESCRIBED
    });
    for part in ["joint 0 (joint1)", "joint 2 (joint3)", "swapped", "TOML"] {
        assert!(swapped.contains(part), "{part}: {swapped}");
    }
    let reversed = refusal(Wiring {
        torque_factor: Some([-1.0, 1.0, 1.0, 1.0]),
        ..Wiring::AS_DESCRIBED
    });
    for part in ["joint 0 (joint1)", "check the signs of encoder and motor"] {
        assert!(reversed.contains(part), "{part}: {reversed}");
    }
}

/// Calibrates a realistic arm from a model with errors of 15 % in gravity and 50 % in friction: within six minutes of motion, as
/// predicted, the model predicts held-out data, and with learning the arm tracks the sinusoid at 5 N/m.
#[test]
fn a_realistic_arm_is_calibrated_step_by_step() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::create_dir_all(folder.path().join(LOGS)).expect("created");
    let (arm, nominal) = (wam4(), wam4().config::<4>().expect("four joints"));
    let calibration = Calibration {
        plant: PlantOptions::realistic(),
        ..Calibration::new(0)
    };
    let plant = plant_of::<4>(&arm, &calibration).expect("four joints");
    let errors = Mismatch {
        gravity: 0.15,
        friction: 0.5,
        seed: 0,
    };
    let wrong = errors.apply(&nominal).expect("physical");
    let start = arm.with_model(&IdentifiedModel {
        arm: &wrong.arm,
        friction: &wrong.friction,
        ripple: None,
        source: "wrong",
    });
    let start = start.expect("described");
    let home = arm.home().expect("four joints");
    let logs = folder.path().join(LOGS);
    let mut simulated = InProcessArm::new(plant, home, logs, Default::default());
    let options = ProcedureOptions::new(folder.path().to_owned());
    let found = calibrate_arm(&mut simulated, &start, &options, &mut ConfirmingOperator)
        .expect("calibrated");
    let progress = found.progress;
    assert!(
        progress.moved_s <= 360.0,
        "{} s of motion",
        progress.moved_s
    );
    let ratio = progress.moved_s / progress.stated_s;
    assert!((0.85..1.05).contains(&ratio), "{ratio} of the stated time");
    let fit = progress.fit.expect("fitted");
    assert!(fit.validation_relative < 0.08, "{fit:?}");
    let sinusoid = progress.sinusoid.expect("in reach");
    assert_eq!(sinusoid.ended, None);
    let [alone_m, learning_m] = [sinusoid.calibrated_rms_m, sinusoid.learning_rms_m];
    // Without the springs, the tilt and the compliance that the fit finds, the error of the model alone is 118 mm.
    assert!(alone_m.is_some_and(|m| m < 0.025), "{sinusoid:?}");
    assert!(learning_m.is_some_and(|m| m < 0.005), "{sinusoid:?}");
    assert_eq!(sinusoid.false_contacts, 0);
    // With the learned terms, the warm arm needs no further learning.
    let kept = sinusoid.learned_model.expect("learned");
    let kept = Description::load(folder.path().join(kept).join("arm.toml")).expect("saved");
    let warm = Calibration {
        plant: PlantOptions {
            warmed_s: Some(progress.moved_s),
            ..calibration.plant
        },
        ..calibration
    };
    let plant = plant_of::<4>(&arm, &warm).expect("four joints");
    let errors = track_with_identified_model(&kept, &plant).expect("the sinusoid runs");
    let errors = errors.expect("in reach");
    assert!(errors.stribeck_m < 0.008, "{errors:?}");
}
