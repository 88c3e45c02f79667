//! Locks and prefaults memory.

use rustix::mm::{MlockAllFlags, mlockall};
use std::hint::black_box;
use std::io::Error;

/// Size of the stack that is prefaulted \[bytes\]; a control cycle never uses more.
const STACK_BYTES: usize = 256 * 1024;

/// Locks all present and future memory, disables heap trimming, and prefaults the stack.
pub fn lock() -> Result<(), Error> {
    disable_heap_trim();
    mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE)?;
    prefault_stack();
    Ok(())
}

/// Disables heap trimming and mmap for large blocks, so that reused memory causes no page faults.
#[cfg(target_env = "gnu")]
fn disable_heap_trim() {
    // SAFETY: sets two parameters of the allocator to values that its manual allows.
    unsafe {
        libc::mallopt(libc::M_TRIM_THRESHOLD, -1);
        libc::mallopt(libc::M_MMAP_MAX, 0);
    }
}

#[cfg(not(target_env = "gnu"))]
fn disable_heap_trim() {}

#[inline(never)]
fn prefault_stack() {
    let stack = [1_u8; STACK_BYTES];
    black_box(&stack);
}
