//! Realtime settings of a thread.

/// Realtime settings of a thread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Priority of the calling thread under SCHED_FIFO, 1 to 99; `None` leaves it as it is.
    pub priority: Option<u8>,
    /// Processor to bind the calling thread to; `None` leaves it to the scheduler.
    pub cpu: Option<usize>,
    /// Whether to lock all present and future memory of the process and prefault the stack.
    pub lock_memory: bool,
}

impl Settings {
    /// No settings, for virtual time.
    pub const NONE: Settings = Settings {
        priority: None,
        cpu: None,
        lock_memory: false,
    };
}
