//! The trait [`Drive`], which each type of drives implements.
//!
//! ```text
//! request -> collect -> (published, answered, checked) -> operate -> send_torques -> lower -> poll -> drain
//! ```
//!
//! The trait supports two kinds of cycle. In the first, the request asks for positions, and the torques computed from them
//! are sent in the same cycle. In the second, the request is the torque commands of the previous cycle, and the replies to
//! them carry the state; the torques computed in this cycle are sent in the next one.
//!
//! Start-up is not part of the trait, because each type of drives needs its own settings. Start-up returns a value that
//! implements the trait.

use crate::budget::Budget;
use crate::error::LoopError;
use crate::link::{Command, Drives};
use crate::loss::LossReason;
use supple_core::Vector;
use supple_core::nalgebra::Vector3;

/// Behaviour of an arm whose motors apply no torque.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TorqueOffBehaviour {
    /// The motors brake: the arm sinks slowly.
    Brakes,
    /// The motors are free: the arm falls. It is laid down before the motors are disabled.
    Falls,
}

/// Force on the tip, with the axes in which it is given.
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
    /// Whether frames of the previous cycle were not sent.
    pub unsent: bool,
    /// Whether the CAN interface is bus-off.
    pub bus_off: bool,
    /// Loss that the drives report.
    pub loss: Option<LossReason>,
}

/// Motor that is hotter than its warning limit, but not yet at the limit of a fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TemperatureWarning {
    /// Temperature \[degrees Celsius\].
    pub celsius: u8,
    /// Fraction of the torque limit that the motor still has, 0 to 1.
    pub torque_share: f64,
}

/// Counters since the start.
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
pub struct ReservedTimes {
    /// Time of the request and the replies.
    pub states_ns: u64,
    /// Time of the torques, after the controller's answer.
    pub torques_ns: u64,
}

/// Way in which the drives end their torque.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LoweringMode {
    /// The safety module is set to idle; without a safety module, the motors are disabled.
    Regular,
    /// The motors are also set to idle directly, because the regular way took too long.
    Forced,
}

/// Drives of one type, with their bus, after start-up. An implementation may not allocate memory, take locks or write logs.
pub trait Drive<const N: usize> {
    /// Time of the drives \[ns\]: monotonic, with an arbitrary origin.
    fn now_ns(&self) -> u64;

    /// Converts a time of the drives to the machine's monotonic clock \[ns\].
    fn monotonic_ns(&self, time_ns: u64) -> u64 {
        time_ns
    }

    /// Total time for which the clock of the drives was paused relative to the monotonic clock \[ns\].
    fn clock_stall_ns(&self) -> u64 {
        0
    }

    /// Returns what the arm does without torque.
    fn torque_off_behaviour(&self) -> TorqueOffBehaviour;

    /// Times of a period that the drives need \[ns\].
    fn reserved(&self) -> ReservedTimes;

    /// Frames of a period with their times on the bus.
    fn budget(&self) -> Budget;

    /// Begins a cycle: requests the states of the motors.
    ///
    /// # Errors
    /// If the bus itself fails.
    fn request(&mut self) -> Result<(), LoopError>;

    /// Receives the replies until all have arrived or `until_ns` is reached. Returns a bit mask of the motors that did not reply;
    /// zero if the request itself was not sent.
    ///
    /// # Errors
    /// If the bus itself fails.
    fn collect(&mut self, until_ns: u64) -> Result<u8, LoopError>;

    /// Measurements of this cycle.
    fn reading(&self) -> Reading<N>;

    /// State of the drives.
    fn state(&self) -> DriveState;

    /// Returns the warning of a motor that is above its warning limit, but not at the limit of a fault.
    fn temperature_warning(&self, motor: usize) -> Option<TemperatureWarning> {
        let _ = motor;
        None
    }

    /// Activates drives that have no operator's switch, once per cycle. They become active if this is `allowed`, a controller
    /// in gravity hold requests torque, and no loss is latched. Returns whether they became active in this call.
    fn operate(&mut self, command: Option<&Command<N>>, allowed: bool) -> bool {
        let _ = (command, allowed);
        false
    }

    /// Sends joint torques \[N m\], and the damping that the motors add themselves \[N m s/rad\].
    ///
    /// # Errors
    /// If the bus itself fails.
    fn send_torques(
        &mut self,
        torque_nm: &Vector<N>,
        damping_nm_s_per_rad: &Vector<N>,
    ) -> Result<(), LoopError>;

    /// Ends the torque, for this reason. The plant loop calls it in every cycle until the drives are idle.
    ///
    /// # Errors
    /// If the bus itself fails.
    fn lower(&mut self, how: LoweringMode, reason: LossReason) -> Result<(), LoopError>;

    /// Sends an auxiliary poll, if its replies fit before `next_period_ns`; `lowering` is set while the torque is being
    /// ended.
    ///
    /// # Errors
    /// If the bus itself fails.
    fn poll(&mut self, next_period_ns: u64, lowering: bool) -> Result<(), LoopError> {
        let _ = (next_period_ns, lowering);
        Ok(())
    }

    /// Ends a cycle: receives until `next_period_ns`; a frame that was not sent by then counts as lost.
    ///
    /// # Errors
    /// If the bus itself fails.
    fn drain(&mut self, next_period_ns: u64) -> Result<(), LoopError>;

    /// Receives until `next_period_ns`, the start of the period after those that are skipped; with a simulated arm, moves it by
    /// `periods`.
    ///
    /// # Errors
    /// If the bus itself fails.
    fn skip(&mut self, periods: u64, next_period_ns: u64) -> Result<(), LoopError>;

    /// Whether any motor replied in the last cycle.
    fn motors_replied(&self) -> bool;

    /// Counts since the start.
    fn counters(&self) -> DriveCounters;
}
