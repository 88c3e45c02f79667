//! Entry point on Linux on x86-64.

use core::arch::naked_asm;

/// Entry point of the program. The kernel aligns the stack to 16 bytes, as a call expects.
#[unsafe(no_mangle)]
#[unsafe(naked)]
extern "C" fn _start() -> ! {
    naked_asm!("xor ebp, ebp", "call {run}", "ud2", run = sym super::run)
}
