//! Requests encoded as numbers: encoding and decoding is lossless, and invalid numbers are
//! rejected.

use crate::support::settings::config;
use proptest::prelude::*;
use proptest::strategy::Union;
use supple_core::codes::{RequestCode, RequestCodeError, VALUES};
use supple_core::config::{Gains, JointGains, RotationalGains};
use supple_core::controller::{
    Breakaway, GainAxes, GainMatrices, GainPart, LearningSwitch, Request, SetPoint,
};
use supple_core::learned::{JointMap, LearnedParameters, MAP_KNOTS};
use supple_core::math::{Matrix3, Vector3};
use supple_core::trajectory::{Arc, Fourier, Line, Probe, Quadrant, Rotation, Sinusoid};
use supple_core::{Trajectory, Vector};

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![-10.0..10.0, Just(-0.0), Just(1e-308), Just(1.0 / 3.0)]
}

fn vector() -> impl Strategy<Value = Vector3<f64>> {
    [number(), number(), number()].prop_map(Vector3::from)
}

/// One trajectory of every kind, with its code.
fn trajectory() -> impl Strategy<Value = (u8, Trajectory)> {
    let vectors = (vector(), vector(), vector());
    let numbers = proptest::array::uniform9(number());
    (1_u8..=6, vectors, numbers, any::<u32>()).prop_map(|(kind, (a, b, c), x, strokes)| {
        let trajectory = match kind {
            1 => Trajectory::Hold(a),
            2 => Trajectory::Line(Line {
                from_m: a,
                to_m: b,
                duration_s: x[0],
            }),
            3 => Trajectory::Sinusoid(Sinusoid {
                centre_m: a,
                amplitude_m: b,
                angular_frequency_rad_per_s: x[0],
                ramp_s: x[1],
            }),
            4 => Trajectory::Arc(Arc {
                radius_m: x[0],
                height_m: x[1],
                centre_rad: x[2],
                amplitude_rad: x[3],
                angular_frequency_rad_per_s: x[4],
                ramp_s: x[5],
            }),
            5 => Trajectory::Quadrant(Quadrant::new(a, b, c, x[0], x[1]).with_corner_ramp(x[2])),
            _ => Trajectory::Probe(Probe {
                radius_m: x[0],
                strokes,
                radial_step_m: x[1],
                top_m: x[2],
                stroke_m: x[3],
                azimuth_rad: x[4],
                azimuth_step_rad: x[5],
                speed_m_per_s: x[6],
                ramp_s: x[7],
                dwell_s: x[8],
            }),
        };
        (kind, trajectory)
    })
}

type Numbered = ((u8, u8), Option<Request<4>>);

fn request() -> impl Strategy<Value = Numbered> {
    let moving = ([number(), number(), number(), number()], number());
    let gains = || (vector(), vector(), number());
    Union::new([
        Just(((0, 0), None)).boxed(),
        Just(((1, 0), Some(Request::Idle))).boxed(),
        Just(((2, 0), Some(Request::GravityHold))).boxed(),
        Just(((6, 0), Some(Request::Reset))).boxed(),
        moving
            .prop_map(|(target, duration_s)| {
                let target_rad = Vector::from(target);
                let request = Request::Move {
                    target_rad,
                    duration_s,
                };
                ((3, 0), Some(request))
            })
            .boxed(),
        trajectory()
            .prop_map(|(kind, trajectory)| ((4, kind), Some(Request::Track(trajectory))))
            .boxed(),
        proptest::collection::vec(number(), 47)
            .prop_map(|x| {
                let column = |i: usize| Vector::<4>::from_column_slice(&x[4 * i..4 * i + 4]);
                let series = Fourier {
                    centre_rad: column(0),
                    sine_rad: std::array::from_fn(|k| column(1 + k)),
                    cosine_rad: std::array::from_fn(|k| column(6 + k)),
                    angular_frequency_rad_per_s: x[44],
                    duration_s: x[45],
                    ramp_s: x[46],
                };
                ((7, 0), Some(Request::Excite(series)))
            })
            .boxed(),
        (any::<u8>(), number(), number(), number())
            .prop_map(|(joint, rate_nm_per_s, stop_rad, limit_nm)| {
                let ramp = Breakaway {
                    joint: joint.into(),
                    rate_nm_per_s,
                    stop_rad,
                    limit_nm,
                };
                ((8, 0), Some(Request::Breakaway(ramp)))
            })
            .boxed(),
        Just(((9, 0), Some(Request::Float))).boxed(),
        ([number(), number(), number(), number()], number())
            .prop_map(|(target, duration_s)| {
                let target_rad = Vector::from(target);
                let request = Request::JointImpedance {
                    target_rad,
                    duration_s,
                };
                ((10, 0), Some(request))
            })
            .boxed(),
        (proptest::collection::vec(number(), 8), number())
            .prop_map(|(x, ramp_s)| {
                let gains = JointGains {
                    stiffness_nm_per_rad: Vector::from_column_slice(&x[..4]),
                    damping_nm_s_per_rad: Vector::from_column_slice(&x[4..]),
                };
                ((11, 0), Some(Request::JointGains { gains, ramp_s }))
            })
            .boxed(),
        (gains(), number(), trajectory())
            .prop_map(|((axis, _, duration_s), angle_rad, (kind, trajectory))| {
                let rotation = Rotation {
                    axis,
                    angle_rad,
                    duration_s,
                };
                let request = Request::TrackPose {
                    trajectory,
                    rotation,
                };
                ((12, kind), Some(request))
            })
            .boxed(),
        gains()
            .prop_map(|(stiffness_nm_per_rad, damping_nm_s_per_rad, ramp_s)| {
                let gains = RotationalGains {
                    stiffness_nm_per_rad,
                    damping_nm_s_per_rad,
                };
                ((13, 0), Some(Request::RotationalGains { gains, ramp_s }))
            })
            .boxed(),
        (
            prop::array::uniform12(-1e3..1e3),
            any::<[bool; 2]>(),
            0.0..9.0,
        )
            .prop_map(|(numbers, [rotational, of_tip], ramp_s)| {
                let [stiffness, damping] = [0, 6].map(|first| symmetric(&numbers[first..]));
                let request = Request::GainMatrices {
                    part: if rotational {
                        GainPart::Rotational
                    } else {
                        GainPart::Linear
                    },
                    gains: GainMatrices { stiffness, damping },
                    axes: if of_tip {
                        GainAxes::Tip
                    } else {
                        GainAxes::Base
                    },
                    ramp_s,
                };
                ((18, 0), Some(request))
            })
            .boxed(),
        (0_usize..3)
            .prop_map(|value| {
                let switches = [
                    LearningSwitch::Off,
                    LearningSwitch::On,
                    LearningSwitch::Reset,
                ];
                ((14, 0), Some(Request::Learning(switches[value])))
            })
            .boxed(),
        proptest::collection::vec(number(), LearnedParameters::<4>::COUNT)
            .prop_map(|values| {
                let mut values = values.into_iter();
                let mut parameters = LearnedParameters::zero();
                let zero = parameters;
                parameters.each(&zero, |_, _, to, _| *to = values.next().expect("enough"));
                ((15, 0), Some(Request::LearnedParameters(parameters)))
            })
            .boxed(),
        (
            any::<u8>(),
            proptest::collection::vec(number(), 2 * MAP_KNOTS),
        )
            .prop_map(|(joint, values)| {
                let map = JointMap {
                    torque_nm: std::array::from_fn(|k| values[k]),
                    dry_nm: std::array::from_fn(|k| values[MAP_KNOTS + k]),
                };
                let joint = joint.into();
                ((16, 0), Some(Request::LearnedMap { joint, map }))
            })
            .boxed(),
        (vector(), vector(), vector(), 0_u64..1 << 53)
            .prop_map(
                |(position_m, velocity_m_per_s, acceleration_m_per_s2, at_cycle)| {
                    let point = SetPoint {
                        position_m,
                        velocity_m_per_s,
                        acceleration_m_per_s2,
                        at_cycle,
                    };
                    ((17, 0), Some(Request::SetPoint(point)))
                },
            )
            .boxed(),
        gains()
            .prop_map(|(stiffness_n_per_m, damping_n_s_per_m, ramp_s)| {
                let gains = Gains {
                    stiffness_n_per_m,
                    damping_n_s_per_m,
                };
                ((5, 0), Some(Request::Gains { gains, ramp_s }))
            })
            .boxed(),
    ])
}

proptest! {
    #![proptest_config(config(256, 20_260_106))]

    #[test]
    fn every_request_round_trips_bit_exact((numbers, request) in request()) {
        let code = RequestCode::new(request.as_ref());
        prop_assert_eq!((code.kind, code.trajectory), numbers);
        prop_assert!(code.values().len() <= VALUES);
        let parts = RequestCode::from_parts(code.kind, code.trajectory, code.values());
        prop_assert_eq!(parts, Ok(code));
        let again = code.request::<4>().expect("known");
        // Debug distinguishes -0 from 0, and prints every other number with all its digits.
        prop_assert_eq!(format!("{again:?}"), format!("{request:?}"));
    }
}

/// From xx, yy, zz, yz, zx, xy.
fn symmetric(numbers: &[f64]) -> Matrix3<f64> {
    let &[xx, yy, zz, yz, zx, xy, ..] = numbers else {
        panic!("six numbers")
    };
    Matrix3::new(xx, xy, zx, xy, yy, yz, zx, yz, zz)
}

fn decode(
    kind: u8,
    trajectory: u8,
    values: &[f64],
) -> Result<Option<Request<4>>, RequestCodeError> {
    RequestCode::from_parts(kind, trajectory, values)?.request()
}

#[test]
fn unknown_and_incomplete_codes_are_rejected() {
    assert_eq!(decode(19, 0, &[]), Err(RequestCodeError::Kind(19)));
    for (place, number) in [(0, 2.0), (13, 2.0), (13, 0.5)] {
        let mut values = [0.0; 15];
        values[place] = number;
        assert_eq!(decode(18, 0, &values), Err(RequestCodeError::Whole(number)));
    }
    for cycle in [-1.0, 0.5, 9.1e15, f64::NAN] {
        let mut values = [0.0; 10];
        values[9] = cycle;
        let error = decode(17, 0, &values).expect_err("no cycle");
        assert!(matches!(error, RequestCodeError::Whole(_)), "{error}");
    }
    assert_eq!(decode(14, 0, &[3.0]), Err(RequestCodeError::Whole(3.0)));
    assert_eq!(decode(4, 0, &[]), Err(RequestCodeError::Trajectory(0)));
    assert_eq!(
        decode(4, 7, &[0.0; 16]),
        Err(RequestCodeError::Trajectory(7))
    );
    for (kind, found, expected) in [(3, 4, 5), (3, 6, 5), (1, 1, 0), (1, 81, 80)] {
        assert_eq!(
            decode(kind, 0, &[0.0; 81][..found]),
            Err(RequestCodeError::Count { found, expected })
        );
    }
    let strokes = |count| [0.1, count, 0.1, 0.0, 0.1, 0.0, 0.1, 0.04, 0.1, 0.5];
    assert!(decode(4, 6, &strokes(3.0)).is_ok());
    for found in [8, 11] {
        let values = [[0.0; 10], [0.0; 10]].concat();
        assert!(matches!(
            decode(4, 6, &values[..found]),
            Err(RequestCodeError::Count { .. })
        ));
    }
    for count in [2.5, -1.0] {
        assert_eq!(
            decode(4, 6, &strokes(count)),
            Err(RequestCodeError::Whole(count))
        );
    }
}

/// Logs from before the dwell have nine values of a probe.
#[test]
fn a_probe_of_an_older_log_has_no_dwell() {
    let values = [0.5, 3.0, 0.01, 0.0, 0.1, 0.0, 0.1, 0.04, 0.1];
    let request = decode(4, 6, &values).expect("known");
    let Some(Request::Track(Trajectory::Probe(probe))) = request else {
        panic!("{request:?}");
    };
    assert_eq!((probe.ramp_s, probe.dwell_s), (0.1, 0.0));
}
