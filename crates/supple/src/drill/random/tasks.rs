//! Draws random tasks; each has a start pose and the requests that start it.

use super::arm::{Arm, between, pick};
use core::fmt;
use serde::Serialize;
use supple_core::config::Role;
use supple_core::controller::{Breakaway, Request, SetPoint, check_motion};
use supple_core::dynamics::tip_pose;
use supple_core::math::Vector3;
use supple_core::trajectory::{Fourier, Sinusoid};
use supple_core::{Trajectory, Vector};
use supple_experiment::{scenario, start_pose};
use supple_random::Random;

/// Maximum number of attempts to draw a feasible motion.
const DRAWS: u32 = 60;
/// Maximum duration of a point-to-point motion \[s\].
const LONGEST_S: f64 = 8.0;
/// Time between set-points, and lead of each set-point \[s\].
const SET_POINT_S: f64 = 0.04;
/// Duration of the tasks with a fixed duration \[s\].
const TASK_S: f64 = 3.0;

/// Task of a case.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Task {
    GravityHold,
    Move,
    JointImpedance,
    Track { stiffness_n_per_m: f64 },
    Float,
    Excite,
    SetPoints,
    Breakaway,
}

impl fmt::Display for Task {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Task::GravityHold => "gravity_hold",
            Task::Move => "move",
            Task::JointImpedance => "joint_impedance",
            Task::Track { stiffness_n_per_m } => {
                return write!(f, "track, {stiffness_n_per_m:.0} N/m");
            }
            Task::Float => "float",
            Task::Excite => "excite",
            Task::SetPoints => "set_points",
            Task::Breakaway => "breakaway",
        })
    }
}

/// A task with its start pose, and its requests with times from the start of the task \[s\].
pub(super) struct Plan<const N: usize> {
    pub(super) task: Task,
    pub(super) start_rad: Vector<N>,
    pub(super) requests: Vec<(f64, Request<N>)>,
}

/// Draws a task; `None` if the arm cannot perform it.
pub(super) fn draw<const N: usize>(arm: &Arm<N>, random: &mut Random) -> Option<Plan<N>> {
    let start_rad = arm.pose(random);
    let single = |task, request| Plan {
        task,
        start_rad,
        requests: vec![(0.0, request)],
    };
    match random.index(10) {
        0 => Some(single(Task::GravityHold, Request::GravityHold)),
        1 => Some(single(Task::Float, Request::Float)),
        2 => point_to_point(arm, random, Task::Move),
        3 => point_to_point(arm, random, Task::JointImpedance),
        4..=6 => track(arm, random),
        7 => excite(arm, random),
        8 => set_points(arm, random),
        _ => {
            let joint = random.index(N);
            let is_active = arm.config().roles[joint] == Role::Active;
            is_active.then(|| {
                let up = random.uniform() < 0.5;
                let ramp = Breakaway {
                    joint,
                    rate_nm_per_s: if up { 1.0 } else { -1.0 },
                    stop_rad: 0.03,
                    limit_nm: 4.0,
                };
                single(Task::Breakaway, Request::Breakaway(ramp))
            })
        }
    }
}

/// Draws a motion between two poses, as fast as the limits allow or up to three times slower.
fn point_to_point<const N: usize>(
    arm: &Arm<N>,
    random: &mut Random,
    task: Task,
) -> Option<Plan<N>> {
    let config = arm.config();
    for _ in 0..DRAWS {
        let start_rad = arm.pose(random);
        let towards_rad = arm.pose(random);
        let share = between(random, 0.1, 0.6);
        let target_rad = start_rad + (towards_rad - start_rad) * share;
        let request = |duration_s| match task {
            Task::Move => Request::Move {
                target_rad,
                duration_s,
            },
            _ => Request::JointImpedance {
                target_rad,
                duration_s,
            },
        };
        let slower = between(random, 1.0, 3.0);
        let mut duration_s = 200.0 * config.period_s;
        while duration_s < LONGEST_S {
            if check_motion(&arm.controller, &start_rad, &request(duration_s)).is_ok() {
                let requests = vec![(0.0, request(duration_s * slower))];
                return Some(Plan {
                    task,
                    start_rad,
                    requests,
                });
            }
            duration_s *= 1.15;
        }
    }
    None
}

/// Draws a sinusoid anywhere in the workspace, or the sinusoid of the paper at another speed, at a stiffness from 5 N/m to the
/// arm's maximum.
fn track<const N: usize>(arm: &Arm<N>, random: &mut Random) -> Option<Plan<N>> {
    let config = arm.config();
    let highest = config.limits.stiffness_n_per_m;
    let stiffness_n_per_m = highest.min(*pick(random, &[5.0, 5.0, 50.0, 200.0, 1000.0]));
    let gains = Request::Gains {
        gains: scenario::gains_like(&config.law.gains, stiffness_n_per_m),
        ramp_s: *pick(random, &[0.0, 1.0]),
    };
    for _ in 0..DRAWS {
        let trajectory = match random.uniform() < 0.5 {
            true => scenario::sinusoid(between(random, 0.5, 4.5)).0,
            false => {
                let amplitude_m = Vector3::from_fn(|_, _| 0.2 * random.signed());
                Trajectory::Sinusoid(Sinusoid {
                    centre_m: tip_pose(&config.arm, &arm.pose(random)).translation,
                    amplitude_m,
                    angular_frequency_rad_per_s: between(random, 0.7, 4.0),
                    ramp_s: 0.5,
                })
            }
        };
        let Ok(start_rad) = start_pose(config, "drill", &trajectory, TASK_S) else {
            continue;
        };
        let request = Request::Track(trajectory);
        if check_motion(&arm.controller, &start_rad, &request).is_ok() {
            return Some(Plan {
                task: Task::Track { stiffness_n_per_m },
                start_rad,
                requests: vec![(-0.2, gains), (0.0, request)],
            });
        }
    }
    None
}

/// Draws oscillations of two joints.
fn excite<const N: usize>(arm: &Arm<N>, random: &mut Random) -> Option<Plan<N>> {
    for _ in 0..DRAWS {
        let start_rad = arm.pose(random);
        let mut series = Fourier::at_rest(start_rad, between(random, 1.0, 6.0));
        series.sine_rad[0][random.index(N)] = between(random, 0.05, 0.3);
        series.sine_rad[1][random.index(N)] = between(random, 0.0, 0.1);
        (series.duration_s, series.ramp_s) = (TASK_S, 0.3);
        let request = Request::Excite(series);
        if check_motion(&arm.controller, &start_rad, &request).is_ok() {
            return Some(Plan {
                task: Task::Excite,
                start_rad,
                requests: vec![(0.0, request)],
            });
        }
    }
    None
}

/// Streams points of the paper's sinusoid as set-points.
fn set_points<const N: usize>(arm: &Arm<N>, random: &mut Random) -> Option<Plan<N>> {
    let config = arm.config();
    let (sinusoid, _) = scenario::sinusoid(between(random, 0.5, 3.5));
    let start_rad = start_pose(config, "drill", &sinusoid, TASK_S).ok()?;
    check_motion(&arm.controller, &start_rad, &Request::Track(sinusoid)).ok()?;
    let hold = Trajectory::Hold(sinusoid.at(0.0).position);
    let mut requests = vec![(0.0, Request::Track(hold))];
    let count = (TASK_S / SET_POINT_S) as u32;
    requests.extend((0..count).map(|k| {
        let at_s = f64::from(k) * SET_POINT_S;
        let reference = sinusoid.at(at_s + SET_POINT_S);
        let point = SetPoint {
            position_m: reference.position,
            velocity_m_per_s: reference.velocity,
            acceleration_m_per_s2: reference.acceleration,
            // The loop that sends the set-point adds the number of its own cycle.
            at_cycle: (SET_POINT_S / config.period_s) as u64,
        };
        (0.1 + at_s, Request::SetPoint(point))
    }));
    Some(Plan {
        task: Task::SetPoints,
        start_rad,
        requests,
    })
}
