//! Effects other than links and joint friction: their columns compared with an arm that has them, and the presliding distance.

use supple_core::dynamics::gravity;
use supple_core::learned::{LearnedTerms, MapWeights};
use supple_core::nalgebra::Rotation3;
use supple_core::{Arm, Config, Friction, Vector};
use supple_ident::columns::Column;
use supple_ident::regressor::rows;
use supple_ident::select::{compare, load_candidates};
use supple_ident::{
    Columns, DMatrix, Effects, FrictionColumns, Learning, LoadTorque, Motion, Options,
    feedforward_nm, fit, learn, presliding_rad,
};
use supple_model::Description;

const ALL: [usize; 4] = [0, 1, 2, 3];

fn wam4() -> Config<4> {
    Description::asset("wam4").unwrap().config::<4>().unwrap()
}

fn all_effects(config: &Config<4>) -> Effects {
    let motor_from_joint = config.joint_from_motor.try_inverse().unwrap();
    Effects::all(DMatrix::from_fn(4, 4, |m, j| motor_from_joint[(m, j)]))
}

fn columns(config: &Config<4>) -> Columns {
    let columns = Columns::new(4, &ALL, true, FrictionColumns::COULOMB_AND_OFFSET, &[]).unwrap();
    columns.with_effects(&all_effects(config))
}

fn poses() -> impl Iterator<Item = Vector<4>> {
    (0..12).map(|k| Vector::from_fn(|j, _| 1.3 * f64::from(3 * k + 2 * j as i32 + 1).sin()))
}

#[test]
fn columns_of_tilt_and_compliance_are_the_change_of_gravity() {
    let config = wam4();
    let (arm, columns) = (config.arm, columns(&config));
    let rest = Vector::<4>::zeros();
    let at = |column| columns.position(column).unwrap();
    for q in poses() {
        let found = rows(&arm, &columns, &q, &rest, &rest);
        for axis in 0..2 {
            let mut tilt = supple_core::math::Vector3::zeros();
            tilt[axis] = 1e-4;
            let turned = Rotation3::from_scaled_axis(tilt) * arm.gravity();
            let tip = arm.joint_from_tip();
            let tilted = Arm::from_links(*arm.links(), arm.armature(), tip, turned).unwrap();
            let change = gravity(&tilted, &q) - gravity(&arm, &q);
            for j in ALL {
                let expected = found[(j, at(Column::Tilt(axis)))] * 1e-4;
                assert!((change[j] - expected).abs() < 1e-6, "joint {j}");
            }
        }
        // A compliance of 1e-5 rad/(N m) of each joint in turn.
        for soft in ALL {
            let mut sagged = q;
            sagged[soft] -= 1e-5 * gravity(&arm, &q)[soft];
            let change = gravity(&arm, &sagged) - gravity(&arm, &q);
            for j in ALL {
                let expected = found[(j, at(Column::Compliance(soft)))] * 1e-2;
                assert!((change[j] - expected).abs() < 1e-5, "joint {j}");
            }
        }
    }
}

/// Friction of the motors is dissipative, and has columns only where a motor drives several joints.
#[test]
fn friction_of_motors_that_drive_several_joints_is_identified() {
    let config = wam4();
    let columns = columns(&config);
    let has = |column| columns.position(column).is_some();
    assert!(has(Column::MotorCoulomb(1)) && has(Column::MotorViscous(2)));
    assert!(!has(Column::MotorCoulomb(0)) && !has(Column::MotorViscous(3)));
    let rest = Vector::<4>::zeros();
    for qd in poses() {
        let found = rows(&config.arm, &columns, &rest, &qd, &rest);
        for motor in [1, 2] {
            for column in [Column::MotorCoulomb(motor), Column::MotorViscous(motor)] {
                let at = columns.position(column).unwrap();
                let power: f64 = ALL.iter().map(|j| qd[*j] * found[(*j, at)]).sum();
                assert!(power >= 0.0);
            }
        }
    }
}

/// A motion of an arm with a spring over each joint.
fn spring_motion(config: &Config<4>, stiffness: f64) -> Motion {
    let (rate_hz, samples) = (100.0, 6000);
    // The motion has two frequencies, because with one frequency a spring cannot be distinguished from an inertia.
    let angle = |i: usize, j: usize| {
        let t = i as f64 / rate_hz;
        let (f, g) = (0.9 + 0.37 * j as f64, 2.3 + 0.29 * j as f64);
        let (x, y) = (f * t, g * t);
        (
            0.7 * x.sin() + 0.2 * y.sin(),
            0.7 * f * x.cos() + 0.2 * g * y.cos(),
            -0.7 * f * f * x.sin() - 0.2 * g * g * y.sin(),
        )
    };
    let matrix =
        |of: fn((f64, f64, f64)) -> f64| DMatrix::from_fn(samples, 4, |i, j| of(angle(i, j)));
    let (q, qd, qdd) = (matrix(|a| a.0), matrix(|a| a.1), matrix(|a| a.2));
    let mut tau = DMatrix::zeros(samples, 4);
    for i in 0..samples {
        let at = |m: &DMatrix<f64>| Vector::<4>::from_fn(|j, _| m[(i, j)]);
        let torque = supple_core::dynamics::rnea(&config.arm, &at(&q), &at(&qd), &at(&qdd));
        for j in ALL {
            let friction = config.friction[j].torque_nm(qd[(i, j)]);
            tau[(i, j)] = torque[j] + friction + stiffness * q[(i, j)];
        }
    }
    Motion {
        rate_hz,
        q,
        qd,
        qdd,
        tau,
        independent_fraction: 1.0,
        cutoff_hz: None,
        start_s: 0.0,
        torque_delay_s: 0.0,
        excluded_intervals: Vec::new(),
    }
}

fn springs() -> Options {
    Options {
        effects: Effects {
            springs: true,
            ..Effects::default()
        },
        consistent_prior_weight: Some(1e-4),
        ..Options::default()
    }
}

/// A fit of an arm with a hose finds the hose's stiffness, and the learned terms of the controller equal its torque.
#[test]
fn an_identified_spring_becomes_a_learned_map() {
    let (config, stiffness) = (wam4(), 0.3);
    let motion = spring_motion(&config, stiffness);
    let options = springs();
    let found = fit(&config.arm, core::slice::from_ref(&motion), &ALL, &options).unwrap();
    let learned = found.learned(&config);
    for j in ALL {
        let limits = &config.limits;
        let (lower, upper) = (limits.position_lower_rad[j], limits.position_upper_rad[j]);
        for x in [0.1, 0.5, 0.8] {
            let q = lower + x * (upper - lower);
            let torque = MapWeights::new(q, lower, upper).of(&learned.map[j].torque_nm);
            // The map is bounded, so the comparison is limited to torques within the bound.
            let bound = 0.02 * limits.joint_torque_nm[j];
            let expected = (stiffness * q).clamp(-bound, bound);
            assert!(
                (torque - expected).abs() < 0.03,
                "joint {j} at {q}: {torque}, {expected}"
            );
        }
    }
}

/// The description of a fit contains all identified effects, and no learned terms of the replaced description, because the fit
/// explains the whole torque.
#[test]
fn description_of_a_fit_has_its_effects_and_no_older_ones() {
    let nominal = Description::asset("wam4").unwrap();
    let mut older = LearnedTerms::<4>::zero();
    older.parameters.payload_kg = 0.05;
    let learned = nominal.with_learned(&older, "an older run").unwrap();
    let config = learned.config::<4>().unwrap();
    assert_eq!(config.learned, older);
    let motion = spring_motion(&config, 0.3);
    let with_effects = Options {
        effects: Effects {
            springs: true,
            tilt: true,
            compliance: true,
            ..Effects::default()
        },
        consistent_prior_weight: Some(1e-4),
        ..Options::default()
    };
    let found = fit(
        &config.arm,
        core::slice::from_ref(&motion),
        &ALL,
        &with_effects,
    )
    .unwrap();
    let described = found.description(&learned, None).unwrap();
    let result = described.config::<4>().unwrap();
    assert_eq!(result.learned, found.learned(&result));
    assert!(result.learned.map[0].torque_nm[0].abs() > 0.1, "a spring");
    assert_eq!(result.learned.parameters.payload_kg, 0.0);
    let compliance = result.compliance_rad_per_nm;
    assert_eq!(compliance.as_slice(), found.compliance_rad_per_nm());

    let without = Options {
        consistent_prior_weight: Some(1e-4),
        ..Options::default()
    };
    let found = fit(&config.arm, &[motion], &ALL, &without).unwrap();
    let described = found.description(&learned, None).unwrap();
    assert_eq!(
        described.config::<4>().unwrap().learned,
        LearnedTerms::zero()
    );
    assert!(!described.toml().contains("[learned"));
}

/// Motors give different fractions of their commands: with a scale for each joint, one set of links explains all joints, and
/// a controller with the model and the scales commands the torques of another motion.
#[test]
fn torque_scales_that_differ_between_motors_are_found() {
    let nominal = Description::asset("wam4").unwrap();
    let config = wam4();
    let shares = [0.03, -0.04, 0.02, -0.03];
    let commanded = |mut motion: Motion| {
        for (j, share) in shares.iter().enumerate() {
            motion.tau.column_mut(j).scale_mut(1.0 + share);
        }
        motion
    };
    let motion = commanded(spring_motion(&config, 0.0));
    let with = |torque_scale: bool| Options {
        effects: Effects {
            torque_scale,
            ..Effects::default()
        },
        consistent_prior_weight: Some(10.0),
        ..Options::default()
    };
    let residual_nm = |torque_scale: bool| {
        let options = with(torque_scale);
        let found = fit(&config.arm, core::slice::from_ref(&motion), &ALL, &options).unwrap();
        let described = found.description(&nominal, None).unwrap();
        let found_config = described.config::<4>().unwrap();
        let error = feedforward_nm(&found_config, &motion) - &motion.tau;
        (found, error.norm() / motion.tau.norm())
    };
    let (_, without) = residual_nm(false);
    let (found, with) = residual_nm(true);
    assert!(with < 0.003 && with < 0.3 * without, "{with}, {without}");
    // A factor common to all motors is part of the links' parameters.
    let scale = found.torque_scale();
    for j in 1..4 {
        let ratio = (1.0 + scale[j]) / (1.0 + scale[0]);
        let expected = (1.0 + shares[j]) / (1.0 + shares[0]);
        assert!(
            (ratio - expected).abs() < 0.01,
            "joint {j}: {ratio}, {expected}"
        );
    }
}

/// Friction of gears grows with the torque of the motor: the fit finds its coefficient, cross-validation distinguishes it from
/// friction that grows with the load of the joint, and the controller commands the required torque.
#[test]
fn friction_that_grows_with_the_motors_torque_is_found() {
    let nominal = Description::asset("wam4").unwrap();
    let config = wam4();
    let mut motion = spring_motion(&config, 0.0);
    for i in 0..motion.samples() {
        for j in ALL {
            let friction = &config.friction[j];
            let qd = motion.qd[(i, j)];
            let direction = friction.direction(qd);
            // tau = rest + L |tau| p, rest being all but the friction that grows.
            let rest_nm = motion.tau[(i, j)];
            let more = direction * 0.1;
            motion.tau[(i, j)] = rest_nm / (1.0 - more * rest_nm.signum());
        }
    }
    let base = Options {
        consistent_prior_weight: Some(1e-4),
        ..Options::default()
    };
    let candidates = load_candidates(&base);
    let motions = [motion];
    let table = compare(&config.arm, &motions, &ALL, &candidates, 4).unwrap();
    assert_eq!(table.options().friction.load, Some(LoadTorque::Motor));
    let found = fit(&config.arm, &motions, &ALL, table.options()).unwrap();
    let described = found.description(&nominal, None).unwrap();
    let found_config = described.config::<4>().unwrap();
    for friction in &found_config.friction {
        assert!(
            (friction.load_coefficient - 0.1).abs() < 0.01,
            "{friction:?}"
        );
        assert_eq!(friction.load_torque, LoadTorque::Motor);
    }
    // A prediction depends on the motion alone: measured torques do not change it.
    let mut other = motions[0].clone();
    other.tau.iter_mut().for_each(|nm| *nm = 3.0 - *nm);
    let predicted = found.predict_motion(&motions[0]).unwrap();
    assert!((found.predict_motion(&other).unwrap() - &predicted).amax() < 1e-9);
    let residual = found.validate_motion(&motions[0]).unwrap();
    assert!(residual.total_relative < 0.01, "{residual:?}");
    // The controller uses the load of gravity alone, but this motion is fast.
    let without = fit(&config.arm, &motions, &ALL, &base).unwrap();
    let without = without.description(&nominal, None).unwrap();
    let [motion] = &motions;
    let residual_nm = |config: &Config<4>| (feedforward_nm(config, motion) - &motion.tau).norm();
    let (with, without) = (
        residual_nm(&found_config),
        residual_nm(&without.config::<4>().unwrap()),
    );
    assert!(with < 0.8 * without, "{with}, {without}");
}

/// A fit of some joints does not change compliance and springs of the other joints.
#[test]
fn description_of_a_fit_of_some_joints_keeps_the_terms_of_the_others() {
    let nominal = Description::asset("wam4").unwrap();
    let mut older = LearnedTerms::<4>::zero();
    for map in &mut older.map {
        map.torque_nm = [0.1; 16];
    }
    older.parameters.tilt_rad.x = 0.01;
    let given = nominal.with_compliance(&[1e-4; 4]).unwrap();
    let given = given.with_learned(&older, "an older run").unwrap();
    let config = given.config::<4>().unwrap();
    let motion = spring_motion(&config, 0.3);
    let options = Options {
        consistent_prior_weight: Some(1e-4),
        ..Options::default()
    };
    let found = fit(&config.arm, &[motion], &[1, 3], &options).unwrap();
    let result = found.description(&given, None).unwrap();
    let result = result.config::<4>().unwrap();
    assert_eq!(
        result.compliance_rad_per_nm.as_slice(),
        [1e-4, 0.0, 1e-4, 0.0]
    );
    let values = result.learned.map.map(|map| map.torque_nm[3]);
    assert_eq!(values, [0.1, 0.0, 0.1, 0.0]);
    assert_eq!(result.learned.parameters.tilt_rad.x, 0.0);
}

/// Learning from a repeated motion takes springs and compliance into account, and keeps them.
#[test]
fn learning_friction_keeps_the_springs() {
    let nominal = Description::asset("wam4").unwrap();
    let motion = spring_motion(&wam4(), 0.1);
    let options = springs();
    let found = fit(&wam4().arm, core::slice::from_ref(&motion), &ALL, &options).unwrap();
    let described = found.description(&nominal, None).unwrap();
    let config = described.config::<4>().unwrap();
    let learnt = learn(&config, &[motion], &ALL, &Learning::default()).unwrap();
    for j in ALL {
        let ratio = learnt.friction[j].coulomb_nm / config.friction[j].coulomb_nm;
        assert!((ratio - 1.0).abs() < 0.05, "joint {j}: {ratio}");
    }
    let after = learnt.description(&described).unwrap();
    assert_eq!(after.config::<4>().unwrap().learned, config.learned);
}

/// A motion in which every joint reverses, of an arm whose dry friction reverses over `travel_rad`; zero: with the velocity. Gears add
/// the share `load.0` of the torque `load.1`; the distance is then in proportion to the dry friction.
fn reversing_motion(config: &Config<4>, travel_rad: f64, load: (f64, LoadTorque)) -> Motion {
    let (rate_hz, samples) = (200.0, 12_000);
    let angle = |i: usize, j: usize| {
        let t = i as f64 / rate_hz;
        let f = 0.35 + 0.11 * j as f64;
        (
            0.5 * (f * t).sin(),
            0.5 * f * (f * t).cos(),
            -0.5 * f * f * (f * t).sin(),
        )
    };
    let matrix =
        |of: fn((f64, f64, f64)) -> f64| DMatrix::from_fn(samples, 4, |i, j| of(angle(i, j)));
    let mut motion = Motion {
        rate_hz,
        q: matrix(|a| a.0),
        qd: matrix(|a| a.1),
        qdd: matrix(|a| a.2),
        tau: DMatrix::zeros(samples, 4),
        independent_fraction: 1.0,
        cutoff_hz: None,
        start_s: 0.0,
        torque_delay_s: 0.0,
        excluded_intervals: Vec::new(),
    };
    let mut direction = [0.0; 4];
    for i in 0..samples {
        let at = |m: &DMatrix<f64>| Vector::<4>::from_fn(|j, _| m[(i, j)]);
        let (q, qd, qdd) = (at(&motion.q), at(&motion.qd), at(&motion.qdd));
        let torque = supple_core::dynamics::rnea(&config.arm, &q, &qd, &qdd);
        for j in ALL {
            let law = Friction {
                presliding_rad: travel_rad,
                load_coefficient: load.0,
                load_torque: load.1,
                ..config.friction[j]
            };
            let loaded = law.at_load(torque[j]);
            direction[j] = match travel_rad > 0.0 {
                true => loaded.direction_after(direction[j], qd[j] / rate_hz),
                false => loaded.direction(qd[j]),
            };
            motion.tau[(i, j)] =
                torque[j] + loaded.torque_in_direction_nm(qd[j], direction[j], 1.0);
        }
    }
    motion
}

/// The fit finds the distance over which friction reverses; friction that follows the sign of the velocity has none.
#[test]
fn the_presliding_distance_is_found_if_the_arm_has_one() {
    let config = wam4();
    for travel_rad in [0.0, 1e-3, 1.2e-3] {
        let motions = [reversing_motion(
            &config,
            travel_rad,
            (0.0, LoadTorque::Joint),
        )];
        let options = Options {
            consistent_prior_weight: Some(1e-4),
            ..Options::default()
        };
        let found = fit(&config.arm, &motions, &ALL, &options).unwrap();
        let travels = presliding_rad(&found, &motions).unwrap();
        for found_rad in travels {
            let error_rad = (found_rad - travel_rad).abs();
            assert!(error_rad <= 0.03 * travel_rad, "{found_rad} {travel_rad}");
        }
    }
}

/// Friction by load reverses with the same stiffness, over a distance in proportion to it. Shoulder and elbow carry several newton metres:
/// their gears add 0.5 to 4 N m to dry friction of 0.6 to 2 N m.
#[test]
fn the_presliding_distance_is_that_of_all_dry_friction() {
    let config = wam4();
    for (travel_rad, load_torque) in [
        (7e-4, LoadTorque::Joint),
        (2e-3, LoadTorque::Joint),
        (7e-4, LoadTorque::Motor),
        (2e-3, LoadTorque::Motor),
    ] {
        let motions = [reversing_motion(&config, travel_rad, (0.2, load_torque))];
        let options = Options {
            consistent_prior_weight: Some(1e-4),
            friction: FrictionColumns {
                load: Some(load_torque),
                ..FrictionColumns::COULOMB
            },
            ..Options::default()
        };
        let found = fit(&config.arm, &motions, &ALL, &options).unwrap();
        let travels = presliding_rad(&found, &motions).unwrap();
        let friction = found.friction();
        for j in ALL {
            let of_arm = Friction {
                presliding_rad: travel_rad,
                load_coefficient: 0.2,
                load_torque,
                ..config.friction[j]
            };
            let expected_rad = of_arm.at_load(friction[j].coulomb_at_nm).presliding_rad;
            let ratio = travels[j] / expected_rad;
            assert!((ratio - 1.0).abs() < 0.1, "{load_torque:?} {j}: {ratio}");
        }
    }
}
