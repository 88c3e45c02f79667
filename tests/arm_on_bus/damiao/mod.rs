//! Tests of the drive of Damiao motors in `supple-can` with emulated motors, in virtual time.

mod faults;
mod normal_operation;
mod rig;
mod start_up;
mod wrong_zero;
