//! Types of the messages besides the record of the controller.

use crate::cdr::array;
use serde::{Deserialize, Serialize};
use supple_core::Pose;
use supple_core::nalgebra::{Rotation3, UnitQuaternion};

#[derive(Clone, Copy, Serialize, Deserialize)]
pub(crate) struct Stamp {
    sec: i32,
    nanosec: u32,
}

impl Stamp {
    /// Seconds saturate in the year 2038, as they do in ROS.
    pub fn from_ns(time_ns: u64) -> Stamp {
        Stamp {
            sec: i32::try_from(time_ns / 1_000_000_000).unwrap_or(i32::MAX),
            nanosec: (time_ns % 1_000_000_000) as u32,
        }
    }
}

/// `std_msgs/msg/Header`.
#[derive(Clone, Copy, Serialize)]
pub(crate) struct Header<'a> {
    pub stamp: Stamp,
    pub frame_id: &'a str,
}

/// A header as it is read.
#[derive(Deserialize)]
#[allow(
    dead_code,
    reason = "it is read past, and its time is that of the message"
)]
pub(crate) struct OwnedHeader {
    stamp: Stamp,
    frame_id: String,
}

/// `sensor_msgs/msg/JointState`.
#[derive(Serialize)]
pub(crate) struct JointState<'a> {
    pub header: Header<'a>,
    pub name: &'a [String],
    pub position: &'a [f64],
    pub velocity: &'a [f64],
    pub effort: &'a [f64],
}

/// `geometry_msgs/msg/WrenchStamped`.
#[derive(Serialize)]
pub(crate) struct WrenchStamped<'a> {
    pub header: Header<'a>,
    pub force: [f64; 3],
    pub torque: [f64; 3],
}

/// `geometry_msgs/msg/TransformStamped`; a `tf2_msgs/msg/TFMessage` is a sequence of them.
#[derive(Serialize)]
pub(crate) struct TransformStamped<'a> {
    header: Header<'a>,
    child_frame_id: &'a str,
    translation: [f64; 3],
    rotation_xyzw: [f64; 4],
}

impl<'a> TransformStamped<'a> {
    pub fn new(header: Header<'a>, child_frame_id: &'a str, pose: &Pose) -> Self {
        let rotation = Rotation3::from_matrix_unchecked(pose.rotation);
        let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
        TransformStamped {
            header,
            child_frame_id,
            translation: pose.translation.into(),
            rotation_xyzw: rotation.coords.into(),
        }
    }
}

/// Start and duration of a cycle on a monotonic clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CycleTiming {
    /// Time since the start of the previous cycle \[ns\].
    pub period_ns: u64,
    /// Time from the measurement to the start of the step \[ns\].
    pub latency_ns: u64,
    /// Time from the start of the step until its torques are known, including the check for requests \[ns\].
    pub step_ns: u64,
}

/// True state of a simulated plant at the start of a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlantTruth<const N: usize> {
    /// Joint angles \[rad\].
    #[serde(with = "array")]
    pub position_rad: [f64; N],
    /// Joint velocities \[rad/s\].
    #[serde(with = "array")]
    pub velocity_rad_per_s: [f64; N],
    /// Position of the tip, base axes \[m\].
    pub tip_position_m: [f64; 3],
    /// Velocity of the tip, base axes \[m/s\].
    pub tip_velocity_m_per_s: [f64; 3],
    /// Contact force on the tip, unfiltered, base axes \[N\].
    pub contact_force_n: [f64; 3],
    /// Friction torque, positive against positive motion \[N m\].
    #[serde(with = "array")]
    pub friction_torque_nm: [f64; N],
    /// Torque of the motors \[N m\].
    #[serde(with = "array")]
    pub motor_torque_nm: [f64; N],
}
