//! Tests of `supple-can` with the emulated arm, in one process and in virtual time: start-up, normal operation, and the effect
//! of every injected fault on the emulated motors.

mod damiao;
mod faults;
mod link;
mod normal_operation;
mod rig;
mod start_up;
