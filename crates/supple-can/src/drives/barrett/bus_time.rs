//! Checks whether the bus bandwidth allows a cycle rate, before the arm is contacted.
//!
//! A cycle consists of a request for positions, a reply of every motor puck, the controller's answer, one or two torque
//! frames and, in some cycles, an auxiliary poll of the safety module or of the force/torque sensor. The time of every
//! frame includes the maximum number of stuff bits for its length. Positions, torques, the longest auxiliary poll
//! and the controller's answer time must fit one period.

use core::fmt;
use supple_can_frame::timing::max_bits;

const NS_PER_BIT: u64 = 1_000;
const REQUEST_DLC: u8 = 1;
const MOTOR_REPLY_DLC: u8 = 3;
const BOTH_REPLY_DLC: u8 = 6;
const TORQUE_DLC: u8 = 8;
/// Data length of the pendant's reply: a 32-bit value.
const PENDANT_REPLY_DLC: u8 = 6;
/// Data lengths of the sensor's replies: forces, and torques with their status.
const SENSOR_REPLY_DLC: [u8; 2] = [6, 7];

/// Worst-case times of a cycle's frames \[ns\].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BusTime {
    /// Number of motor pucks.
    pub joints: usize,
    /// Number of pucks whose replies also contain a joint encoder.
    pub joint_encoders: usize,
    /// Whether a force/torque sensor is polled.
    pub sensor: bool,
    /// Time of the request for the positions and of all replies.
    pub positions_ns: u64,
    /// Time of the torque frames.
    pub torques_ns: u64,
    /// Time of the longest auxiliary poll: request and replies.
    pub auxiliary_poll_ns: u64,
    /// Time reserved for the controller's answer.
    pub answer_ns: u64,
}

/// Error: the period is too short.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Overload {
    /// Times that must fit into the period.
    pub time: BusTime,
    /// Requested period \[ns\].
    pub period_ns: u64,
}

fn us(ns: u64) -> u64 {
    ns.div_ceil(1_000)
}

impl fmt::Display for Overload {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let BusTime {
            joints,
            joint_encoders,
            sensor: _,
            positions_ns,
            torques_ns,
            auxiliary_poll_ns,
            answer_ns,
        } = self.time;
        write!(
            f,
            "a cycle of {} us is too short for {joints} joints at 1 Mbit/s with maximum bit stuffing: \
             positions {} us",
            us(self.period_ns),
            us(positions_ns)
        )?;
        if joint_encoders > 0 {
            write!(f, " ({joint_encoders} with joint encoders)")?;
        }
        write!(
            f,
            " + torques {} us + one auxiliary poll {} us + the controller's answer {} us = {} us; \
             the maximum rate is {} Hz, set with --rate-hz",
            us(torques_ns),
            us(auxiliary_poll_ns),
            us(answer_ns),
            us(self.time.min_period_ns()),
            1_000_000_000 / self.time.min_period_ns(),
        )
    }
}

impl core::error::Error for Overload {}

/// Bus time of a period, listed frame by frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget {
    time: BusTime,
    period_ns: u64,
}

impl fmt::Display for Budget {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let time = &self.time;
        let motor_only = time.joints - time.joint_encoders;
        let torque_frames = torque_frames(time.joints);
        writeln!(
            f,
            "A cycle of {} us on a bus of 1 Mbit/s, each frame with the maximum bit stuffing of its length:",
            us(self.period_ns)
        )?;
        let mut frames = |what: &str, count: usize, dlc: u8| {
            if count == 0 {
                return Ok(());
            }
            let bits = max_bits(dlc);
            let all = count as u64 * u64::from(bits);
            writeln!(f, "{what:<46}{count} x {bits:>3} us = {all:>4} us")
        };
        frames("request for the positions", 1, REQUEST_DLC)?;
        frames("replies", motor_only, MOTOR_REPLY_DLC)?;
        frames(
            "replies with a joint encoder",
            time.joint_encoders,
            BOTH_REPLY_DLC,
        )?;
        frames("torques", torque_frames, TORQUE_DLC)?;
        let auxiliary = if time.sensor {
            "force/torque sensor, alternating with the module"
        } else {
            "safety module's mode and pendant, alternating"
        };
        writeln!(f, "{auxiliary:<58}{:>4} us", us(time.auxiliary_poll_ns))?;
        let answer = "time for the controller's answer";
        writeln!(f, "{answer:<58}{:>4} us", us(time.answer_ns))?;
        let min_ns = time.min_period_ns();
        writeln!(f, "{:<58}{:>4} us", "together", us(min_ns))?;
        write!(f, "The maximum rate is {} Hz.", 1_000_000_000 / min_ns)
    }
}

/// Returns the number of torque frames; each frame holds four torques.
fn torque_frames(joints: usize) -> usize {
    joints.div_ceil(4)
}

impl BusTime {
    /// Computes the bus time of an arm with `joints` motor pucks, of which `joint_encoders` also reply with a joint encoder's
    /// position, with or without the sensor; `answer_ns` is reserved for the controller's answer.
    pub fn new(joints: usize, joint_encoders: usize, sensor: bool, answer_ns: u64) -> BusTime {
        let bits = |dlc: u8| u64::from(max_bits(dlc));
        let replies = (joints - joint_encoders) as u64 * bits(MOTOR_REPLY_DLC)
            + joint_encoders as u64 * bits(BOTH_REPLY_DLC);
        let torque_frames = torque_frames(joints) as u64;
        let pendant = bits(REQUEST_DLC) + bits(PENDANT_REPLY_DLC);
        let readings: u64 = SENSOR_REPLY_DLC.into_iter().map(bits).sum();
        let auxiliary = if sensor {
            pendant.max(bits(REQUEST_DLC) + readings)
        } else {
            pendant
        };
        BusTime {
            joints,
            joint_encoders,
            sensor,
            positions_ns: (bits(REQUEST_DLC) + replies) * NS_PER_BIT,
            torques_ns: torque_frames * bits(TORQUE_DLC) * NS_PER_BIT,
            auxiliary_poll_ns: auxiliary * NS_PER_BIT,
            answer_ns,
        }
    }

    /// Shortest possible period \[ns\].
    pub fn min_period_ns(&self) -> u64 {
        self.positions_ns + self.answer_ns + self.torques_ns + self.auxiliary_poll_ns
    }

    /// Returns the maximum delay of a cycle's start that leaves time for replies, answer and torques \[ns\].
    pub fn slack_ns(&self, period_ns: u64) -> u64 {
        let needed_ns = self.positions_ns + self.answer_ns + self.torques_ns;
        period_ns.saturating_sub(needed_ns)
    }

    /// Returns the listing for a period \[ns\], which may be too short.
    pub fn budget(&self, period_ns: u64) -> Budget {
        Budget {
            time: *self,
            period_ns,
        }
    }

    /// Rejects a period \[ns\] that is too short.
    ///
    /// # Errors
    /// [`Overload`] with the times of all frames.
    pub fn check(&self, period_ns: u64) -> Result<(), Overload> {
        if self.min_period_ns() <= period_ns {
            return Ok(());
        }
        Err(Overload {
            time: *self,
            period_ns,
        })
    }
}
