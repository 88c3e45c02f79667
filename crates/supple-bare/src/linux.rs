//! Standard output and exit on Linux for x86-64, by system calls without a C library.

use core::arch::asm;
use core::fmt;

const WRITE: usize = 1;
const EXIT_GROUP: usize = 231;
const STANDARD_OUTPUT: usize = 1;

/// Standard output.
pub struct Console;

impl fmt::Write for Console {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let mut rest = text.as_bytes();
        while !rest.is_empty() {
            let written: isize;
            // SAFETY: `write` reads `rest.len()` bytes at `rest`, which the slice guarantees; the
            // kernel clobbers rax, rcx and r11 only.
            unsafe {
                asm!(
                    "syscall",
                    inlateout("rax") WRITE => written,
                    in("rdi") STANDARD_OUTPUT,
                    in("rsi") rest.as_ptr(),
                    in("rdx") rest.len(),
                    lateout("rcx") _,
                    lateout("r11") _,
                    options(nostack),
                );
            }
            let written = usize::try_from(written).map_err(|_| fmt::Error)?;
            rest = rest.get(written..).ok_or(fmt::Error)?;
        }
        Ok(())
    }
}

/// Ends the process with 0 when `good`, else 1.
pub fn exit(good: bool) -> ! {
    // SAFETY: `exit_group` takes a number and does not return.
    unsafe {
        asm!(
            "syscall",
            in("rax") EXIT_GROUP,
            in("rdi") usize::from(!good),
            options(noreturn, nostack),
        );
    }
}
