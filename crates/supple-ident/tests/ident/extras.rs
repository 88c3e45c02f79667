//! Excitation design, ripple, learning and payload, each compared with a known arm.

use crate::support::motion;
use supple_core::dynamics::{gravity, rnea, tip_pose};
use supple_core::math::{Matrix3, Vector3};
use supple_core::ripple::Harmonic;
use supple_core::{Body, Config, Friction, Matrix, RippleTable, Vector};
use supple_ident::ExcludedInterval;
use supple_ident::excitation_design::{
    Criterion, DesignOptions, Workspace, constant_speed_series, design, slow_series,
};
use supple_ident::learn::with_payload;
use supple_ident::payload::{parameters_of, payload, torque_scale};
use supple_ident::weigh::weigh;
use supple_ident::{
    DMatrix, FrictionColumns, Learning, Motion, Options, RippleSearch, fit, fit_ripple, learn,
};
use supple_model::Description;
use supple_random::Random;

const ALL: [usize; 4] = [0, 1, 2, 3];

fn wam4() -> supple_core::Config<4> {
    Description::asset("wam4").unwrap().config::<4>().unwrap()
}

fn options() -> Options {
    Options {
        friction: FrictionColumns::COULOMB,
        consistent_prior_weight: Some(1e-4),
        ..Options::default()
    }
}

#[test]
fn a_design_improves_and_stays_within_every_limit() {
    let description = Description::asset("wam4").unwrap();
    let (config, home) = (wam4(), description.home::<4>().unwrap());
    let workspace = Workspace {
        lower_m: [-1.0, -1.0, -0.3],
        upper_m: [1.0, 1.0, 1.0],
    };
    for criterion in [Criterion::Condition, Criterion::DOptimality] {
        let request = DesignOptions {
            candidates: 120,
            criterion,
            workspace: Some(workspace),
            ..DesignOptions::new(&ALL)
        };
        let mut calls = 0;
        let found = design(&config, &home, &request, &mut |_, _| calls += 1).unwrap();
        assert_eq!(calls, 120);
        assert_eq!(found.history.len(), 120);
        assert!(found.history.windows(2).all(|w| w[1] <= w[0]));
        let first = found
            .history
            .iter()
            .find(|value| value.is_finite())
            .unwrap();
        assert!(found.history[119] < *first);
        // 24 parameters of links and rotors, and two of friction for each joint.
        assert!(found.rank >= 24 + 8, "{}", found.rank);
        found.series.within(&config.limits).unwrap();
        for i in 0..2000 {
            let at = found.series.at(0.03 * f64::from(i));
            let tip = tip_pose(&config.arm, &at.position_rad).translation;
            for axis in 0..3 {
                // Between the evaluated points the limits may be exceeded slightly.
                assert!(tip[axis] > workspace.lower_m[axis] - 5e-3);
                assert!(tip[axis] < workspace.upper_m[axis] + 5e-3);
            }
            let (q, qd, qdd) = (
                at.position_rad,
                at.velocity_rad_per_s,
                at.acceleration_rad_per_s2,
            );
            let torque = rnea(&config.arm, &q, &qd, &qdd);
            assert!((0..4).all(|j| torque[j].abs() < config.limits.joint_torque_nm[j]));
        }
    }
}

#[test]
fn only_the_given_joints_move() {
    let description = Description::asset("wam4").unwrap();
    let (config, home) = (wam4(), description.home::<4>().unwrap());
    let request = DesignOptions {
        candidates: 40,
        ..DesignOptions::new(&[1, 3])
    };
    let found = design(&config, &home, &request, &mut |_, _| {}).unwrap();
    let slow = slow_series(&config, &home, &[1, 3], 0.1, 30.0).unwrap();
    slow.within(&config.limits).unwrap();
    for series in [found.series, slow] {
        for i in 0..100 {
            let at = series.at(0.4 * f64::from(i));
            assert_eq!([at.position_rad[0], at.position_rad[2]], [home[0], home[2]]);
            assert!(at.velocity_rad_per_s.amax() <= 2.0);
        }
    }
}

#[test]
fn constant_speed_runs_have_constant_speed() {
    let description = Description::asset("wam4").unwrap();
    let (config, home) = (wam4(), description.home::<4>().unwrap());
    let (speed, period_s) = (0.05, 40.0);
    let run = constant_speed_series(&config, &home, &ALL, speed, period_s).unwrap();
    run.within(&config.limits).unwrap();
    let samples = 4000;
    for joint in ALL {
        let (mut forward, mut backward, mut fastest) = (0, 0, 0.0_f64);
        for i in 0..samples {
            // One period at full speed.
            let at =
                run.at(run.ramp_s + (period_s - run.ramp_s) * f64::from(i) / f64::from(samples));
            let v = at.velocity_rad_per_s[joint];
            forward += i32::from((v / speed - 1.0).abs() < 0.015);
            backward += i32::from((-v / speed - 1.0).abs() < 0.015);
            fastest = fastest.max(v.abs());
        }
        let fraction = |count| f64::from(count) / f64::from(samples);
        assert!(
            fraction(forward + backward) > 0.55,
            "joint {joint}: {}",
            fraction(forward + backward)
        );
        assert!(
            fraction(forward) > 0.2 && fraction(backward) > 0.2,
            "joint {joint}: in both directions"
        );
        assert!(fastest < 1.015 * speed, "{fastest}");
    }
}

#[test]
fn a_workspace_that_no_motion_stays_in_is_rejected() {
    let description = Description::asset("wam4").unwrap();
    let request = DesignOptions {
        candidates: 10,
        workspace: Some(Workspace {
            lower_m: [5.0; 3],
            upper_m: [6.0; 3],
        }),
        ..DesignOptions::new(&ALL)
    };
    let home = description.home::<4>().unwrap();
    let error = design(&wam4(), &home, &request, &mut |_, _| {}).unwrap_err();
    assert!(error.to_string().contains("widen"), "{error}");
}

#[test]
fn ripple_is_identified_at_its_harmonics_and_nowhere_else() {
    let config = wam4();
    let motor_from_joint = config.joint_from_motor.try_inverse().unwrap();
    let friction = [Friction::coulomb(1.0, 0.5); 4];
    let clean = motion(&config.arm, &friction, &ALL, 1200, 3);
    let found = fit(&config.arm, &[clean], &ALL, &options()).unwrap();
    let harmonic = |harmonic, sine_nm, cosine_nm| Harmonic {
        harmonic,
        sine_nm,
        cosine_nm,
        ..Harmonic::default()
    };
    let tables = [
        RippleTable::new(&[harmonic(2, 4e-3, -3e-3)]).unwrap(),
        RippleTable::new(&[
            harmonic(3, 5e-3, 0.0),
            Harmonic {
                sine_share: 0.02,
                ..harmonic(6, 0.0, 2e-3)
            },
        ])
        .unwrap(),
        RippleTable::NONE,
        RippleTable::new(&[harmonic(1, -2e-3, 6e-3)]).unwrap(),
    ];
    let slow = motion_with_ripple(&config.arm, &friction, &tables, &motor_from_joint);
    let search = RippleSearch::default();
    let got = fit_ripple(&found, &[slow], &motor_from_joint, &search).unwrap();
    for (motor, (got, wanted)) in got.iter().zip(&tables).enumerate() {
        for i in 0..200 {
            let p = 0.1 * f64::from(i);
            let error = got.torque_nm(p, 0.3) - wanted.torque_nm(p, 0.3);
            assert!(error.abs() < 4e-4, "motor {motor} at {p}: {error}");
        }
    }
    assert!(got[2].harmonics().is_empty(), "{:?}", got[2]);
}

/// Slow motion of the joints; the torque is what motors with ripple must be commanded to produce it.
fn motion_with_ripple(
    arm: &supple_core::Arm<4>,
    friction: &[Friction; 4],
    tables: &[RippleTable; 4],
    motor_from_joint: &Matrix<4, 4>,
) -> Motion {
    let (rate_hz, samples) = (100.0, 6000);
    let mut noise = Random::new(17);
    let angle = |t: f64, j: usize, derivative: usize| -> f64 {
        let (a, w) = (0.6, 0.12 + 0.02 * j as f64);
        match derivative {
            0 => 0.3 * j as f64 + a * (w * t).sin(),
            1 => a * w * (w * t).cos(),
            _ => -a * w * w * (w * t).sin(),
        }
    };
    let columns =
        |derivative| DMatrix::from_fn(samples, 4, |i, j| angle(i as f64 / rate_hz, j, derivative));
    let (q, qd, qdd) = (columns(0), columns(1), columns(2));
    let joint_from_motor = motor_from_joint.try_inverse().unwrap();
    let mut tau = DMatrix::zeros(samples, 4);
    for i in 0..samples {
        let at = |m: &DMatrix<f64>| Vector::<4>::from_fn(|j, _| m[(i, j)]);
        let arm_nm = rnea(arm, &at(&q), &at(&qd), &at(&qdd));
        let motor = motor_from_joint * at(&q);
        let needed = arm_nm + Vector::<4>::from_fn(|j, _| friction[j].torque_nm(qd[(i, j)]));
        let motor_nm = joint_from_motor.transpose() * needed;
        let ripple = Vector::<4>::from_fn(|m, _| tables[m].torque_nm(motor[m], motor_nm[m]));
        let ripple_nm = motor_from_joint.transpose() * ripple;
        for j in 0..4 {
            tau[(i, j)] = needed[j] - ripple_nm[j] + 0.01 * noise.signed();
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

#[test]
fn a_friction_error_of_10_percent_is_learnt_from_the_residual() {
    let arm = wam4().arm;
    let truth: [Friction; 4] = std::array::from_fn(|j| Friction {
        breakaway_nm: 0.66,
        ..Friction::coulomb(1.0 + j as f64, 0.6)
    });
    let model = truth.map(|f| Friction {
        viscous_nm_s_per_rad: 1.1 * f.viscous_nm_s_per_rad,
        coulomb_nm: 0.9 * f.coulomb_nm,
        breakaway_nm: 0.9 * f.breakaway_nm,
        ..f
    });
    let moving = [1, 3];
    let data = motion(&arm, &truth, &moving, 1500, 12);
    let config = Config {
        friction: model,
        ..wam4()
    };
    let learnt = learn(&config, &[data], &moving, &Learning::default()).unwrap();
    for j in moving {
        let (got, wanted) = (&learnt.friction[j], &truth[j]);
        assert!((got.coulomb_nm / wanted.coulomb_nm - 1.0).abs() < 2e-3);
        let viscous = got.viscous_nm_s_per_rad / wanted.viscous_nm_s_per_rad;
        assert!((viscous - 1.0).abs() < 2e-3, "{viscous}");
        assert!(learnt.after_nm[j] < 0.05 * learnt.before_nm[j]);
    }
    // Joints that did not move are unchanged.
    assert_eq!(
        (learnt.friction[0], learnt.friction[2]),
        (model[0], model[2])
    );
}

#[test]
fn a_payload_is_learnt_together_with_friction() {
    let arm = wam4().arm;
    let friction = [Friction::coulomb(1.0, 0.5); 4];
    let truth = nalgebra_vector([0.5, 0.02, -0.01, 0.03]);
    let loaded = with_payload(&arm, Some(&truth)).unwrap();
    let data = motion(&loaded, &friction, &ALL, 1500, 4);
    let learning = Learning {
        payload_kg: Some(0.5),
        ..Learning::default()
    };
    let config = Config { friction, ..wam4() };
    let learnt = learn(&config, &[data], &ALL, &learning).unwrap();
    let got = with_payload(&arm, learnt.payload.as_ref()).unwrap();
    let mut noise = Random::new(2);
    for _ in 0..30 {
        let q = Vector::from_fn(|_, _| 2.0 * noise.signed());
        let (a, b) = (gravity(&got, &q), gravity(&loaded, &q));
        assert!((a - b).amax() < 0.05, "{}", (a - b).amax());
    }
}

fn nalgebra_vector(values: [f64; 4]) -> supple_core::nalgebra::Vector4<f64> {
    values.into()
}

/// Payload of known mass.
fn known_payload() -> Body {
    Body {
        mass_kg: 2.0,
        com_m: Vector3::new(-0.05, -0.36, 0.01),
        inertia_kg_m2: Matrix3::from_diagonal(&Vector3::new(4e-3, 3e-3, 5e-3)),
    }
}

/// `arm` with `body` in the last link's frame.
fn carrying(arm: &supple_core::Arm<4>, body: &Body) -> supple_core::Arm<4> {
    let rotation = arm.link_from_joint(3);
    let p = parameters_of(body);
    let mut links = *arm.links();
    links[3].mass += p[0];
    links[3].first_moment += rotation.tr_mul(&Vector3::new(p[1], p[2], p[3]));
    let inertia = Matrix3::new(p[4], p[5], p[7], p[5], p[6], p[8], p[7], p[8], p[9]);
    let rotated = rotation.tr_mul(&(inertia * rotation));
    links[3].inertia += (rotated + rotated.transpose()) * 0.5;
    supple_core::Arm::from_links(links, arm.armature(), arm.joint_from_tip(), arm.gravity())
        .unwrap()
}

#[test]
fn a_payload_is_identified_and_a_known_one_gives_the_torque_scale() {
    let arm = wam4().arm;
    let friction = [Friction::coulomb(1.0, 0.5); 4];
    let empty = motion(&arm, &friction, &ALL, 1500, 5);
    let loaded = motion(&carrying(&arm, &known_payload()), &friction, &ALL, 1500, 6);
    let noisy = |mut data: Motion, seed: u64| {
        let mut noise = Random::new(seed);
        data.tau
            .iter_mut()
            .for_each(|t| *t += 0.02 * noise.signed());
        data
    };
    let (empty, loaded) = (noisy(empty, 1), noisy(loaded, 2));
    let found = fit(&arm, std::slice::from_ref(&empty), &ALL, &options()).unwrap();
    let guess = Body::ball(1.0, 0.05, Vector3::new(0.0, -0.3, 0.0));
    let got = payload(&found, std::slice::from_ref(&loaded), &guess).unwrap();
    assert!((got.mass_kg - 2.0).abs() < 0.02, "{}", got.mass_kg);
    assert!(
        (got.com_m - known_payload().com_m).amax() < 5e-3,
        "{}",
        got.com_m
    );

    // The same arm with amplifiers that report the torque with a gain error, different for each joint; the rotors
    // are once identified and once taken as known.
    let gains = [0.9, 0.8, 1.15, 0.7];
    let scaled = |mut data: Motion| {
        for (j, gain) in gains.into_iter().enumerate() {
            data.tau.column_mut(j).scale_mut(gain);
        }
        data
    };
    let (empty, loaded) = ([scaled(empty)], [scaled(loaded)]);
    for rotor in [true, false] {
        let plain = Options {
            consistent_prior_weight: None,
            rotor,
            ..options()
        };
        let found = fit(&arm, &empty, &ALL, &plain).unwrap();
        let scale = torque_scale(&found, &empty, &loaded, &known_payload()).unwrap();
        for (joint, gain) in gains.into_iter().enumerate() {
            let got = scale[joint].expect("every joint moves the payload");
            assert!((got * gain - 1.0).abs() < 0.01, "joint {joint}: {got}");
        }
        // Without a payload no scale is determined.
        let none = torque_scale(&found, &empty, &empty, &known_payload()).unwrap();
        assert_eq!(none, [None; 4]);
    }
}

fn names() -> Vec<String> {
    (1..=4).map(|number| format!("joint{number}")).collect()
}

/// A weight of which only the mass is known gives the scales and its place, from motions with noise and gain errors.
#[test]
fn a_known_mass_alone_gives_torque_scales_and_its_place() {
    let arm = wam4().arm;
    let friction = [Friction::coulomb(1.0, 0.5); 4];
    let gains = [0.9, 0.8, 1.15, 0.7];
    let logged = |mut data: Motion, seed: u64| {
        let mut noise = Random::new(seed);
        for (j, gain) in gains.into_iter().enumerate() {
            data.tau
                .column_mut(j)
                .iter_mut()
                .for_each(|t| *t = *t * gain + 0.02 * noise.signed());
        }
        [data]
    };
    let empty = logged(motion(&arm, &friction, &ALL, 1500, 5), 1);
    let carried = carrying(&arm, &known_payload());
    let loaded = logged(motion(&carried, &friction, &ALL, 1500, 6), 2);
    let plain = Options {
        consistent_prior_weight: None,
        ..options()
    };
    let found = fit(&arm, &empty, &ALL, &plain).unwrap();
    let weighing = weigh(&found, &empty, &loaded, known_payload().mass_kg).unwrap();
    assert_eq!(weighing.warnings(&names()), Vec::<String>::new());
    for (joint, gain) in gains.into_iter().enumerate() {
        let scale = weighing.torque_scale[joint].expect("every joint moves the weight");
        let error = (scale * gain - 1.0).abs();
        let deviation = weighing.torque_scale_deviation[joint];
        assert!(error < 0.01, "joint {joint}: {scale}");
        assert!(
            error < 5.0 * deviation,
            "joint {joint}: {scale}, {deviation}"
        );
    }
    let error_m = weighing.com_m - known_payload().com_m;
    assert!(error_m.amax() < 5e-3, "{}", weighing.com_m);
    assert!(error_m.component_div(&weighing.com_deviation_m).amax() < 5.0);
    // With half the mass the same torques are half as large.
    let half = weigh(&found, &empty, &loaded, 0.5 * known_payload().mass_kg).unwrap();
    for (half, whole) in half.torque_scale.iter().zip(&weighing.torque_scale) {
        let ratio = half.unwrap_or(f64::NAN) / whole.unwrap_or(f64::NAN);
        assert!((ratio - 0.5).abs() < 0.02, "{ratio}");
    }
    // Nothing was carried.
    let none = weigh(&found, &empty, &empty, 2.0).unwrap();
    assert_eq!(none.torque_scale, [None; 4]);
    assert!(none.warnings(&names())[0].contains("joint1: its torque scale"));
    assert!(weigh(&found, &empty, &loaded, 0.0).is_err());
}

/// In one pose gravity alone acts, and one equation per joint cannot tell the scale from the lever of the weight.
#[test]
fn scales_are_not_told_apart_in_one_pose() {
    let arm = wam4().arm;
    let friction = [Friction::coulomb(1.0, 0.5); 4];
    let empty = [motion(&arm, &friction, &ALL, 1500, 5)];
    let carried = carrying(&arm, &known_payload());
    let mut loaded = motion(&carried, &friction, &ALL, 400, 6);
    let q = loaded.q.row(0).into_owned();
    let held = supple_core::Vector::<4>::from_fn(|j, _| q[j]);
    let gravity_nm = supple_core::dynamics::gravity(&carried, &held);
    for i in 0..loaded.samples() {
        for j in 0..4 {
            loaded.q[(i, j)] = held[j];
            (loaded.qd[(i, j)], loaded.qdd[(i, j)]) = (0.0, 0.0);
            loaded.tau[(i, j)] = gravity_nm[j];
        }
    }
    let found = fit(&arm, &empty, &ALL, &options()).unwrap();
    for size_nm in [0.0, 0.05] {
        let mut noise = Random::new(3);
        let mut noisy = loaded.clone();
        let torques = noisy.tau.iter_mut();
        torques.for_each(|t| *t += size_nm * noise.signed());
        let weighing = weigh(&found, &empty, &[noisy], known_payload().mass_kg).unwrap();
        assert!(weighing.torque_scale.contains(&None), "{weighing:?}");
        let warnings = weighing.warnings(&names());
        assert!(
            warnings.iter().any(|text| text.contains("told apart")),
            "{weighing:?}"
        );
    }
}

/// A push while the weight was carried, in an interval that is excluded.
#[test]
fn excluded_intervals_are_left_out_of_a_weighing() {
    let arm = wam4().arm;
    let friction = [Friction::coulomb(1.0, 0.5); 4];
    let empty = [motion(&arm, &friction, &ALL, 1500, 5)];
    let carried = carrying(&arm, &known_payload());
    let mut loaded = motion(&carried, &friction, &ALL, 1500, 6);
    for i in 300..400 {
        (0..4).for_each(|j| loaded.tau[(i, j)] += 20.0);
    }
    let at_s = |sample: f64| loaded.start_s + sample / loaded.rate_hz;
    loaded.excluded_intervals.push(ExcludedInterval {
        joint: None,
        from_s: at_s(299.5),
        to_s: at_s(399.5),
    });
    let plain = Options {
        consistent_prior_weight: None,
        ..options()
    };
    let found = fit(&arm, &empty, &ALL, &plain).unwrap();
    let weighing = weigh(&found, &empty, &[loaded], known_payload().mass_kg).unwrap();
    for scale in &weighing.torque_scale {
        let scale = scale.expect("every joint moves the weight");
        assert!((scale - 1.0).abs() < 1e-3, "{weighing:?}");
    }
}
