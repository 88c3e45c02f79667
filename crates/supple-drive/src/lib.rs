//! The plant loop, which is the same for every type of drives.
//!
//! [`PlantLoop`] runs one cycle per period: it requests the joint angles from the drives, publishes the arm's state,
//! waits a bounded time for the controller's torques, checks them with the guards and gives them to the drives. Each type
//! of drives implements [`Drive`]: Barrett's pucks and Damiao motors on a bus, or a simulated arm. For all types, the safe
//! action after a loss is defined by one table ([`LossReason::safe_action`]) and one state machine
//! ([`SafeActionMachine`]).
//!
//! The loop communicates with the controller through a [`Link`] and depends on no protocol of drives. Time is
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
pub use drive::{
    Drive, DriveCounters, DriveState, LoweringMode, Reading, ReservedTimes, TemperatureWarning,
    TipForce, TorqueOffBehaviour,
};
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
