//! The freestanding program: no std, no allocator, no C library, its own entry point.
//!
//! Successful linking proves that the core needs none of them. A hosted build cannot prove this,
//! because cargo unifies features and the standard library is always available. It prints
//! [`supple_bare::report`] and ends with 0.
#![no_std]
#![no_main]

#[cfg_attr(all(target_arch = "x86_64", target_os = "linux"), path = "linux.rs")]
#[cfg_attr(all(target_arch = "arm", target_os = "none"), path = "cortex_m.rs")]
mod system;

#[cfg_attr(
    all(target_arch = "x86_64", target_os = "linux"),
    path = "linux_entry.rs"
)]
#[cfg_attr(
    all(target_arch = "arm", target_os = "none"),
    path = "cortex_m_entry.rs"
)]
mod entry;

#[cfg(target_os = "linux")]
mod memory;

use core::fmt::Write;
use core::panic::PanicInfo;

/// Called by the entry point, on a fresh stack.
extern "C" fn run() -> ! {
    #[cfg(feature = "negative-control")]
    allocate();
    let written = supple_bare::report(&mut system::Console);
    system::exit(written.is_ok())
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    // If the console fails, there is no other way to report it.
    let _ = writeln!(system::Console, "{info}");
    system::exit(false)
}

#[cfg(feature = "negative-control")]
fn allocate() {
    extern crate alloc;
    core::hint::black_box(alloc::vec::Vec::<f64>::with_capacity(1));
}
