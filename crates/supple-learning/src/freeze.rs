//! Conditions in which the samples of a cycle must not be used.

use core::fmt;
use supple_core::controller::CycleRecord;

/// Reason why nothing is learned at the moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FreezeReason {
    /// Learning is off.
    Off,
    /// A fault is latched.
    Fault,
    /// No torque acts: idle mode, or idle drives.
    Idle,
    /// In this mode the arm does not move by itself in free space.
    Mode,
    /// Contact is latched, or the share of the friction feed-forward is not yet restored.
    Contact,
    /// A torque limit or the torque-rate limit cut the command.
    Limited,
    /// A torque acts that the uncertainty of the model does not explain.
    Disturbed,
    /// No joint moves fast enough.
    Slow,
}

impl FreezeReason {
    /// Returns the reason why the cycle of `record` must not be used; `None` if it may be used.
    pub fn of_cycle<const N: usize>(record: &CycleRecord<N>) -> Option<FreezeReason> {
        let mode = record.mode();
        if !record.learning {
            Some(FreezeReason::Off)
        } else if record.fault != 0 {
            Some(FreezeReason::Fault)
        } else if !record.drives_active {
            Some(FreezeReason::Idle)
        } else if !mode.is_some_and(|mode| mode.allows_learning()) {
            Some(FreezeReason::Mode)
        } else if record.in_contact || record.friction_share < 1.0 {
            Some(FreezeReason::Contact)
        } else if record.torque_limited || record.rate_limited {
            Some(FreezeReason::Limited)
        } else {
            None
        }
    }

    /// Returns the short name for status lines.
    pub fn name(self) -> &'static str {
        match self {
            FreezeReason::Off => "off",
            FreezeReason::Fault => "fault",
            FreezeReason::Idle => "idle",
            FreezeReason::Mode => "mode",
            FreezeReason::Contact => "contact",
            FreezeReason::Limited => "torque limit",
            FreezeReason::Disturbed => "disturbed",
            FreezeReason::Slow => "slow",
        }
    }
}

impl fmt::Display for FreezeReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
