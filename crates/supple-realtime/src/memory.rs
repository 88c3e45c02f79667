//! Memory that is there when it is needed.

use rustix::mm::{MlockAllFlags, mlockall};
use std::hint::black_box;
use std::io::Error;

/// Stack that a control cycle never exceeds, faulted in once.
const STACK_BYTES: usize = 256 * 1024;

/// Keeps all present and future memory, lets the allocator give none back, and faults the stack in.
pub fn lock() -> Result<(), Error> {
    keep_heap();
    mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE)?;
    fault_stack_in();
    Ok(())
}

/// Freed memory stays with the process, and large blocks come from the heap: neither faults again.
#[cfg(target_env = "gnu")]
fn keep_heap() {
    // SAFETY: sets two parameters of the allocator to values that its manual allows.
    unsafe {
        libc::mallopt(libc::M_TRIM_THRESHOLD, -1);
        libc::mallopt(libc::M_MMAP_MAX, 0);
    }
}

#[cfg(not(target_env = "gnu"))]
fn keep_heap() {}

#[inline(never)]
fn fault_stack_in() {
    let stack = [1_u8; STACK_BYTES];
    black_box(&stack);
}
