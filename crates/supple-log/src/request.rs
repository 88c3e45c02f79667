//! Requests as numbers, and back without the loss of a bit. The order of the numbers is that of
//! `msg/ControllerState.msg`.

use supple_core::config::Gains;
use supple_core::controller::{Breakaway, Request};
use supple_core::math::Vector3;
use supple_core::trajectory::{Arc, Fourier, HARMONICS, Line, Probe, Quadrant, Sinusoid};
use supple_core::{Trajectory, Vector};

/// Kind of request, kind of trajectory, values.
pub(crate) type Encoded = (u8, u8, Vec<f64>);

pub(crate) fn encode<const N: usize>(request: &Option<Request<N>>) -> Encoded {
    match request {
        None => (0, 0, Vec::new()),
        Some(Request::Idle) => (1, 0, Vec::new()),
        Some(Request::GravityHold) => (2, 0, Vec::new()),
        Some(Request::Move {
            target_rad,
            duration_s,
        }) => {
            let mut values = target_rad.as_slice().to_vec();
            values.push(*duration_s);
            (3, 0, values)
        }
        Some(Request::Track(trajectory)) => {
            let (kind, values) = encode_trajectory(trajectory);
            (4, kind, values)
        }
        Some(Request::Gains { gains, ramp_s }) => {
            let vectors = [&gains.stiffness_n_per_m, &gains.damping_n_s_per_m];
            (5, 0, joined(&vectors, &[*ramp_s]))
        }
        Some(Request::Reset) => (6, 0, Vec::new()),
        Some(Request::Excite(series)) => (7, 0, encode_series(series)),
        Some(Request::Breakaway(ramp)) => {
            let numbers = [
                ramp.joint as f64,
                ramp.rate_nm_per_s,
                ramp.stop_rad,
                ramp.limit_nm,
            ];
            (8, 0, numbers.to_vec())
        }
    }
}

fn encode_series<const N: usize>(series: &Fourier<N>) -> Vec<f64> {
    let columns = [&series.centre_rad].into_iter();
    let columns = columns.chain(&series.sine_rad).chain(&series.cosine_rad);
    let times = [
        series.angular_frequency_rad_per_s,
        series.duration_s,
        series.ramp_s,
    ];
    columns
        .flat_map(|c| c.iter().copied())
        .chain(times)
        .collect()
}

fn decode_series<const N: usize>(rest: &mut Rest<'_>) -> Result<Fourier<N>, String> {
    let mut column = || rest.take::<N>().map(Vector::from);
    let mut series = Fourier::at_rest(column()?, 1.0);
    for k in 0..HARMONICS {
        series.sine_rad[k] = column()?;
    }
    for k in 0..HARMONICS {
        series.cosine_rad[k] = column()?;
    }
    Ok(Fourier {
        angular_frequency_rad_per_s: rest.number()?,
        duration_s: rest.number()?,
        ramp_s: rest.number()?,
        ..series
    })
}

fn encode_trajectory(trajectory: &Trajectory) -> (u8, Vec<f64>) {
    match trajectory {
        Trajectory::Hold(position) => (1, joined(&[position], &[])),
        Trajectory::Line(t) => (2, joined(&[&t.from_m, &t.to_m], &[t.duration_s])),
        Trajectory::Sinusoid(t) => {
            let numbers = [t.angular_frequency_rad_per_s, t.ramp_s];
            (3, joined(&[&t.centre_m, &t.amplitude_m], &numbers))
        }
        Trajectory::Arc(t) => {
            let numbers = [
                t.radius_m,
                t.height_m,
                t.centre_rad,
                t.amplitude_rad,
                t.angular_frequency_rad_per_s,
                t.ramp_s,
            ];
            (4, joined(&[], &numbers))
        }
        Trajectory::Quadrant(t) => {
            let vectors = [&t.centre_m(), &t.first_m(), &t.second_m()];
            (5, joined(&vectors, &[t.speed_m_per_s(), t.ramp_s()]))
        }
        Trajectory::Probe(t) => {
            let numbers = [
                t.radius_m,
                f64::from(t.strokes),
                t.radial_step_m,
                t.top_m,
                t.stroke_m,
                t.azimuth_rad,
                t.azimuth_step_rad,
                t.speed_m_per_s,
                t.ramp_s,
            ];
            (6, joined(&[], &numbers))
        }
    }
}

fn joined(vectors: &[&Vector3<f64>], numbers: &[f64]) -> Vec<f64> {
    let vectors = vectors.iter().flat_map(|v| v.iter());
    vectors.chain(numbers).copied().collect()
}

/// # Errors
/// What is wrong, in words.
pub(crate) fn decode<const N: usize>(
    request: u8,
    trajectory: u8,
    values: &[f64],
) -> Result<Option<Request<N>>, String> {
    let mut rest = Rest(values);
    let decoded = match request {
        0 => None,
        1 => Some(Request::Idle),
        2 => Some(Request::GravityHold),
        3 => Some(Request::Move {
            target_rad: Vector::from(rest.take::<N>()?),
            duration_s: rest.number()?,
        }),
        4 => Some(Request::Track(decode_trajectory(trajectory, &mut rest)?)),
        5 => Some(Request::Gains {
            gains: Gains {
                stiffness_n_per_m: rest.vector()?,
                damping_n_s_per_m: rest.vector()?,
            },
            ramp_s: rest.number()?,
        }),
        6 => Some(Request::Reset),
        7 => Some(Request::Excite(decode_series(&mut rest)?)),
        8 => Some(Request::Breakaway(Breakaway {
            joint: rest.count("joint")? as usize,
            rate_nm_per_s: rest.number()?,
            stop_rad: rest.number()?,
            limit_nm: rest.number()?,
        })),
        unknown => return Err(format!("request is {unknown}, the last known is 8")),
    };
    if rest.0.is_empty() {
        return Ok(decoded);
    }
    let (found, spare) = (values.len(), rest.0.len());
    Err(format!(
        "request_values has {found} values, request {request} takes {}",
        found - spare
    ))
}

fn decode_trajectory(kind: u8, rest: &mut Rest<'_>) -> Result<Trajectory, String> {
    Ok(match kind {
        1 => Trajectory::Hold(rest.vector()?),
        2 => Trajectory::Line(Line {
            from_m: rest.vector()?,
            to_m: rest.vector()?,
            duration_s: rest.number()?,
        }),
        3 => Trajectory::Sinusoid(Sinusoid {
            centre_m: rest.vector()?,
            amplitude_m: rest.vector()?,
            angular_frequency_rad_per_s: rest.number()?,
            ramp_s: rest.number()?,
        }),
        4 => Trajectory::Arc(Arc {
            radius_m: rest.number()?,
            height_m: rest.number()?,
            centre_rad: rest.number()?,
            amplitude_rad: rest.number()?,
            angular_frequency_rad_per_s: rest.number()?,
            ramp_s: rest.number()?,
        }),
        5 => {
            let (centre_m, first_m, second_m) = (rest.vector()?, rest.vector()?, rest.vector()?);
            let (speed_m_per_s, ramp_s) = (rest.number()?, rest.number()?);
            let quadrant = Quadrant::new(centre_m, first_m, second_m, speed_m_per_s, ramp_s);
            Trajectory::Quadrant(quadrant)
        }
        6 => Trajectory::Probe(Probe {
            radius_m: rest.number()?,
            strokes: rest.count("strokes")?,
            radial_step_m: rest.number()?,
            top_m: rest.number()?,
            stroke_m: rest.number()?,
            azimuth_rad: rest.number()?,
            azimuth_step_rad: rest.number()?,
            speed_m_per_s: rest.number()?,
            ramp_s: rest.number()?,
        }),
        unknown => return Err(format!("trajectory is {unknown}, known are 1 to 6")),
    })
}

/// Values not yet taken.
struct Rest<'a>(&'a [f64]);

impl Rest<'_> {
    fn take<const K: usize>(&mut self) -> Result<[f64; K], String> {
        let (taken, rest) = self
            .0
            .split_first_chunk::<K>()
            .ok_or("request_values has too few values")?;
        self.0 = rest;
        Ok(*taken)
    }

    fn number(&mut self) -> Result<f64, String> {
        self.take::<1>().map(|[number]| number)
    }

    fn vector(&mut self) -> Result<Vector3<f64>, String> {
        self.take::<3>().map(Vector3::from)
    }

    fn count(&mut self, entry: &str) -> Result<u32, String> {
        let number = self.number()?;
        let count = number as u32;
        if f64::from(count) == number {
            return Ok(count);
        }
        Err(format!("{entry} is {number}, expected a whole number"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::strategy::Union;

    fn number() -> impl Strategy<Value = f64> {
        prop_oneof![-10.0..10.0, Just(-0.0), Just(1e-308), Just(1.0 / 3.0)]
    }

    fn vector() -> impl Strategy<Value = Vector3<f64>> {
        [number(), number(), number()].prop_map(Vector3::from)
    }

    /// One of every kind, by its number.
    fn trajectory() -> impl Strategy<Value = (u8, Trajectory)> {
        let vectors = (vector(), vector(), vector());
        let numbers = proptest::array::uniform8(number());
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
                5 => Trajectory::Quadrant(Quadrant::new(a, b, c, x[0], x[1])),
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
                }),
            };
            (kind, trajectory)
        })
    }

    type Numbered = ((u8, u8), Option<Request<4>>);

    fn request() -> impl Strategy<Value = Numbered> {
        let moving = ([number(), number(), number(), number()], number());
        let gains = (vector(), vector(), number());
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
            (-1.0_f64..1.0)
                .prop_map(|x| {
                    let column = |k: f64| Vector::from([x, -x * k, 0.25 * x, k - x]);
                    let mut series = Fourier::at_rest(column(0.5), 1.0 + x * x);
                    for k in 0..HARMONICS {
                        series.sine_rad[k] = column(1.0 + k as f64);
                        series.cosine_rad[k] = column(-0.1 * k as f64);
                    }
                    ((7, 0), Some(Request::Excite(series)))
                })
                .boxed(),
            (0_usize..4, number())
                .prop_map(|(joint, rate_nm_per_s)| {
                    let ramp = Breakaway {
                        joint,
                        rate_nm_per_s,
                        stop_rad: 0.035,
                        limit_nm: 5.0,
                    };
                    ((8, 0), Some(Request::Breakaway(ramp)))
                })
                .boxed(),
            gains
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
        #[test]
        fn every_request_comes_back_to_the_last_bit((numbers, request) in request()) {
            let (kind, trajectory, values) = encode(&request);
            prop_assert_eq!((kind, trajectory), numbers);
            // The definition's bound.
            prop_assert!(values.len() <= 80);
            let again = decode::<4>(kind, trajectory, &values).expect("known");
            // Debug tells -0 from 0, and prints every other number with all its digits.
            prop_assert_eq!(format!("{again:?}"), format!("{request:?}"));
        }
    }

    #[test]
    fn what_is_not_known_or_not_whole_is_refused() {
        assert!(decode::<4>(9, 0, &[]).is_err());
        assert!(decode::<4>(4, 0, &[]).is_err());
        assert!(decode::<4>(4, 7, &[0.0; 16]).is_err());
        assert!(decode::<4>(3, 0, &[0.0; 4]).is_err());
        assert!(decode::<4>(3, 0, &[0.0; 6]).is_err());
        assert!(decode::<4>(1, 0, &[0.0]).is_err());
        let strokes = |count| [0.1, count, 0.1, 0.0, 0.1, 0.0, 0.1, 0.04, 0.1];
        assert!(decode::<4>(4, 6, &strokes(3.0)).is_ok());
        assert!(decode::<4>(4, 6, &strokes(2.5)).is_err());
        assert!(decode::<4>(4, 6, &strokes(-1.0)).is_err());
    }
}
