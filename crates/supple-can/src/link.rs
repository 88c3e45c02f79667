//! What the cycle says to the controller and hears from it, however it reaches it.

use crate::error::CanError;
use supple_core::Vector;
use supple_core::controller::Mode;
use supple_core::drive_guard::DriveCommand;
use supple_core::nalgebra::Vector3;

/// What the motors do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drives {
    /// No power: the emergency stop.
    Off,
    /// They brake and take no torque.
    Idle,
    /// They take torques.
    Active,
}

/// How the bus and the clock fare, since the start unless said otherwise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counters {
    /// Cycles begun.
    pub cycles: u64,
    /// Cycles with active motors whose answer did not come in time.
    pub missed: u64,
    /// Answers that came after their cycle.
    pub late_answers: u64,
    /// Answers that counted as none, because a torque of them was not finite.
    pub unusable: u64,
    /// Periods that were passed over because a cycle began too late.
    pub skipped: u64,
    /// Frames that were not seen to leave.
    pub tx_lost: u64,
    /// Position replies that did not come.
    pub replies_lost: u64,
    /// Times that received frames were lost because they were not read in time.
    pub overruns: u64,
    /// By how much this cycle began late \[ns\].
    pub wake_ns: u64,
    /// From publishing the state of the previous cycle to its answer \[ns\]; zero where none came.
    pub round_trip_ns: u64,
    /// Share of the previous cycle in which the bus was busy, 0 to 1.
    pub bus_load: f64,
    /// How long the bus's time has stood still \[ns\], see [`supple_bus::Bus::stood_still_ns`].
    pub stood_still_ns: u64,
}

/// The arm at the start of a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmReport<const N: usize> {
    /// Number of the cycle, one more each period.
    pub cycle: u64,
    /// When positions were asked for, by the machine's monotonic clock, or in virtual time \[ns\].
    pub stamp_ns: u64,
    /// Joint angles \[rad\]; `None` where a motor that moves the joint did not reply.
    pub position_rad: [Option<f64>; N],
    /// Force on the tip, base axes \[N\]; `None` without a sensor, or while its data are bad.
    pub tip_force_n: Option<Vector3<f64>>,
    /// What the motors do.
    pub drives: Drives,
    /// How it fares.
    pub counters: Counters,
}

impl<const N: usize> Command<N> {
    /// Every torque of it is finite.
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
    /// Joint torques to send while no answer comes \[N m\].
    pub fallback_torque_nm: Vector<N>,
    /// The torques are meant. Otherwise the motors are to be lowered to idle.
    pub wants_torque: bool,
    /// The controller's mode, where it is known.
    pub mode: Option<Mode>,
    /// The controller is in a fault.
    pub fault: bool,
}

impl<const N: usize> Command<N> {
    /// What the drives' guard judges.
    pub(crate) fn drive(&self) -> DriveCommand<N> {
        DriveCommand {
            torque_nm: self.torque_nm,
            mode: self.mode,
            fault: self.fault,
        }
    }
}

/// What came back within the time given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer<const N: usize> {
    /// The answer to this cycle.
    pub command: Option<Command<N>>,
    /// Answers to earlier cycles that came only now.
    pub late: u64,
}

/// The way to the controller.
pub trait Link<const N: usize> {
    /// Tells the controller that it will soon be told about the arm, where that is of use to it.
    ///
    /// # Errors
    /// Where the way is broken, not where the controller is missing.
    fn announce(&mut self) -> Result<(), CanError>;

    /// Tells the controller about the arm.
    ///
    /// # Errors
    /// Where the way is broken, not where the controller is missing.
    fn publish(&mut self, report: &ArmReport<N>) -> Result<(), CanError>;

    /// Waits for the answer to a cycle, at most for `wait_ns`; in virtual time no time of the bus passes
    /// meanwhile.
    ///
    /// # Errors
    /// Where the way is broken, not where the controller is missing.
    fn answer(&mut self, cycle: u64, wait_ns: u64) -> Result<Answer<N>, CanError>;
}
