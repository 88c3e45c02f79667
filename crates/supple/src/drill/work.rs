//! What a controller is asked for so that the arm is at work, in cycles from the first free one.

use super::spec::{Event, Lowered, Spec, Work, Wrong};
use crate::cli::Course;
use crate::exit::Failure;
use crate::operate::{Approach, course};
use supple_core::config::Gains;
use supple_core::controller::Request;
use supple_core::math::Vector3;
use supple_core::trajectory::{Fourier, Line};
use supple_core::{Config, Trajectory, Vector};
use supple_experiment::{scenario, start_pose};
use supple_model::Description;

/// How far the tip goes down, and in what time: a minimum-jerk way whose peak speed is 0.25 m/s.
const DOWN_M: f64 = 0.2;
const DOWN_S: f64 = 1.5;
/// Angle and pace of the shoulder's swing: 0.25 m/s at the tip, which is 0.6 m away.
const SWING_RAD: f64 = 0.15;
const SWING_RAD_PER_S: f64 = 2.8;
/// Joint that swings.
const SHOULDER: usize = 1;

/// A script: requests with their cycles, and when it happens.
pub struct Script<const N: usize> {
    /// Requests, each with its cycle from the start.
    pub requests: Vec<(u64, Request<N>)>,
    /// When the work begins, in cycles from the start.
    pub work_at: u64,
    /// When what is to happen happens, in cycles from the start.
    pub event_at: u64,
    /// Pose in which work begins \[rad\].
    pub start_rad: Vector<N>,
}

/// What the arm is asked for, where it stands in its start pose.
///
/// # Errors
/// [`Failure::Experiment`] where the arm cannot do it.
pub fn request<const N: usize>(
    spec: &Spec,
    config: &Config<N>,
    description: &Description,
) -> Result<Request<N>, Failure> {
    let (sinusoid, duration_s) = scenario::sinusoid(1.0);
    let start_m = sinusoid.at(0.0).position;
    let start_rad = start_pose(config, "drill", &sinusoid, duration_s)?;
    let down_m = start_m - Vector3::new(0.0, 0.0, DOWN_M);
    Ok(match spec.work {
        Work::GravityHold => Request::GravityHold,
        Work::Move => Request::Move {
            target_rad: start_pose(config, "drill", &Trajectory::Hold(down_m), 1.0)?,
            duration_s: DOWN_S,
        },
        Work::Track if spec.event == Event::Obstacle => Request::Track(Trajectory::Line(Line {
            from_m: start_m,
            to_m: down_m,
            duration_s: DOWN_S,
        })),
        Work::Track => Request::Track(sinusoid),
        Work::Probe => Request::Track(course(Course::Probe, description).0),
        Work::Excite => {
            let mut series = Fourier::at_rest(start_rad, SWING_RAD_PER_S);
            series.sine_rad[0][SHOULDER.min(N - 1)] = SWING_RAD;
            series.duration_s = 3.0;
            series.ramp_s = 0.3;
            Request::Excite(series)
        }
    })
}

impl<const N: usize> Script<N> {
    /// From the home pose to the start pose, to work, and to what happens to it.
    ///
    /// # Errors
    /// [`Failure::Experiment`] where the arm cannot do it.
    pub fn new(
        spec: &Spec,
        config: &Config<N>,
        description: &Description,
        home_rad: &Vector<N>,
    ) -> Result<Script<N>, Failure> {
        let (trajectory, duration_s) = match spec.work {
            Work::Probe => course(Course::Probe, description),
            _ => scenario::sinusoid(1.0),
        };
        let approach = Approach::new(config, trajectory, duration_s)?;
        let (to_start, work_at, _) = approach.requests(home_rad);
        let cycles = |time_s: f64| (time_s / config.period_s).round() as u64;
        let mut script = Script {
            requests: vec![(0, to_start)],
            work_at,
            event_at: work_at
                + cycles(match spec.work {
                    Work::GravityHold => 0.3,
                    // At its fastest.
                    Work::Move => 0.6,
                    Work::Track | Work::Probe => 0.8,
                    Work::Excite => 0.7,
                }),
            start_rad: start_pose(config, "drill", &trajectory, duration_s)?,
        };
        if let Event::Request(wrong) = spec.event {
            let request = match wrong {
                Wrong::TooFast => Request::Track(scenario::sinusoid(1000.0).0),
                Wrong::TooStiff => Request::Gains {
                    gains: Gains::isotropic(1000.0, 1e4),
                    ramp_s: 0.0,
                },
                Wrong::WhileIdle => {
                    // The arm was never activated, or its drives are idle from the start on.
                    script.requests.clear();
                    to_start
                }
            };
            if wrong != Wrong::WhileIdle {
                script.requests.push((work_at, Request::GravityHold));
            }
            script.requests.push((script.event_at, request));
            return Ok(script);
        }
        script
            .requests
            .push((work_at, request(spec, config, description)?));
        if spec.event == Event::Drives(Lowered::IdleWhenStiff) {
            let gains = Request::Gains {
                gains: Gains::isotropic(1000.0, 60.0),
                ramp_s: 0.0,
            };
            script.requests.push((work_at + cycles(0.4), gains));
        }
        Ok(script)
    }
}
