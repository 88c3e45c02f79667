//! Requests out of range change nothing; the refusal names the entry.

use crate::support::configs::four;
use crate::support::rig::{Rig, bent};
use supple_core::config::Gains;
use supple_core::controller::{Mode, Refusal, Request};
use supple_core::math::Vector3;
use supple_core::trajectory::{Line, Probe, Quadrant, Sinusoid};
use supple_core::{Trajectory, Vector};

/// Sends a request that must be refused while tracking; apart from the refusal the output equals
/// that without a request.
#[track_caller]
fn refused(request: Request<4>) -> Refusal {
    let mut rig = Rig::new(four(), bent());
    rig.bring_to(Mode::Track);
    let mut other = rig.clone();
    let (asked, silent) = (rig.request(request), other.cycle());
    let refusal = asked.refusal.expect("a refusal");
    assert_eq!(
        supple_core::Output {
            refusal: None,
            ..asked
        },
        silent
    );
    assert_eq!(rig.cycles(100), other.cycles(100));
    assert!(refusal.to_string().starts_with("refused: "), "{refusal}");
    refusal
}

/// Checks that the refusal's message contains `words`.
#[track_caller]
fn says(refusal: Refusal, words: &[&str]) {
    let message = refusal.to_string();
    for word in words {
        assert!(message.contains(word), "{message} does not say {word}");
    }
}

fn go(target_rad: Vector<4>, duration_s: f64) -> Request<4> {
    Request::Move {
        target_rad,
        duration_s,
    }
}

#[test]
fn moves_beyond_a_joint_limit_are_refused() {
    let limits = four().limits;
    for joint in 0..4 {
        for value_rad in [
            limits.position_upper_rad[joint] + 1e-9,
            limits.position_lower_rad[joint] - 1e-9,
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
        ] {
            let mut target = bent::<4>();
            target[joint] = value_rad;
            let refusal = refused(go(target, 100.0));
            let Refusal::BeyondJointStop {
                joint: named,
                value_rad: value,
            } = refusal
            else {
                panic!("{refusal}");
            };
            assert_eq!(named, joint);
            assert!(value == value_rad || value.is_nan() && value_rad.is_nan());
            says(refusal, &[&format!("joint {joint}")]);
        }
    }
}

#[test]
fn moves_of_a_held_joint_are_refused() {
    let mut target = bent::<4>();
    target[2] = 0.01;
    let refusal = refused(go(target, 10.0));
    assert!(
        matches!(refusal, Refusal::Value { value, limit, .. } if value == 0.01 && limit == 0.0),
        "{refusal}"
    );
    says(refusal, &["held joint", "0.01"]);
}

#[test]
fn moves_with_an_invalid_duration_are_refused() {
    for duration_s in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refusal = refused(go(bent(), duration_s));
        assert!(
            matches!(
                refusal,
                Refusal::Value {
                    entry: "duration_s",
                    ..
                }
            ),
            "{refusal}"
        );
    }
}

/// The peak of a minimum-jerk move is 1.875 times its mean speed.
#[test]
fn moves_that_are_too_fast_are_refused() {
    for joint in [0, 1, 3] {
        let mut target = bent::<4>();
        target[joint] += 0.4;
        let min_s = 1.875 * 0.4 / 2.0;
        let refusal = refused(go(target, min_s * 0.999));
        let Refusal::TooFast {
            joint: named,
            value_rad_per_s,
            limit_rad_per_s,
        } = refusal
        else {
            panic!("{refusal}");
        };
        assert_eq!((named, limit_rad_per_s), (joint, 2.0));
        assert!((value_rad_per_s - 2.0 / 0.999).abs() < 1e-9);
        says(refusal, &["more time", "2.000 rad/s"]);
        Rig::holding(four(), bent()).accept(go(target, min_s * 1.001));
    }
    let mut target = bent::<4>();
    target[0] += 0.1;
    let refusal = refused(go(target, f64::MIN_POSITIVE));
    assert!(matches!(refusal, Refusal::TooFast { .. }), "{refusal}");
}

#[test]
fn trajectories_that_start_too_far_away_are_refused() {
    let rig = Rig::holding(four(), bent());
    let limit_m = four().limits.start_error_m;
    for direction in [Vector3::x(), -Vector3::y(), Vector3::z()] {
        let away =
            |distance: f64| Request::Track(Trajectory::Hold(rig.tip() + direction * distance));
        rig.clone().accept(away(limit_m * (1.0 - 1e-9)));
        let refusal = refused(away(limit_m * (1.0 + 1e-9)));
        let Refusal::FarFromStart {
            distance_m,
            limit_m: limit,
        } = refusal
        else {
            panic!("{refusal}");
        };
        assert!((distance_m - limit_m).abs() < 1e-9 && limit == limit_m);
        says(refusal, &["0.050 m", "move there first"]);
    }
}

#[test]
fn invalid_trajectories_are_refused() {
    let mut endless = Sinusoid::paper(1.0);
    endless.ramp_s = 0.0;
    let x = Vector3::x();
    for (trajectory, entry) in [
        (Trajectory::Sinusoid(endless), "ramp_s"),
        (Trajectory::Hold(Vector3::repeat(f64::NAN)), "position_m"),
        (
            Trajectory::Quadrant(Quadrant::new(x, x, x, 0.1, 0.1)),
            "cosine between first_m and second_m",
        ),
        (
            Trajectory::Line(Line {
                from_m: x,
                to_m: x,
                duration_s: -1.0,
            }),
            "duration_s",
        ),
    ] {
        let refusal = refused(Request::Track(trajectory));
        let Refusal::Trajectory(error) = refusal else {
            panic!("{refusal}");
        };
        assert_eq!(error.entry, entry);
        says(refusal, &[entry]);
    }
}

/// Valid numbers with products that are not finite: the start of the trajectory is NaN, which is
/// not near the tip.
#[test]
fn trajectories_that_overflow_are_refused() {
    let probe = Probe {
        radius_m: 0.5,
        strokes: u32::MAX,
        radial_step_m: 1e308,
        top_m: 0.0,
        stroke_m: 0.1,
        azimuth_rad: 0.0,
        azimuth_step_rad: 0.1,
        speed_m_per_s: 0.04,
        ramp_s: 0.1,
        dwell_s: 0.0,
    };
    let refusal = refused(Request::Track(Trajectory::Probe(probe)));
    assert!(matches!(refusal, Refusal::FarFromStart { .. }), "{refusal}");
}

#[test]
fn gains_out_of_range_are_refused() {
    let within = Gains::isotropic(10.0, 1.0);
    for axis in 0..3 {
        for (bad, limit) in [
            (-1e-9, "1000"),
            (1_000.000_001, "1000"),
            (f64::NAN, "1000"),
            (f64::INFINITY, "1000"),
        ] {
            let mut gains = within;
            gains.stiffness_n_per_m[axis] = bad;
            let refusal = refused(Request::Gains { gains, ramp_s: 0.0 });
            says(refusal, &["stiffness_n_per_m", &format!("{bad}"), limit]);
            let mut gains = within;
            gains.damping_n_s_per_m[axis] = bad;
            let refusal = refused(Request::Gains { gains, ramp_s: 0.0 });
            says(refusal, &["damping_n_s_per_m", &format!("{bad}"), "100"]);
        }
    }
    for ramp_s in [-1e-9, f64::NAN, f64::INFINITY] {
        let refusal = refused(Request::Gains {
            gains: within,
            ramp_s,
        });
        says(refusal, &["ramp_s", &format!("{ramp_s}")]);
    }
    let most = Gains::isotropic(1000.0, 25.0);
    for gains in [most, Gains::isotropic(0.0, 0.0)] {
        Rig::holding(four(), bent()).accept(Request::Gains { gains, ramp_s: 0.0 });
    }
}
