//! Spin time before a thread blocks.

use core::time::Duration;
use std::thread::available_parallelism;

/// Typical time for the answer of a controller on another processor.
const SPIN_US: u32 = 50;

/// `requested_us` if given; else 50 us if the calling thread may use several processors, otherwise zero. On a single
/// processor spinning would keep the other process from answering, unless that process has the higher priority. Call it
/// after [`crate::apply_realtime_settings`].
pub fn spin_duration(requested_us: Option<u32>) -> Duration {
    let several = available_parallelism().is_ok_and(|n| n.get() > 1);
    let default_us = if several { SPIN_US } else { 0 };
    Duration::from_micros(u64::from(requested_us.unwrap_or(default_us)))
}
