//! How long to look for something before sleeping.

use core::time::Duration;
use std::thread::available_parallelism;

/// About as long as a controller's answer takes on another processor.
const SPIN_US: u32 = 50;

/// What was asked for \[us\]; else 50 us where the calling thread may use several processors. On one alone
/// it would keep the other process from answering, unless that one has the higher priority. To be called after
/// [`crate::enter`].
pub fn spin_for(asked_us: Option<u32>) -> Duration {
    let several = available_parallelism().is_ok_and(|n| n.get() > 1);
    let default_us = if several { SPIN_US } else { 0 };
    Duration::from_micros(u64::from(asked_us.unwrap_or(default_us)))
}
