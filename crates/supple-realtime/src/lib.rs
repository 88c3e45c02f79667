//! What a thread needs from Linux to keep a period: memory that stays, a place before other threads, a
//! processor of its own, a clock, a word when to end, somebody else who waits for disks and terminals, and signs of
//! life for the service manager.
//!
//! Nothing here is needed for a right answer, only for a timely one: what the system does not grant is
//! reported as a [`Shortfall`] and the process goes on. It knows no arm and no controller.

mod background;
mod clock;
pub mod diagnostics;
mod heartbeat;
mod memory;
mod notify;
mod options;
mod schedule;
mod spin;
mod stop;

pub use background::BackgroundWriter;
pub use clock::{monotonic_ns, sleep_until_ns};
pub use heartbeat::{Heartbeat, Pulse, Watch};
pub use notify::{ManagerVariables, Notifier, NotifyError};
pub use options::RealtimeOptions;
pub use spin::spin_for;
pub use stop::{Stop, StopError, die_with_parent, keep_running};

use std::io::Error;

/// What to ask of the system.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Priority of the calling thread under SCHED_FIFO, 1 to 99; `None` leaves it as it is.
    pub priority: Option<u8>,
    /// Processor for the calling thread alone; `None` leaves it to the scheduler.
    pub cpu: Option<usize>,
    /// Keep all memory of the process, present and future, and fault the stack in.
    pub lock_memory: bool,
}

impl Settings {
    /// Nothing: virtual time needs none of it.
    pub const NONE: Settings = Settings {
        priority: None,
        cpu: None,
        lock_memory: false,
    };
}

/// Something that the system does not grant: the thread runs, and may be late.
#[derive(Debug, thiserror::Error)]
pub enum Shortfall {
    /// Memory may be paged out.
    #[error(
        "memory is not locked ({0}): give the user a memlock limit of unlimited in \
         /etc/security/limits.d, or LimitMEMLOCK=infinity to the service"
    )]
    Memory(Error),
    /// Other threads may come first.
    #[error(
        "no realtime priority {priority} ({error}): give the user an rtprio limit of at least {priority} \
         in /etc/security/limits.d, or LimitRTPRIO={priority} to the service"
    )]
    Priority {
        /// Asked for.
        priority: u8,
        /// What the system says.
        error: Error,
    },
    /// The scheduler may move the thread about.
    #[error("not bound to processor {cpu} ({error}): choose one that is there, see nproc")]
    Cpu {
        /// Asked for.
        cpu: usize,
        /// What the system says.
        error: Error,
    },
}

/// Makes the calling thread a realtime one as far as the system lets it. To be called when everything is
/// set up: what is mapped later is locked as it comes, and may be refused.
pub fn enter(settings: &Settings) -> Vec<Shortfall> {
    let mut shortfalls = Vec::new();
    if settings.lock_memory
        && let Err(error) = memory::lock()
    {
        shortfalls.push(Shortfall::Memory(error));
    }
    if let Some(cpu) = settings.cpu
        && let Err(error) = schedule::bind(cpu)
    {
        shortfalls.push(Shortfall::Cpu { cpu, error });
    }
    if let Some(priority) = settings.priority
        && let Err(error) = schedule::first_in_first_out(priority)
    {
        shortfalls.push(Shortfall::Priority { priority, error });
    }
    shortfalls
}
