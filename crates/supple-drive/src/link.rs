//! Interface between the plant loop and the controller, for any transport.

use crate::error::LoopError;
use supple_core::Vector;
use supple_core::controller::Mode;
use supple_core::drive_guard::DriveCommand;
use supple_core::nalgebra::Vector3;

/// State of the drives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drives {
    /// The motors have no power (emergency stop), or none of them replies.
    Off,
    /// The motors ignore torques, and brake if they can.
    Idle,
    /// The motors apply torques.
    Active,
    /// The motors apply torques of the plant loop, which holds an arm that falls without torque, or lays it down. The
    /// controller's torques are not applied.
    Held,
}

/// Counters and timing of the loop, since the start unless stated otherwise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counters {
    /// Cycles started.
    pub cycles: u64,
    /// Cycles with active motors whose answer did not arrive in time.
    pub missed: u64,
    /// Answers that arrived after their cycle.
    pub late_answers: u64,
    /// Answers that were discarded because a torque was not finite.
    pub unusable: u64,
    /// Periods that were skipped because a cycle started too late.
    pub skipped: u64,
    /// Frames that the interface did not confirm.
    pub tx_lost: u64,
    /// Missing replies of motors.
    pub replies_lost: u64,
    /// Number of gaps in the received frames because they were not read in time.
    pub overruns: u64,
    /// Delay of the start of this cycle \[ns\].
    pub wake_ns: u64,
    /// Time from publishing the state of the previous cycle to its answer \[ns\]; zero without an answer.
    pub round_trip_ns: u64,
    /// Fraction of the previous cycle in which the bus was busy, 0 to 1.
    pub bus_load: f64,
    /// Total time for which bus time was paused \[ns\], see [`crate::Drive::clock_stall_ns`].
    pub clock_stall_ns: u64,
}

/// The arm at the start of a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmReport<const N: usize> {
    /// Cycle number, incremented every period.
    pub cycle: u64,
    /// Time of the request for the angles, by the machine's monotonic clock or in virtual time \[ns\].
    pub stamp_ns: u64,
    /// Joint angles \[rad\]; `None` if a motor that moves the joint did not reply.
    pub position_rad: [Option<f64>; N],
    /// Force on the tip, base axes \[N\]; `None` without a sensor, or while its data are bad.
    pub tip_force_n: Option<Vector3<f64>>,
    /// State of the drives.
    pub drives: Drives,
    /// Counters of the cycle.
    pub counters: Counters,
}

impl<const N: usize> Command<N> {
    /// Whether every torque is finite.
    pub fn is_finite(&self) -> bool {
        let mut torques = self.torque_nm.iter().chain(&self.fallback_torque_nm);
        torques.all(|torque_nm| torque_nm.is_finite())
    }
}

/// The controller's answer to a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command<const N: usize> {
    /// Joint torques \[N m\].
    pub torque_nm: Vector<N>,
    /// Joint torques to send while answers are missing \[N m\].
    pub fallback_torque_nm: Vector<N>,
    /// Whether to apply the torques; otherwise the motors are set to idle.
    pub wants_torque: bool,
    /// The controller's mode, if known.
    pub mode: Option<Mode>,
    /// Whether the controller is in a fault.
    pub fault: bool,
    /// Codes of mode and fault in the message of the controller, for a trace.
    pub codes: [u8; 2],
}

impl<const N: usize> Command<N> {
    /// Input of the drive guard.
    pub(crate) fn drive(&self) -> DriveCommand<N> {
        DriveCommand {
            torque_nm: self.torque_nm,
            mode: self.mode,
            fault: self.fault,
        }
    }
}

/// Result of waiting for an answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer<const N: usize> {
    /// The answer to this cycle, if it arrived in time.
    pub command: Option<Command<N>>,
    /// Number of answers to earlier cycles, which are discarded.
    pub late: u64,
}

/// Link to the controller.
pub trait Link<const N: usize> {
    /// Announces to the controller that a report follows soon; a transport may ignore it.
    ///
    /// # Errors
    /// If the transport fails. A missing controller is not an error.
    fn announce(&mut self) -> Result<(), LoopError>;

    /// Sends the report to the controller.
    ///
    /// # Errors
    /// If the transport fails. A missing controller is not an error.
    fn publish(&mut self, report: &ArmReport<N>) -> Result<(), LoopError>;

    /// Waits for the answer to a cycle, for at most `wait_ns`. In virtual time, bus time does not advance during the wait.
    ///
    /// # Errors
    /// If the transport fails. A missing controller is not an error.
    fn answer(&mut self, cycle: u64, wait_ns: u64) -> Result<Answer<N>, LoopError>;
}
