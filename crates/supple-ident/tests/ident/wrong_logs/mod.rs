//! Errors in logs are reported before a fit; correct logs cause no report.

mod variants;

use crate::{tx40, ur10e};
use supple_core::dynamics::regressor;
use supple_core::{Arm, Vector};
use supple_ident::log_checks::{Finding, Problem, check_log};
use supple_ident::{
    Cancellation, DMatrix, IdentError, Log, Motion, Preparation, estimate_delay, resample,
};
use supple_random::Random;
use variants::{Sizes, Variant, all};

/// Torques that a point mass at the tip adds to a log.
fn payload_nm<const N: usize>(arm: &Arm<N>, log: &Log, mass_kg: f64, rate_hz: f64) -> DMatrix<f64> {
    let moving: Vec<usize> = (0..N).collect();
    let preparation = Preparation {
        rate_hz: Some(rate_hz),
        ..Preparation::default()
    };
    let (motion, _) = Motion::prepare(log, N, &moving, &preparation).unwrap();
    let c = arm.link_from_joint(N - 1) * arm.joint_from_tip().translation;
    let p = [
        1.0,
        c.x,
        c.y,
        c.z,
        c.y * c.y + c.z * c.z,
        -c.x * c.y,
        c.x * c.x + c.z * c.z,
        -c.x * c.z,
        -c.y * c.z,
        c.x * c.x + c.y * c.y,
    ];
    let mut added = DMatrix::zeros(log.t_s.len(), N);
    for i in 0..log.t_s.len() {
        let at = ((log.t_s[i] - motion.start_s) * motion.rate_hz).round();
        let at = at.clamp(0.0, (motion.samples() - 1) as f64) as usize;
        let state = |m: &DMatrix<f64>| Vector::<N>::from_fn(|j, _| m[(at, j)]);
        let q = Vector::<N>::from_fn(|j, _| log.q_rad[(i, j)]);
        let y = regressor(arm, &q, &state(&motion.qd), &state(&motion.qdd));
        for j in 0..N {
            added[(i, j)] = mass_kg * (0..10).map(|k| y[j][N - 1][k] * p[k]).sum::<f64>();
        }
    }
    added
}

fn findings<const N: usize>(
    arm: &Arm<N>,
    log: &Log,
    couplings: &[(usize, usize)],
    preparation: &Preparation,
) -> Vec<Finding> {
    let moving: Vec<usize> = (0..N).collect();
    let going_on = Cancellation::default();
    match check_log(arm, log, &moving, couplings, preparation, &going_on) {
        Ok(findings) => findings,
        Err(error) => panic!("{error}"),
    }
}

fn named(variant: &Variant, findings: &[Finding]) -> bool {
    findings.iter().any(|f| {
        let joint = variant
            .joint
            .is_none_or(|j| f.joints.is_empty() || f.joints.contains(&j));
        variant.problems.contains(&f.problem) && joint
    })
}

/// Returns the number of variants that are reported; prints the others.
fn count<const N: usize>(
    arm: &Arm<N>,
    log: &Log,
    couplings: &[(usize, usize)],
    preparation: &Preparation,
    sizes: &Sizes,
    rate_hz: f64,
) -> usize {
    let variants = all(log, sizes, rate_hz);
    assert_eq!(variants.len(), 39);
    let mut count = 0;
    for variant in &variants {
        let found = findings(arm, &variant.log, couplings, preparation);
        let good = named(variant, &found);
        count += usize::from(good);
        let first = found
            .first()
            .map(|f| format!("{:?} {:?}: {f}", f.problem, f.joints));
        println!(
            "{} {}: {}",
            if good { "named " } else { "MISSED" },
            variant.name,
            first.unwrap_or_default()
        );
    }
    println!("{count} of {}", variants.len());
    count
}

/// Some of the variants, for builds without optimisation.
#[test]
fn a_wrong_sign_and_currents_instead_of_torques_are_reported_and_a_correct_log_is_not() {
    let arm = tx40::description().arm::<6>().expect("six joints");
    let log = tx40::log();
    let preparation = Preparation {
        rate_hz: Some(5000.0),
        ..Preparation::default()
    };
    let found = |log: &Log| findings(&arm, log, &[(4, 5)], &preparation);
    assert!(found(&log).is_empty());
    let mut flipped = log.clone();
    flipped.tau_nm.column_mut(1).neg_mut();
    let sign = found(&flipped);
    assert!(
        sign.iter()
            .any(|f| f.problem == Problem::TorqueSign && f.joints == [1]),
        "{sign:?}"
    );
    let mut currents = log.clone();
    currents.tau_nm /= 12.0;
    let unit = found(&currents);
    assert!(
        unit.iter().any(|f| f.problem == Problem::NotJointTorques),
        "{unit:?}"
    );
}

/// In slow motion, the change of the angle from sample to sample is smaller than the noise of the encoder.
#[test]
fn noise_in_slow_motion_is_no_lost_sample_and_lost_samples_are_found_in_noise() {
    let arm = tx40::description().arm::<6>().expect("six joints");
    let log = |rate_hz: f64, amplitude_rad: f64, kept: &dyn Fn(usize) -> bool| {
        let mut noise = Random::new(7);
        let mut normal = move || (0..12).map(|_| 0.5 * noise.signed()).sum::<f64>();
        let samples: Vec<usize> = (0..10_000).filter(|i| kept(*i)).collect();
        let angle_rad = |i: usize, joint: usize| {
            let phase = core::f64::consts::TAU * i as f64 / rate_hz / 8.0 + 0.3 * joint as f64;
            amplitude_rad * phase.sin()
        };
        Log {
            t_s: (0..samples.len()).map(|i| i as f64 / rate_hz).collect(),
            q_rad: DMatrix::from_fn(samples.len(), 6, |i, j| {
                angle_rad(samples[i], j) + 2e-5 * normal()
            }),
            tau_nm: DMatrix::from_fn(samples.len(), 6, |_, _| 0.1 * normal()),
            qd_rad_per_s: None,
        }
    };
    let lost = |log: &Log| {
        let found = findings(&arm, log, &[], &Preparation::default());
        found.iter().any(|f| f.problem == Problem::LostSamples)
    };
    for amplitude_rad in [0.01, 0.03, 0.1, 0.3, 1.0] {
        for rate_hz in [100.0, 1000.0] {
            assert!(
                !lost(&log(rate_hz, amplitude_rad, &|_| true)),
                "{amplitude_rad} rad at {rate_hz} Hz"
            );
        }
    }
    // One of a hundred samples is lost while the joints move fast enough for a detection.
    for (rate_hz, amplitude_rad) in [(1000.0, 1.0), (100.0, 0.1), (50.0, 0.1)] {
        assert!(
            lost(&log(rate_hz, amplitude_rad, &|i| i % 100 != 17)),
            "{amplitude_rad} rad at {rate_hz} Hz"
        );
    }
}

#[test]
#[ignore = "all variants take minutes without optimisation: cargo test --release -p supple-ident -- --include-ignored tx40"]
fn errors_in_a_log_of_a_tx40_are_reported() {
    let arm = tx40::description().arm::<6>().expect("six joints");
    let log = tx40::log();
    let preparation = Preparation {
        rate_hz: Some(5000.0),
        cutoff_hz: Some(40.0),
        decimation_factor: 10,
        ..Preparation::default()
    };
    let sound = findings(&arm, &log, &[(4, 5)], &preparation);
    println!("sound {sound:?}");
    let sizes = Sizes {
        heavy: 1,
        second: 2,
        wrist: 4,
        ratio: 45.0,
        gain: 12.0,
        payload_nm: payload_nm(&arm, &log, 2.0, 5000.0),
        push: vec![0.3, 1.0, 0.8, 0.1, 0.1, 0.0],
    };
    let count = count(&arm, &log, &[(4, 5)], &preparation, &sizes, 5000.0);
    assert!(count >= 34, "{count}");
    assert!(sound.is_empty(), "{sound:?}");
}

#[test]
#[ignore = "needs the logs of a UR10e, which may not be redistributed: SUPPLE_UR10E_DIR, `./ci.sh ur10e`"]
fn errors_in_a_log_of_a_ur10e_are_reported() {
    let folder = std::env::var_os("SUPPLE_UR10E_DIR").expect("SUPPLE_UR10E_DIR names their folder");
    let folder = std::path::Path::new(&folder);
    let arm = ur10e::description(folder).arm::<6>().expect("six joints");
    let preparation = Preparation {
        rate_hz: Some(100.0),
        ..Preparation::default()
    };
    let with_and_without_velocities = |log: Log| {
        let qd_rad_per_s = None;
        let without = Log {
            qd_rad_per_s,
            ..log.clone()
        };
        [log, without]
    };
    let mut wrong = Vec::new();
    for (file, rows) in [
        ("ur-20_02_10-30sec_12harm.csv", 635..3510),
        ("ur-20_01_17-ptp_10_points.csv", 700..4200),
        ("ur-20_02_12-40sec_12harm.csv", 500..4460),
        ("ur-20_02_05-20sec_8harm.csv", 320..2310),
    ] {
        for log in with_and_without_velocities(ur10e::log(folder, file, rows)) {
            let sound = findings(&arm, &log, &[], &preparation);
            println!("sound {file}: {sound:?}");
            wrong.extend(sound);
        }
    }
    let mut counts = Vec::new();
    let log = ur10e::log(folder, "ur-20_02_10-30sec_12harm.csv", 635..3510);
    for log in with_and_without_velocities(log) {
        let sizes = Sizes {
            heavy: 1,
            second: 2,
            wrist: 4,
            ratio: 101.0,
            gain: 12.0,
            payload_nm: payload_nm(&arm, &log, 5.0, 100.0),
            push: vec![0.3, 1.0, 0.8, 0.1, 0.1, 0.0],
        };
        counts.push(count(&arm, &log, &[], &preparation, &sizes, 100.0));
    }
    assert!(counts.iter().all(|count| *count >= 34), "{counts:?}");
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// Shifts the torques of a log: positive if they lag.
fn lagging(log: &Log, lag_s: f64) -> Log {
    let rate_hz = (log.t_s.len() - 1) as f64 / (log.t_s[log.t_s.len() - 1] - log.t_s[0]);
    let shifted = resample(&log.t_s, &log.tau_nm, rate_hz, lag_s);
    let q = resample(&log.t_s, &log.q_rad, rate_hz, 0.0);
    Log {
        t_s: (0..q.nrows()).map(|i| i as f64 / rate_hz).collect(),
        q_rad: q,
        qd_rad_per_s: None,
        tau_nm: shifted,
    }
}

#[test]
fn a_delay_put_into_a_log_is_found() {
    let arm = tx40::description().arm::<6>().expect("six joints");
    let log = tx40::log();
    let preparation = Preparation {
        rate_hz: Some(5000.0),
        cutoff_hz: Some(40.0),
        decimation_factor: 10,
        ..Preparation::default()
    };
    let moving: Vec<usize> = (0..6).collect();
    let going_on = Cancellation::default();
    let found = |lag_s: f64| {
        let log = lagging(&log, lag_s);
        estimate_delay(&arm, &log, &moving, &[(4, 5)], &preparation, &going_on).unwrap()
    };
    let own = found(0.0);
    println!("{own:?}");
    for lag_s in [-0.03, 0.03] {
        let with = found(lag_s);
        println!("{lag_s}: {with:?}");
        let error_s = with.delay_s - own.delay_s + lag_s;
        assert!(error_s.abs() < 2e-3, "{lag_s}: {with:?}");
        assert!(with.error_with < with.error_without);
    }
}

/// The checks of a log and the search of its delay are many fits each: the flag ends them at the next one.
#[test]
fn cancelled_checks_of_a_log_have_no_result() {
    let arm = tx40::description().arm::<6>().expect("six joints");
    let log = tx40::log();
    let moving: Vec<usize> = (0..6).collect();
    let cancelled = Cancellation::default();
    cancelled.cancel();
    let options = Preparation::default();
    let findings = check_log(&arm, &log, &moving, &[(4, 5)], &options, &cancelled);
    assert_eq!(findings.err(), Some(IdentError::Cancelled));
    let delay = estimate_delay(&arm, &log, &moving, &[(4, 5)], &options, &cancelled);
    assert_eq!(delay.err(), Some(IdentError::Cancelled));
}
