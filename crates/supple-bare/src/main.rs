//! The freestanding program: no std, no allocator, no C library, its own first instruction.
//!
//! That it links proves that the core needs none of them, as no build for a host can: there, the
//! features of every crate unify and the standard library is always at hand. It prints
//! [`supple_bare::report`] and ends with 0.
#![no_std]
#![no_main]

#[cfg_attr(all(target_arch = "x86_64", target_os = "linux"), path = "linux.rs")]
#[cfg_attr(all(target_arch = "arm", target_os = "none"), path = "cortex_m.rs")]
mod system;

#[cfg(target_os = "linux")]
mod memory;

use core::fmt::Write;
use core::panic::PanicInfo;

/// Called by the first instructions, on a fresh stack.
extern "C" fn run() -> ! {
    #[cfg(feature = "negative-control")]
    allocate();
    let written = supple_bare::report(&mut system::Console);
    system::exit(written.is_ok())
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    // Nowhere left to report that the console failed.
    let _ = writeln!(system::Console, "{info}");
    system::exit(false)
}

#[cfg(feature = "negative-control")]
fn allocate() {
    extern crate alloc;
    core::hint::black_box(alloc::vec::Vec::<f64>::with_capacity(1));
}
