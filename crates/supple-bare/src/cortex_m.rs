//! A bare-metal Cortex-M4 that prints through the debugger (semihosting).

use core::arch::asm;
use core::fmt;

/// Semihosting operations and exit reasons, numbered by ARM.
const WRITE_CHARACTER: usize = 0x03;
const EXIT: usize = 0x18;
const APPLICATION_EXIT: usize = 0x20026;
const RUNTIME_ERROR: usize = 0x20023;

/// # Safety
/// `argument` is the operation's argument: a value, or the address of its data.
unsafe fn call_debugger(operation: usize, argument: usize) {
    // SAFETY: the debugger reads registers and memory at `argument`, and returns in r0.
    unsafe {
        asm!(
            "bkpt #0xab",
            inlateout("r0") operation => _,
            in("r1") argument,
            options(nostack),
        );
    }
}

/// The debugger's console.
pub struct Console;

impl fmt::Write for Console {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for byte in text.bytes() {
            // SAFETY: the operation reads one byte at the address.
            unsafe { call_debugger(WRITE_CHARACTER, &raw const byte as usize) };
        }
        Ok(())
    }
}

/// Ends the emulation with 0 when `good`, else 1.
pub fn exit(good: bool) -> ! {
    let reason = if good {
        APPLICATION_EXIT
    } else {
        RUNTIME_ERROR
    };
    // SAFETY: on a 32-bit machine the reason is passed as a value.
    unsafe { call_debugger(EXIT, reason) };
    // Loops forever if the debugger lets the program continue.
    loop {
        core::hint::spin_loop();
    }
}
