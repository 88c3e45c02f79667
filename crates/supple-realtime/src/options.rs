//! Options shared by the periodic processes.

use crate::settings::Settings;
use clap::Args;

/// Options of a periodic process, except the priority of its thread.
#[derive(Args, Clone, Copy, Debug)]
pub struct RealtimeOptions {
    /// Processor to bind the periodic thread to; any if not given.
    #[arg(long, value_name = "N")]
    pub cpu: Option<usize>,
    /// Neither priority nor locked memory.
    #[arg(long)]
    pub no_realtime: bool,
    /// Ends when the process that started it ends.
    #[arg(long, hide = true)]
    pub supervised: bool,
}

impl RealtimeOptions {
    /// Realtime settings for a thread of this priority; none in virtual time.
    pub fn settings(&self, priority: u8, virtual_time: bool) -> Settings {
        if virtual_time || self.no_realtime {
            return Settings::NONE;
        }
        Settings {
            priority: Some(priority),
            cpu: self.cpu,
            lock_memory: true,
        }
    }
}
