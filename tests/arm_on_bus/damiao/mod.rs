//! Arms of Damiao motors: the drive of `supple-can` against the emulated motors, in virtual time.

mod faults;
mod regular;
mod rig;
mod start_up;
mod wrong_zero;
