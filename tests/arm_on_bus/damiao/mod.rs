//! Arms of Damiao motors: the driver of `supple-can` (its `Drive`) against emulated motors, in virtual time.

mod faults;
mod normal_operation;
mod rig;
mod start_up;
mod wrong_zero;
