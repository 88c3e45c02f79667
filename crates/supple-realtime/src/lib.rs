//! Linux services for periodic processes: locked memory, realtime priority, CPU affinity, clock and sleeps, owner-only
//! folders, shutdown signals, background threads for disk and terminal output, and watchdog messages to the service
//! manager.
//!
//! Realtime settings affect the timing of a process, never its results. A setting that the system refuses is reported as a
//! [`RealtimeWarning`], and the process continues. This crate depends on no arm and no controller.

mod background;
mod clock;
pub mod diagnostics;
mod heartbeat;
mod memory;
mod notify;
mod options;
mod pause;
mod private_folder;
mod processor;
mod schedule;
mod settings;
mod spin;
mod stop;
mod supported;

pub use settings::Settings;

pub use background::BackgroundWriter;
pub use clock::{monotonic_ns, since_epoch_ns, sleep_until_ns};
pub use heartbeat::{Heartbeat, LivenessCounter, LivenessMonitor};
pub use notify::{ManagerVariables, Notifier, NotifyError};
pub use options::RealtimeOptions;
pub use pause::pause;
pub use private_folder::{
    PrivateFolderError, create_private_folder, open_private_folder, runtime_folder,
};
pub use processor::run_on_supported_processor;
pub use schedule::{allowed_processors, bind_process};
pub use spin::spin_duration;
pub use stop::{Stop, StopError, die_with_parent, ignore_file_size_and_tty_signals};
pub use supported::{forget_support, listen_for_support, support_is_declared};

use std::io::Error;

/// Warning: the system refused a realtime setting. The thread runs, but may be late.
#[derive(Debug, thiserror::Error)]
pub enum RealtimeWarning {
    /// Memory may be paged out.
    #[error(
        "memory is not locked ({0}): give the user a memlock limit of unlimited in \
         /etc/security/limits.d, or LimitMEMLOCK=infinity to the service"
    )]
    Memory(Error),
    /// Other threads may preempt this one.
    #[error(
        "no realtime priority {priority} ({error}): give the user an rtprio limit of at least {priority} \
         in /etc/security/limits.d, or LimitRTPRIO={priority} to the service"
    )]
    Priority {
        /// Requested value.
        priority: u8,
        /// Error of the system.
        error: Error,
    },
    /// The scheduler may migrate the thread between processors.
    #[error(
        "not bound to processor {cpu} ({error}): choose a processor that exists, numbered from 0 to one less than `nproc` prints"
    )]
    Cpu {
        /// Requested value.
        cpu: usize,
        /// Error of the system.
        error: Error,
    },
}

/// Applies realtime settings to the calling thread, as far as the system allows. Call it after all allocation: memory
/// mapped later is locked on allocation, which may fail.
pub fn apply_realtime_settings(settings: &Settings) -> Vec<RealtimeWarning> {
    let mut warnings = Vec::new();
    if settings.lock_memory
        && let Err(error) = memory::lock()
    {
        warnings.push(RealtimeWarning::Memory(error));
    }
    if let Some(cpu) = settings.cpu
        && let Err(error) = schedule::bind(cpu)
    {
        warnings.push(RealtimeWarning::Cpu { cpu, error });
    }
    if let Some(priority) = settings.priority
        && let Err(error) = schedule::set_sched_fifo(priority)
    {
        warnings.push(RealtimeWarning::Priority { priority, error });
    }
    warnings
}
