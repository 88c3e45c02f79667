//! When samples may be used.

use core::fmt;
use supple_core::controller::CycleRecord;

/// Why nothing is learned at the moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Frozen {
    /// Learning is off.
    Off,
    /// A fault is latched.
    Fault,
    /// No torque: idle mode, or idle drives.
    Idle,
    /// The mode is none in which the arm moves freely by itself.
    Mode,
    /// Contact is latched, or its friction share is not yet restored.
    Contact,
    /// A torque limit or the torque-rate limit cut the command.
    Limited,
    /// A torque acts that the uncertainty of the model does not explain.
    Disturbed,
    /// No joint moves fast enough.
    Slow,
}

impl Frozen {
    /// Why the cycle of `record` must not be used; `None` if it may.
    pub fn of_cycle<const N: usize>(record: &CycleRecord<N>) -> Option<Frozen> {
        let mode = record.mode();
        if !record.learning {
            Some(Frozen::Off)
        } else if record.fault != 0 {
            Some(Frozen::Fault)
        } else if !record.drives_active {
            Some(Frozen::Idle)
        } else if !mode.is_some_and(|mode| mode.allows_learning()) {
            Some(Frozen::Mode)
        } else if record.in_contact || record.friction_share < 1.0 {
            Some(Frozen::Contact)
        } else if record.torque_limited || record.rate_limited {
            Some(Frozen::Limited)
        } else {
            None
        }
    }

    /// Short name for status lines.
    pub fn name(self) -> &'static str {
        match self {
            Frozen::Off => "off",
            Frozen::Fault => "fault",
            Frozen::Idle => "idle",
            Frozen::Mode => "mode",
            Frozen::Contact => "contact",
            Frozen::Limited => "torque limit",
            Frozen::Disturbed => "disturbed",
            Frozen::Slow => "slow",
        }
    }
}

impl fmt::Display for Frozen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
