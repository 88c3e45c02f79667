//! The plant loop: what every drive of an arm has in common.
//!
//! [`PlantLoop`] runs one cycle per period: it asks the drives for the joint angles, publishes the arm's state, waits
//! a bounded time for the controller's torques, passes them through the guards and hands them to the drives. A make
//! of drives is one implementation of [`Drive`]: Barrett's pucks and Damiao motors on a bus, or a simulated arm. What
//! happens after a loss is one table for all of them ([`LossReason::safe_action`]) and one state machine
//! ([`SafeActionMachine`]).
//!
//! The loop does not depend on the controller, which it reaches through a [`Link`], and has no protocol. Time is
//! the drives' time ([`Drive::now_ns`]): the same code runs on a CAN card, on an emulator, and in virtual time. A
//! cycle allocates no memory, takes no lock and writes no log.

#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod budget;
mod drive;
mod error;
mod guard;
mod hold_check;
mod link;
mod loss;
mod plant_loop;
mod port;
mod shared_memory;
mod stow;
mod unconfirmed;

pub use budget::{Budget, BudgetLine, Overload, SPARE_SHARE};
pub use drive::{Drive, DriveCounters, DriveState, Lower, Reading, Reserved, Rest, TipForce};
pub use error::LoopError;
pub use guard::{
    ANSWER_TIMEOUT_NS, Action, FALLBACK_NS, GuardInput, SafeActionMachine, Stage, Torque,
};
pub use link::{Answer, ArmReport, Command, Counters, Drives, Link};
pub use loss::{LossReason, MotorFault, SafeAction};
pub use plant_loop::{CycleConfig, PlantLoop};
pub use port::{BusPort, Received};
pub use shared_memory::SharedMemoryLink;
pub use stow::{StowConfig, Stowing};
