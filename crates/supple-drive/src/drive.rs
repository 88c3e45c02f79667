//! What a type of drives implements.
//!
//! ```text
//! request -> collect -> (published, answered, checked) -> operate -> send_torques -> lower -> poll -> drain
//! ```
//!
//! Two shapes of a cycle fit: "request, receive, compute, send torques" (the request asks for positions and the torques go out at
//! once), and "the torque is the question" (the request sends the torques of the previous cycle, whose replies carry
//! the state; the torques given in this cycle wait for the next one).
//!
//! Start-up is not part of the trait, because each type of drives needs its own settings: it ends with a value that
//! implements the trait.

use crate::budget::Budget;
use crate::error::LoopError;
use crate::link::{Command, Drives};
use crate::loss::LossReason;
use supple_core::Vector;
use supple_core::nalgebra::Vector3;

/// What an arm does when its motors are without torque.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rest {
    /// The motors brake: the arm sinks slowly.
    Brakes,
    /// The motors are free: the arm falls. It is laid down before the motors are disabled.
    Falls,
}

/// Force on the tip with its axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TipForce {
    /// In the axes of the tip \[N\].
    Tip(Vector3<f64>),
    /// In the axes of the base \[N\].
    Base(Vector3<f64>),
}

/// Measurements of one cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading<const N: usize> {
    /// Joint angles \[rad\]; `None` if a motor that moves the joint did not reply.
    pub position_rad: [Option<f64>; N],
    /// Force on the tip; `None` without a sensor, or while its data are bad.
    pub tip_force: Option<TipForce>,
}

/// State of the drives, as last known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DriveState {
    /// Off, idle or active.
    pub drives: Drives,
    /// Frames of the previous cycle were not sent.
    pub unsent: bool,
    /// The interface is bus-off.
    pub bus_off: bool,
    /// What the drives themselves report.
    pub loss: Option<LossReason>,
}

/// Counts since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DriveCounters {
    /// Frames that the interface did not confirm.
    pub tx_lost: u64,
    /// Missing replies of motors.
    pub replies_lost: u64,
    /// Number of gaps in the received frames because they were not read in time.
    pub overruns: u64,
    /// Time for which the bus was busy \[ns\].
    pub busy_ns: u64,
}

/// Times of a period that are reserved for the drives \[ns\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reserved {
    /// Request and replies.
    pub states_ns: u64,
    /// Torques, after the controller's answer.
    pub torques_ns: u64,
}

/// How the drives end their torque.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lower {
    /// In the regular way: a safety module is asked for idle, motors without one are disabled.
    Regular,
    /// Also directly at the motors, because the regular way took too long.
    Forced,
}

/// A type of drives with its bus, ready for the cycle. Nothing in it may allocate, lock or log.
pub trait Drive<const N: usize> {
    /// Time of the drives \[ns\]: monotonic, with an arbitrary origin.
    fn now_ns(&self) -> u64;

    /// The machine's monotonic clock at a time of the drives \[ns\].
    fn monotonic_ns(&self, time_ns: u64) -> u64 {
        time_ns
    }

    /// Total time for which the drives' clock was fallen behind the monotonic clock \[ns\].
    fn clock_stall_ns(&self) -> u64 {
        0
    }

    /// What the arm does without torque.
    fn rest(&self) -> Rest;

    /// Times of a period that the drives need \[ns\].
    fn reserved(&self) -> Reserved;

    /// Frames of a period with their times on the bus.
    fn budget(&self) -> Budget;

    /// Opens a cycle: asks for the states of the motors.
    ///
    /// # Errors
    /// If the bus itself fails.
    fn request(&mut self) -> Result<(), LoopError>;

    /// Collects the replies until all are there or `until_ns`. Returns a bit mask of the motors that did not reply;
    /// zero if the request itself was not sent.
    ///
    /// # Errors
    /// If the bus itself fails.
    fn collect(&mut self, until_ns: u64) -> Result<u8, LoopError>;

    /// Measurements of this cycle.
    fn reading(&self) -> Reading<N>;

    /// State of the drives.
    fn state(&self) -> DriveState;

    /// What an operator's switch does elsewhere, once per cycle: drives without one become active if that is `allowed`, a
    /// controller in gravity hold requests torque, and no loss is latched. Returns whether they became active in this
    /// call.
    fn operate(&mut self, command: Option<&Command<N>>, allowed: bool) -> bool {
        let _ = (command, allowed);
        false
    }

    /// Sends joint torques \[N m\], with the damping that the motors add themselves \[N m s/rad\].
    ///
    /// # Errors
    /// If the bus itself fails.
    fn send_torques(
        &mut self,
        torque_nm: &Vector<N>,
        damping_nm_s_per_rad: &Vector<N>,
    ) -> Result<(), LoopError>;

    /// Ends the torque, for this reason. Called in every cycle until the drives are idle.
    ///
    /// # Errors
    /// If the bus itself fails.
    fn lower(&mut self, how: Lower, reason: LossReason) -> Result<(), LoopError>;

    /// Asks for something less urgent, if its replies fit before `next_period_ns`; `lowering` is set while the torque is
    /// being ended.
    ///
    /// # Errors
    /// If the bus itself fails.
    fn poll(&mut self, next_period_ns: u64, lowering: bool) -> Result<(), LoopError> {
        let _ = (next_period_ns, lowering);
        Ok(())
    }

    /// Ends a cycle: receives until `next_period_ns`; what was not sent by then counts as lost.
    ///
    /// # Errors
    /// If the bus itself fails.
    fn drain(&mut self, next_period_ns: u64) -> Result<(), LoopError>;

    /// Receives until `next_period_ns` in a period that is skipped.
    ///
    /// # Errors
    /// If the bus itself fails.
    fn skip(&mut self, next_period_ns: u64) -> Result<(), LoopError>;

    /// Whether any motor replied in the last cycle.
    fn motors_replied(&self) -> bool;

    /// Counts since the start.
    fn counters(&self) -> DriveCounters;
}
