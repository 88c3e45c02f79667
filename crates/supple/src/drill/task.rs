//! Requests that move the arm to its start pose and start the task. Cycles are counted from the first one in which the
//! controller accepts requests.

use super::spec::{DriveShutdown, Event, FaultTime, InvalidRequest, Spec, TestTask};
use crate::cli::UpTrajectory;
use crate::operate::{Approach, trajectory_for};
use supple_cli::exit::Failure;
use supple_core::config::Gains;
use supple_core::controller::{Breakaway, Request};
use supple_core::dynamics::{gravity, jacobian};
use supple_core::math::Vector3;
use supple_core::trajectory::{Fourier, Line, Rotation};
use supple_core::{Config, Trajectory, Vector};
use supple_experiment::{PoseMotion, scenario, start_pose};
use supple_model::Description;

/// Distance and duration of the downward move: minimum jerk, peak speed 0.25 m/s.
const DESCENT_M: f64 = 0.2;
const DESCENT_S: f64 = 1.5;
/// Duration of the downward move in joint impedance mode, in which the joints lag behind the reference: peak speed 0.19 m/s.
const COMPLIANT_DESCENT_S: f64 = 2.0;
/// Duration of the downward move at the tip stiffness of the law, while the tip rotates: peak speed 0.15 m/s.
const POSE_DESCENT_S: f64 = 2.5;
/// Rotation of the tip during the downward move \[rad\].
const TURN_RAD: f64 = 0.4;
/// Amplitude and angular frequency of the shoulder's oscillation: 0.25 m/s at the tip, which is 0.6 m away.
const SWING_RAD: f64 = 0.15;
const SWING_RAD_PER_S: f64 = 2.8;
/// Stiffness of the stiff track \[N/m\], if the arm allows it: the maximum of the built-in WAMs.
const STIFF_N_PER_M: f64 = 1000.0;
/// Torque ramp of the breakaway task, whose joint has not moved at the event \[N m/s\], \[rad\], \[N m\].
const RAMP_NM_PER_S: f64 = 0.5;
const RAMP_STOP_RAD: f64 = 0.03;
const RAMP_LIMIT_NM: f64 = 6.0;
/// Joint that oscillates, or is loaded by the ramp.
const SHOULDER: usize = 1;

/// Requests with their cycles, and the cycle of the event.
pub struct Script<const N: usize> {
    /// Requests, each with its cycle from the start.
    pub requests: Vec<(u64, Request<N>)>,
    /// Cycle in which the task begins, counted from the start.
    pub task_start_cycle: u64,
    /// Cycle of the event, counted from the start.
    pub event_cycle: u64,
    /// Pose in which the task begins \[rad\].
    pub start_rad: Vector<N>,
}

/// Returns the request of the task, for an arm in its start pose.
///
/// # Errors
/// [`Failure::Experiment`] if the arm cannot perform the task.
pub fn request<const N: usize>(
    spec: &Spec,
    config: &Config<N>,
    description: &Description,
) -> Result<Request<N>, Failure> {
    let (sinusoid, duration_s) = scenario::sinusoid(1.0);
    let start_m = sinusoid.at(0.0).position;
    let down_m = start_m - Vector3::new(0.0, 0.0, DESCENT_M);
    Ok(match spec.task {
        TestTask::GravityHold => Request::GravityHold,
        TestTask::Float => Request::Float,
        TestTask::JointImpedance => Request::JointImpedance {
            target_rad: start_pose(config, "drill", &Trajectory::Hold(down_m), 1.0)?,
            duration_s: COMPLIANT_DESCENT_S,
        },
        TestTask::Move => Request::Move {
            target_rad: start_pose(config, "drill", &Trajectory::Hold(down_m), 1.0)?,
            duration_s: DESCENT_S,
        },
        TestTask::Track if spec.event == Event::Obstacle => {
            Request::Track(Trajectory::Line(Line {
                from_m: start_m,
                to_m: down_m,
                duration_s: DESCENT_S,
            }))
        }
        TestTask::Track | TestTask::TrackStiff => Request::Track(sinusoid),
        TestTask::Probe => Request::Track(trajectory_for(UpTrajectory::Probe, description).0),
        TestTask::TrackPose => pose_motion().request(),
        TestTask::Breakaway => Request::Breakaway(Breakaway {
            joint: SHOULDER.min(N - 1),
            rate_nm_per_s: RAMP_NM_PER_S,
            stop_rad: RAMP_STOP_RAD,
            limit_nm: RAMP_LIMIT_NM,
        }),
        TestTask::Excite => {
            let start_rad = start_pose(config, "drill", &sinusoid, duration_s)?;
            let mut series = Fourier::at_rest(start_rad, SWING_RAD_PER_S);
            series.sine_rad[0][SHOULDER.min(N - 1)] = SWING_RAD;
            series.duration_s = 3.0;
            series.ramp_s = 0.3;
            Request::Excite(series)
        }
    })
}

/// Returns the pose from which the pose task starts \[rad\].
///
/// # Errors
/// [`Failure::Experiment`] if the arm cannot perform the task.
pub fn pose_start_rad<const N: usize>(config: &Config<N>) -> Result<Vector<N>, Failure> {
    Ok(Approach::to_pose(config, &pose_motion())?.start_rad())
}

/// Returns the force with which the law may press on a block under the path \[N\]: stiffness times length of the path, with the
/// stiffness of the tip, or that of the joints downwards at the tip. None if the task follows no path.
pub fn law_force_n<const N: usize>(
    task: TestTask,
    config: &Config<N>,
    start_rad: &Vector<N>,
) -> Option<f64> {
    match task {
        TestTask::Track | TestTask::Probe | TestTask::TrackPose => {
            Some(config.law.gains.stiffness_n_per_m.z * DESCENT_M)
        }
        TestTask::TrackStiff => Some(stiff_n_per_m(config) * DESCENT_M),
        TestTask::JointImpedance => {
            let down = jacobian(&config.arm, start_rad);
            let springs = &config.joint_gains.stiffness_nm_per_rad;
            let compliance_m_per_n: f64 = (0..N)
                .filter(|joint| springs[*joint] > 0.0)
                .map(|joint| down[(2, joint)] * down[(2, joint)] / springs[joint])
                .sum();
            Some(DESCENT_M / compliance_m_per_n)
        }
        _ => None,
    }
}

/// Returns the stiffness of the stiff track \[N/m\].
fn stiff_n_per_m<const N: usize>(config: &Config<N>) -> f64 {
    STIFF_N_PER_M.min(config.limits.stiffness_n_per_m)
}

/// Returns the force with which an arm without torque rests on a block under its tip \[N\], if only the shoulder moves.
pub fn weight_n<const N: usize>(config: &Config<N>, start_rad: &Vector<N>) -> f64 {
    let lever_m = jacobian(&config.arm, start_rad)[(2, SHOULDER)];
    (gravity(&config.arm, start_rad)[SHOULDER] / lever_m).abs()
}

/// Returns the motion of the pose task: the downward path of the joint impedance task, slower, while the tip rotates about the
/// vertical.
fn pose_motion() -> PoseMotion {
    let from_m = scenario::sinusoid(1.0).0.at(0.0).position;
    PoseMotion {
        trajectory: Trajectory::Line(Line {
            from_m,
            to_m: from_m - Vector3::new(0.0, 0.0, DESCENT_M),
            duration_s: POSE_DESCENT_S,
        }),
        rotation: Rotation {
            axis: Vector3::z(),
            angle_rad: TURN_RAD,
            duration_s: POSE_DESCENT_S,
        },
        duration_s: POSE_DESCENT_S,
    }
}

impl<const N: usize> Script<N> {
    /// Creates the requests that move the arm from the home pose to the start pose and start the task, and the request that is
    /// or prepares the event.
    ///
    /// # Errors
    /// [`Failure::Experiment`] if the arm cannot perform the task.
    pub fn new(
        spec: &Spec,
        config: &Config<N>,
        description: &Description,
        home_rad: &Vector<N>,
    ) -> Result<Script<N>, Failure> {
        let approach = match spec.task {
            TestTask::TrackPose => Approach::to_pose(config, &pose_motion())?,
            _ => {
                let (trajectory, duration_s) = match spec.task {
                    TestTask::Probe => trajectory_for(UpTrajectory::Probe, description),
                    _ => scenario::sinusoid(1.0),
                };
                Approach::new(config, trajectory, duration_s)?
            }
        };
        let (to_start, task_start_cycle, _) = approach.requests(home_rad);
        let cycles = |time_s: f64| (time_s / config.period_s).round() as u64;
        let mut script = Script {
            requests: vec![(0, to_start)],
            task_start_cycle,
            event_cycle: task_start_cycle
                + cycles(match spec.task {
                    TestTask::GravityHold | TestTask::Float => 0.3,
                    // In the tasks below, the event is near the highest speed of the motion.
                    TestTask::Move => 0.6,
                    TestTask::JointImpedance => 0.8,
                    TestTask::TrackPose => 1.0,
                    TestTask::Track | TestTask::TrackStiff | TestTask::Probe => 0.8,
                    TestTask::Excite => 0.7,
                    TestTask::Breakaway => 0.5,
                }),
            start_rad: approach.start_rad(),
        };
        if let Event::Injected {
            when: FaultTime::InTheTask(after_ms),
            ..
        } = spec.event
        {
            let event_s = script.event_cycle as f64 * config.period_s + f64::from(after_ms) * 1e-3;
            script.event_cycle = cycles(event_s);
        }
        if spec.event == Event::Drives(DriveShutdown::IdleAtHome) {
            return Ok(Script {
                requests: vec![(0, Request::GravityHold)],
                task_start_cycle: 0,
                event_cycle: cycles(0.3),
                start_rad: *home_rad,
            });
        }
        if let Event::Request(wrong) = spec.event {
            let request = match wrong {
                InvalidRequest::TooFast => Request::Track(scenario::sinusoid(1000.0).0),
                InvalidRequest::TooStiff => Request::Gains {
                    gains: Gains::isotropic(1000.0, 1e4),
                    ramp_s: 0.0,
                },
                InvalidRequest::WhileIdle => {
                    // The arm stays idle: it is never activated (emu), or its drives are idle from the first cycle
                    // (sim).
                    script.requests.clear();
                    to_start
                }
            };
            if wrong != InvalidRequest::WhileIdle {
                script
                    .requests
                    .push((task_start_cycle, Request::GravityHold));
            }
            script.requests.push((script.event_cycle, request));
            return Ok(script);
        }
        if spec.task == TestTask::TrackStiff {
            let gains = scenario::gains_like(&config.law.gains, stiff_n_per_m(config));
            let request = Request::Gains { gains, ramp_s: 0.0 };
            // The request is sent before that of the task, because one request is executed per cycle.
            script.requests.push((task_start_cycle - 1, request));
        }
        script
            .requests
            .push((task_start_cycle, request(spec, config, description)?));
        if spec.event == Event::Drives(DriveShutdown::IdleWhenStiff) {
            let gains = Request::Gains {
                gains: Gains::isotropic(1000.0, 60.0),
                ramp_s: 0.0,
            };
            script
                .requests
                .push((task_start_cycle + cycles(0.4), gains));
        }
        Ok(script)
    }
}
