//! Whether the bus carries a rate: the arithmetic, before the arm is touched.
//!
//! A cycle is a request for positions, a reply of every motor puck, the controller's answer, one or two
//! torque frames and, in some cycles, one more poll: of the safety module or of the force/torque sensor.
//! Every frame is taken with the worst stuffing that its length allows. Positions, torques and the longest
//! of the further polls must fit one period together with the time that the controller is given.

use core::fmt;
use supple_puck::timing::most_bits;

const NS_PER_BIT: u64 = 1_000;
const REQUEST_DLC: u8 = 1;
const MOTOR_REPLY_DLC: u8 = 3;
const BOTH_REPLY_DLC: u8 = 6;
const TORQUE_DLC: u8 = 8;
/// The pendant's word is 32 bits wide.
const PENDANT_REPLY_DLC: u8 = 6;
/// Forces, and torques with their status.
const SENSOR_REPLY_DLC: [u8; 2] = [6, 7];

/// The frames of a cycle, by worst case \[ns\].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BusTime {
    /// Motor pucks.
    pub joints: usize,
    /// Those whose replies carry a joint encoder as well.
    pub joint_encoders: usize,
    /// A force/torque sensor is polled.
    pub sensor: bool,
    /// Request for the positions and all replies.
    pub positions_ns: u64,
    /// Torque frames.
    pub torques_ns: u64,
    /// The longest further poll: request and replies.
    pub further_ns: u64,
    /// Time that the controller is given to answer.
    pub answer_ns: u64,
}

/// A period that is too short.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Overload {
    /// What has to fit.
    pub time: BusTime,
    /// Period asked for \[ns\].
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
            further_ns,
            answer_ns,
        } = self.time;
        write!(
            f,
            "a cycle of {} us is too short for {joints} joints at 1 Mbit/s with the worst stuffing: \
             positions {} us",
            us(self.period_ns),
            us(positions_ns)
        )?;
        if joint_encoders > 0 {
            write!(f, " ({joint_encoders} with joint encoders)")?;
        }
        write!(
            f,
            " + torques {} us + one further poll {} us + the controller's answer {} us = {} us; \
             the highest rate is {} Hz, set with --rate-hz",
            us(torques_ns),
            us(further_ns),
            us(answer_ns),
            us(self.time.least_period_ns()),
            1_000_000_000 / self.time.least_period_ns(),
        )
    }
}

impl core::error::Error for Overload {}

/// The arithmetic of a period, frame by frame.
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
            "A cycle of {} us on a bus of 1 Mbit/s, each frame with the worst stuffing of its length:",
            us(self.period_ns)
        )?;
        let mut frames = |what: &str, count: usize, dlc: u8| {
            if count == 0 {
                return Ok(());
            }
            let bits = most_bits(dlc);
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
        let further = if time.sensor {
            "force/torque sensor, by turns with the module"
        } else {
            "safety module's mode and pendant, by turns"
        };
        writeln!(f, "{further:<58}{:>4} us", us(time.further_ns))?;
        let answer = "time for the controller's answer";
        writeln!(f, "{answer:<58}{:>4} us", us(time.answer_ns))?;
        let least_ns = time.least_period_ns();
        writeln!(f, "{:<58}{:>4} us", "together", us(least_ns))?;
        write!(f, "The highest rate is {} Hz.", 1_000_000_000 / least_ns)
    }
}

/// A torque frame holds four.
fn torque_frames(joints: usize) -> usize {
    joints.div_ceil(4)
}

impl BusTime {
    /// Of an arm of `joints` motor pucks, `joint_encoders` of which reply with a joint encoder's position
    /// too, with or without the sensor, the controller being given `answer_ns`.
    pub fn new(joints: usize, joint_encoders: usize, sensor: bool, answer_ns: u64) -> BusTime {
        let bits = |dlc: u8| u64::from(most_bits(dlc));
        let replies = (joints - joint_encoders) as u64 * bits(MOTOR_REPLY_DLC)
            + joint_encoders as u64 * bits(BOTH_REPLY_DLC);
        let torque_frames = torque_frames(joints) as u64;
        let pendant = bits(REQUEST_DLC) + bits(PENDANT_REPLY_DLC);
        let readings: u64 = SENSOR_REPLY_DLC.into_iter().map(bits).sum();
        let further = if sensor {
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
            further_ns: further * NS_PER_BIT,
            answer_ns,
        }
    }

    /// The shortest period that all of it fits \[ns\].
    pub fn least_period_ns(&self) -> u64 {
        self.positions_ns + self.answer_ns + self.torques_ns + self.further_ns
    }

    /// By how much a cycle may begin late and still have its replies, its answer and its torques \[ns\].
    pub fn slack_ns(&self, period_ns: u64) -> u64 {
        let needed_ns = self.positions_ns + self.answer_ns + self.torques_ns;
        period_ns.saturating_sub(needed_ns)
    }

    /// The arithmetic of a period \[ns\], whether it is long enough or not.
    pub fn budget(&self, period_ns: u64) -> Budget {
        Budget {
            time: *self,
            period_ns,
        }
    }

    /// Refuses a period \[ns\] that is too short.
    ///
    /// # Errors
    /// [`Overload`] shows the arithmetic.
    pub fn check(&self, period_ns: u64) -> Result<(), Overload> {
        if self.least_period_ns() <= period_ns {
            return Ok(());
        }
        Err(Overload {
            time: *self,
            period_ns,
        })
    }
}
