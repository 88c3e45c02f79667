//! Options shared by the periodic processes.

use crate::settings::Settings;
use clap::Args;

/// Options of a periodic process, except the priority of its thread.
#[derive(Args, Clone, Copy, Debug)]
pub struct RealtimeOptions {
    /// Processor that the periodic thread is bound to; by default the scheduler chooses.
    #[arg(long, value_name = "N")]
    pub cpu: Option<usize>,
    /// Run without realtime priority, locked memory or processor binding.
    #[arg(long)]
    pub no_realtime: bool,
    /// End this process when the process that started it ends.
    #[arg(long, hide = true)]
    pub supervised: bool,
}

impl RealtimeOptions {
    /// Returns the realtime settings of a thread with this priority; in virtual time, or with `no_realtime`, none.
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
