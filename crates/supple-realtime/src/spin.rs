//! Time for which a thread polls for a message (spins) before it blocks.

use core::time::Duration;
use std::thread::available_parallelism;

/// Default on several processors: a controller on another processor typically answers within this time.
const DEFAULT_SPIN_US: u32 = 50;

/// Returns `requested_us` if given; otherwise 50 us if the calling thread may run on several processors, and zero if it may
/// run on only one. On a single processor, spinning would keep the other process from answering, unless that process has
/// the higher priority. Call this after [`crate::apply_realtime_settings`], which may bind the thread to one processor.
pub fn spin_duration(requested_us: Option<u32>) -> Duration {
    let several = available_parallelism().is_ok_and(|n| n.get() > 1);
    let default_us = if several { DEFAULT_SPIN_US } else { 0 };
    Duration::from_micros(u64::from(requested_us.unwrap_or(default_us)))
}
