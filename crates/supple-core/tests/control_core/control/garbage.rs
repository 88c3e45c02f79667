//! Random inputs for thousands of cycles: the output is finite, within every limit, and reports
//! every fault.

use crate::support::configs::{four, seven, three};
use crate::support::property::{check, per_joint};
use crate::support::rig::{Rig, bent, probe_at};
use proptest::prelude::*;
use supple_core::config::{ApparentInertia, Gains, JointGains, RotationalGains};
use supple_core::controller::{
    GainAxes, GainMatrices, GainPart, LearningSwitch, Mode, Request, SetPoint,
};
use supple_core::learned::{JointMap, LearnedParameters, MAP_KNOTS};
use supple_core::math::{Matrix3, Vector3};
use supple_core::trajectory::{Arc, Line, Quadrant, Rotation, Sinusoid};
use supple_core::{Config, Trajectory, Vector};

/// Ordinary numbers and numerical edge cases.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -1.0..1.0,
        1 => -1e3..1e3,
        1 => any::<f64>(),
        1 => prop::sample::select(vec![
            f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN, f64::MIN_POSITIVE,
            5e-324, -5e-324, 0.0, -0.0, 1e-300, 1e300, -1e308,
        ]),
    ]
}

/// Mostly within the bounds of what is learned.
fn small() -> impl Strategy<Value = f64> {
    prop_oneof![20 => -0.02..0.02, 1 => number()]
}

fn point() -> impl Strategy<Value = Vector3<f64>> {
    [number(), number(), number()].prop_map(Vector3::from)
}

fn trajectory() -> impl Strategy<Value = Trajectory> {
    prop_oneof![
        point().prop_map(Trajectory::Hold),
        (point(), point(), number()).prop_map(|(from_m, to_m, duration_s)| {
            Trajectory::Line(Line {
                from_m,
                to_m,
                duration_s,
            })
        }),
        (point(), point(), number(), number()).prop_map(|(centre_m, amplitude_m, w, ramp_s)| {
            Trajectory::Sinusoid(Sinusoid {
                centre_m,
                amplitude_m,
                angular_frequency_rad_per_s: w,
                ramp_s,
            })
        }),
        (point(), point(), number(), number()).prop_map(|(p, q, w, ramp_s)| {
            Trajectory::Arc(Arc {
                radius_m: p.x,
                height_m: p.y,
                centre_rad: p.z,
                amplitude_rad: q.x,
                angular_frequency_rad_per_s: w,
                ramp_s,
            })
        }),
        (point(), point(), point(), number(), number())
            .prop_map(|(c, a, b, v, r)| Trajectory::Quadrant(Quadrant::new(c, a, b, v, r))),
    ]
}

/// A request, or the kind of a request that depends on the arm's pose.
#[expect(clippy::large_enum_variant, reason = "a few hundred of them in a test")]
#[derive(Clone, Debug)]
enum RequestKind<const N: usize> {
    None,
    Any(Request<N>),
    HoldTip,
    Probe,
    Turn(f64),
    MoveHere(f64),
}

fn request_kind<const N: usize>() -> impl Strategy<Value = RequestKind<N>> {
    let any_of = prop_oneof![
        Just(Request::Idle),
        Just(Request::GravityHold),
        Just(Request::Reset),
        Just(Request::Float),
        prop::sample::select(vec![
            LearningSwitch::On,
            LearningSwitch::Off,
            LearningSwitch::Reset
        ])
        .prop_map(Request::Learning),
        prop::collection::vec(small(), LearnedParameters::<N>::COUNT).prop_map(|values| {
            let mut values = values.into_iter();
            let mut parameters = LearnedParameters::zero();
            let zero = parameters;
            parameters.each(&zero, |_, _, to, _| *to = values.next().expect("enough"));
            Request::LearnedParameters(parameters)
        }),
        (0..N + 1, small(), small()).prop_map(|(joint, torque, dry)| Request::LearnedMap {
            joint,
            map: JointMap {
                torque_nm: [torque; MAP_KNOTS],
                dry_nm: [dry; MAP_KNOTS],
            },
        }),
        (prop::collection::vec(number(), N), number()).prop_map(|(target, duration_s)| {
            Request::JointImpedance {
                target_rad: Vector::from_column_slice(&target),
                duration_s,
            }
        }),
        (prop::collection::vec(number(), 2 * N), number()).prop_map(|(x, ramp_s)| {
            Request::JointGains {
                gains: JointGains {
                    stiffness_nm_per_rad: Vector::from_column_slice(&x[..N]),
                    damping_nm_s_per_rad: Vector::from_column_slice(&x[N..]),
                },
                ramp_s,
            }
        }),
        trajectory().prop_map(Request::Track),
        (point(), point(), point(), 0_u64..3000).prop_map(|(p, v, a, at_cycle)| {
            Request::SetPoint(SetPoint {
                position_m: p,
                velocity_m_per_s: v,
                acceleration_m_per_s2: a,
                at_cycle,
            })
        }),
        (trajectory(), point(), number(), number()).prop_map(
            |(trajectory, axis, angle_rad, duration_s)| Request::TrackPose {
                trajectory,
                rotation: Rotation {
                    axis,
                    angle_rad,
                    duration_s,
                },
            }
        ),
        (point(), point(), number()).prop_map(|(k, b, ramp_s)| Request::RotationalGains {
            gains: RotationalGains {
                stiffness_nm_per_rad: k,
                damping_nm_s_per_rad: b,
            },
            ramp_s,
        }),
        (
            prop::array::uniform9(number()),
            any::<[bool; 3]>(),
            number()
        )
            .prop_map(|(numbers, [rotational, of_tip, is_symmetric], ramp_s)| {
                let mut matrix = Matrix3::from_column_slice(&numbers);
                if is_symmetric {
                    matrix = matrix * matrix.transpose();
                }
                Request::GainMatrices {
                    part: if rotational {
                        GainPart::Rotational
                    } else {
                        GainPart::Linear
                    },
                    gains: GainMatrices {
                        stiffness: matrix,
                        damping: matrix,
                    },
                    axes: if of_tip {
                        GainAxes::Tip
                    } else {
                        GainAxes::Base
                    },
                    ramp_s,
                }
            }),
        (prop::collection::vec(number(), N), number()).prop_map(|(target, duration_s)| {
            Request::Move {
                target_rad: Vector::from_column_slice(&target),
                duration_s,
            }
        }),
        (point(), point(), number()).prop_map(|(k, b, ramp_s)| Request::Gains {
            gains: Gains {
                stiffness_n_per_m: k,
                damping_n_s_per_m: b,
            },
            ramp_s,
        }),
    ];
    prop_oneof![
        12 => Just(RequestKind::None),
        3 => any_of.prop_map(RequestKind::Any),
        2 => prop::sample::select(vec![Request::Reset, Request::GravityHold]).prop_map(RequestKind::Any),
        1 => Just(RequestKind::HoldTip),
        1 => Just(RequestKind::Probe),
        1 => (-0.2..0.2).prop_map(RequestKind::Turn),
        1 => (0.01..2.0).prop_map(RequestKind::MoveHere),
    ]
}

/// Input of one cycle, independent of the arm's pose.
#[derive(Clone, Debug)]
struct Noise<const N: usize> {
    requested: RequestKind<N>,
    drift: Vector<N>,
    angles: Vec<Option<Option<f64>>>,
    force: Option<Vector3<f64>>,
    cycle: i64,
}

fn noise<const N: usize>() -> impl Strategy<Value = Noise<N>> {
    let angle = prop_oneof![
        60 => Just(None),
        1 => Just(Some(None)),
        1 => number().prop_map(|x| Some(Some(x))),
    ];
    let force = prop_oneof![
        4 => Just(None),
        4 => [-20.0..20.0, -20.0..20.0, -20.0..20.0].prop_map(|f| Some(Vector3::from(f))),
        1 => point().prop_map(Some),
    ];
    let cycle = prop_oneof![20 => Just(1_i64), 1 => -3_i64..6, 1 => any::<i64>()];
    (
        request_kind(),
        per_joint::<N>(2e-3),
        prop::collection::vec(angle, N),
        force,
        cycle,
    )
        .prop_map(|(requested, drift, angles, force, cycle)| Noise {
            requested,
            drift,
            angles,
            force,
            cycle,
        })
}

/// Runs 300 cycles of noise and counts the modes reached.
fn survive<const N: usize>(config: Config<N>) {
    let seen = std::cell::RefCell::new(std::collections::BTreeMap::<&str, u32>::new());
    check(60, prop::collection::vec(noise::<N>(), 300), |cycles| {
        let mut rig = Rig::new(config, bent());
        let mut last = rig.cycle();
        for noise in cycles {
            rig.q += noise.drift;
            let mut input = rig.input();
            for (i, angle) in noise.angles.iter().enumerate() {
                if let Some(angle) = angle {
                    input.position_rad[i] = *angle;
                }
            }
            input.tip_force_n = noise.force;
            input.cycle = last.cycle.wrapping_add_signed(noise.cycle);
            input.request = match noise.requested {
                RequestKind::None => None,
                RequestKind::Any(request) => Some(request),
                RequestKind::HoldTip => Some(rig.hold_tip_request()),
                RequestKind::Probe => Some(Request::Track(probe_at(&rig.tip()))),
                RequestKind::Turn(angle_rad) => Some(rig.turn(angle_rad)),
                RequestKind::MoveHere(duration_s) => Some(Request::Move {
                    target_rad: bent(),
                    duration_s,
                }),
            };
            let output = rig.step(&input);
            let limits = &config.limits;
            let motors = rig.controller.motors().motor_torque_nm(&output.torque_nm);
            for i in 0..N {
                let (torque, fallback) = (output.torque_nm[i], output.fallback_torque_nm[i]);
                prop_assert!(torque.abs() <= limits.joint_torque_nm[i] * (1.0 + 1e-12));
                prop_assert!(fallback.abs() <= limits.joint_torque_nm[i] * (1.0 + 1e-12));
                prop_assert!(motors[i].abs() <= limits.motor_torque_nm[i] * (1.0 + 1e-12));
                let step = (torque - last.torque_nm[i]).abs();
                let in_fault = output.mode == Mode::Fault;
                let max_step_nm = rig.controller.torque_step_nm(in_fault)[i];
                // The one exception: a torque that is not finite is dropped, not ramped.
                prop_assert!(step <= max_step_nm * (1.0 + 1e-9) || torque == 0.0);
            }
            let bad = input.position_rad.iter().flatten().any(|x| !x.is_finite());
            let fresh = input.cycle != last.cycle;
            prop_assert!(!(bad && fresh) || output.mode == Mode::Fault);
            prop_assert_eq!(output.mode == Mode::Fault, output.fault.is_some());
            for gain in output
                .gains
                .stiffness_n_per_m
                .iter()
                .chain(&output.gains.damping_n_s_per_m)
            {
                prop_assert!(gain.is_finite() && *gain >= 0.0);
            }
            prop_assert!((0.0..=1.0).contains(&output.friction_share));
            *seen.borrow_mut().entry(output.mode.name()).or_default() += 1;
            last = output;
        }
        Ok(())
    });
    let seen = seen.into_inner();
    for mode in ["idle", "gravity_hold", "move", "track", "probe", "fault"] {
        let count = seen.get(mode).copied().unwrap_or(0);
        assert!(count > 10, "{mode} was hardly reached: {seen:?}");
    }
}

fn with_relaxed_limits<const N: usize>(mut config: Config<N>) -> Config<N> {
    config.limits.stale_cycles = 6;
    config.limits.start_error_m = 2.0;
    config.limits.tracking_error_m = 2.0;
    config.limits.joint_speed_rad_per_s.fill(10.0);
    config
}

#[test]
fn of_3_joints_with_a_force_sensor() {
    let mut config = with_relaxed_limits(three());
    config.law.inertia = ApparentInertia::Chosen(Matrix3::from_diagonal_element(2.0));
    survive(config);
}

#[test]
fn of_4_joints() {
    survive(with_relaxed_limits(four()));
}

#[test]
fn of_7_joints() {
    survive(with_relaxed_limits(seven()));
}

/// With valid inputs again, a reset and a time at rest restore gravity hold, whatever the previous
/// inputs were.
#[test]
fn a_reset_after_random_input_restores_gravity_hold() {
    let config = with_relaxed_limits(four());
    check(60, prop::collection::vec(noise::<4>(), 100), |cycles| {
        let mut rig = Rig::new(config, bent());
        rig.cycle();
        for noise in cycles {
            let mut input = rig.input();
            for (i, angle) in noise.angles.iter().enumerate() {
                if let Some(angle) = angle {
                    input.position_rad[i] = *angle;
                }
            }
            input.tip_force_n = noise.force;
            if let RequestKind::Any(request) = noise.requested {
                input.request = Some(request);
            }
            rig.step(&input);
        }
        // After readings of up to 1e308 rad the estimator needs seconds to settle.
        rig.cycles(8000);
        rig.request(Request::Reset);
        rig.request(Request::GravityHold);
        let output = rig.cycles(1000);
        prop_assert_eq!((output.mode, output.fault), (Mode::GravityHold, None));
        let weight = supple_core::dynamics::gravity(&config.arm, &rig.q);
        prop_assert!((output.torque_nm - weight).norm() < 1e-6);
        Ok(())
    });
}
