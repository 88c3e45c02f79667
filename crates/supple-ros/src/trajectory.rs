//! A joint trajectory of ROS 2 as a sequence of moves, each checked by the controller when its turn comes.

use serde::Deserialize;
use std::collections::VecDeque;
use supple_core::config::Role;
use supple_core::controller::Request;
use supple_core::{Config, Vector};

/// Message type.
pub(crate) const TYPE: &str = "trajectory_msgs/msg/JointTrajectory";
/// Definition of the message type, with the types that it contains.
pub(crate) const DEFINITION: &str = "\
std_msgs/Header header
string[] joint_names
trajectory_msgs/JointTrajectoryPoint[] points
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: trajectory_msgs/JointTrajectoryPoint
float64[] positions
float64[] velocities
float64[] accelerations
float64[] effort
builtin_interfaces/Duration time_from_start
================================================================================
MSG: builtin_interfaces/Duration
int32 sec
uint32 nanosec
";

/// Maximum number of points.
const MAX_POINTS: usize = 1000;
/// Difference up to which a point may give a held joint another angle than the one at which it is held \[rad\].
const HELD_TOLERANCE_RAD: f64 = 0.02;

#[derive(Deserialize)]
#[allow(dead_code, reason = "the header is read past, efforts are not used")]
struct JointTrajectory {
    header: (Time, String),
    joint_names: Vec<String>,
    points: Vec<Point>,
}

#[derive(Clone, Copy, Deserialize)]
struct Time {
    sec: i32,
    nanosec: u32,
}

#[derive(Deserialize)]
#[allow(dead_code, reason = "efforts are not used")]
struct Point {
    positions: Vec<f64>,
    velocities: Vec<f64>,
    accelerations: Vec<f64>,
    effort: Vec<f64>,
    time_from_start: Time,
}

/// A move to a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Waypoint<const N: usize> {
    /// Pose \[rad\].
    pub target_rad: Vector<N>,
    /// Duration of the move \[s\].
    pub duration_s: f64,
}

impl<const N: usize> Waypoint<N> {
    /// Returns the request for the move.
    pub fn request(&self) -> Request<N> {
        Request::Move {
            target_rad: self.target_rad,
            duration_s: self.duration_s,
        }
    }
}

/// Reads a message: the moves from point to point; none for a message without points, which asks the arm to stop.
///
/// The arm comes to rest in each point, so points with velocities or accelerations are rejected.
///
/// # Errors
/// What is wrong with the message, and the remedy.
pub(crate) fn read<const N: usize>(
    message: &[u8],
    names: &[String],
    config: &Config<N>,
) -> Result<VecDeque<Waypoint<N>>, String> {
    let trajectory: JointTrajectory = supple_log::cdr::decode(message)?;
    if trajectory.points.is_empty() {
        return Ok(VecDeque::new());
    }
    let count = trajectory.points.len();
    if count > MAX_POINTS {
        return Err(format!("{count} points, the maximum is {MAX_POINTS}"));
    }
    let order = order_of(&trajectory.joint_names, names)?;
    let mut before_s = 0.0;
    let mut waypoints = VecDeque::with_capacity(count);
    for (index, point) in trajectory.points.iter().enumerate() {
        let waypoint = waypoint(point, before_s, &order, names, config);
        let waypoint = waypoint.map_err(|reason| format!("points[{index}]: {reason}"))?;
        before_s += waypoint.duration_s;
        waypoints.push_back(waypoint);
    }
    Ok(waypoints)
}

/// Returns for each joint of the arm its index in the message.
fn order_of(given: &[String], names: &[String]) -> Result<Vec<usize>, String> {
    let expected = || {
        format!(
            "joint_names are [{}], expected each of [{}] once",
            given.join(", "),
            names.join(", ")
        )
    };
    if given.len() != names.len() {
        return Err(expected());
    }
    let find = |name: &String| given.iter().position(|other| other == name);
    names
        .iter()
        .map(|name| find(name).ok_or_else(expected))
        .collect()
}

fn waypoint<const N: usize>(
    point: &Point,
    before_s: f64,
    order: &[usize],
    names: &[String],
    config: &Config<N>,
) -> Result<Waypoint<N>, String> {
    if point.positions.len() != N {
        let found = point.positions.len();
        return Err(format!("{found} positions, expected {N}"));
    }
    let moving = |values: &[f64]| values.iter().any(|value| *value != 0.0);
    if moving(&point.velocities) || moving(&point.accelerations) {
        return Err(
            "velocities or accelerations are not zero; the arm rests in each point: leave them out, and points on the way too"
                .to_owned(),
        );
    }
    let time_s = seconds(point.time_from_start);
    let duration_s = time_s - before_s;
    if duration_s.is_nan() || duration_s <= 0.0 {
        return Err(format!(
            "time_from_start is {time_s} s, expected more than {before_s} s: each move takes time"
        ));
    }
    let mut target_rad = Vector::zeros();
    for joint in 0..N {
        let angle = point.positions[order[joint]];
        if !angle.is_finite() {
            return Err(format!("position of {} is {angle}", names[joint]));
        }
        target_rad[joint] = match config.roles[joint] {
            Role::Held { position_rad, .. }
                if (angle - position_rad).abs() <= HELD_TOLERANCE_RAD =>
            {
                position_rad
            }
            _ => angle,
        };
    }
    Ok(Waypoint {
        target_rad,
        duration_s,
    })
}

fn seconds(time: Time) -> f64 {
    f64::from(time.sec) + f64::from(time.nanosec) * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Serialize;
    use supple_model::Description;

    type PointTuple = (Vec<f64>, Vec<f64>, Vec<f64>, Vec<f64>, (i32, u32));

    fn arm() -> Description {
        Description::asset("wam4").expect("a built-in arm")
    }

    fn message(names: &[&str], points: Vec<PointTuple>) -> Vec<u8> {
        let header = ((0_i32, 0_u32), "base".to_owned());
        encode(&(header, names, points))
    }

    fn encode<T: Serialize>(value: &T) -> Vec<u8> {
        let mut message = Vec::new();
        supple_log::cdr::encode(value, &mut message).expect("encodable");
        message
    }

    fn at_rest(positions: &[f64], sec: i32) -> PointTuple {
        (
            positions.to_vec(),
            vec![],
            vec![],
            vec![],
            (sec, 500_000_000),
        )
    }

    fn read_wam(message: &[u8]) -> Result<VecDeque<Waypoint<4>>, String> {
        let arm = arm();
        read(
            message,
            arm.joint_names(),
            &arm.config().expect("four joints"),
        )
    }

    const NAMES: [&str; 4] = ["joint1", "joint2", "joint3", "joint4"];

    #[test]
    fn points_become_moves_in_the_order_of_the_arm() {
        let arm = arm();
        let names: Vec<&str> = arm.joint_names().iter().map(String::as_str).collect();
        let reversed: Vec<&str> = names.iter().rev().copied().collect();
        let held = arm.home_rad()[1];
        let points = vec![
            at_rest(&[4.0, 0.3, held + 0.001, 0.1], 1),
            at_rest(&[4.1, 0.3, held, 0.2], 4),
        ];
        let moves = read_wam(&message(&reversed, points)).expect("valid");
        let durations: Vec<f64> = moves.iter().map(|m| m.duration_s).collect();
        assert_eq!(durations, [1.5, 3.0]);
        assert_eq!(moves[0].target_rad[0], 0.1);
        assert_eq!(moves[0].target_rad[3], 4.0);
    }

    #[test]
    fn a_message_without_points_stops() {
        assert_eq!(read_wam(&message(&NAMES, vec![])).expect("valid").len(), 0);
    }

    #[test]
    fn bad_messages_are_rejected_with_the_reason() {
        let names = arm().joint_names().to_vec();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let good = at_rest(&[0.0; 4], 1);
        let with = |change: fn(&mut PointTuple)| {
            let mut point = at_rest(&[0.0; 4], 2);
            change(&mut point);
            message(&names, vec![good.clone(), point])
        };
        let cases = [
            (
                message(&["a", "b", "c", "d"], vec![good.clone()]),
                "joint_names are [a, b, c, d]",
            ),
            (message(&names[..3], vec![good.clone()]), "expected each of"),
            (
                with(|p| p.0.truncate(2)),
                "points[1]: 2 positions, expected 4",
            ),
            (with(|p| p.0[2] = f64::NAN), "is NaN"),
            (with(|p| p.1 = vec![0.1; 4]), "leave them out"),
            (with(|p| p.4 = (1, 500_000_000)), "expected more than 1.5 s"),
            (vec![0, 1, 0, 0, 1, 2], ""),
            (b"not cdr".to_vec(), "CDR"),
        ];
        for (message, expected) in cases {
            let reason = read_wam(&message).expect_err(expected);
            assert!(reason.contains(expected), "{reason}: {expected}");
        }
    }

    #[test]
    fn any_bytes_are_a_trajectory_or_an_error() {
        let whole = message(&NAMES, vec![at_rest(&[0.0; 4], 1)]);
        for length in 0..whole.len() {
            let _ = read_wam(&whole[..length]);
            let mut changed = whole.clone();
            changed[length] ^= 0xff;
            let _ = read_wam(&changed);
        }
    }
}
