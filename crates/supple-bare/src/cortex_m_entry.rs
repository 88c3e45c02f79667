//! Vector table and reset of a Cortex-M4.

use core::arch::global_asm;

// Vector table (stack, reset, every exception a fault) and reset: the floating-point unit is off at
// power-on and must be switched on before the first compiled instruction.
global_asm!(
    ".section .vector_table, \"a\", %progbits",
    ".word _stack_top",
    ".word reset",
    ".rept 14",
    ".word {fault}",
    ".endr",
    ".section .text.reset, \"ax\", %progbits",
    ".global reset",
    ".type reset, %function",
    ".thumb_func",
    "reset:",
    "movw r0, #0xed88",
    "movt r0, #0xe000",
    "ldr r1, [r0]",
    "orr r1, r1, #0xf00000",
    "str r1, [r0]",
    "dsb",
    "isb",
    "bl {run}",
    "udf #0",
    ".size reset, . - reset",
    run = sym super::run,
    fault = sym fault,
);

extern "C" fn fault() -> ! {
    super::system::exit(false)
}
