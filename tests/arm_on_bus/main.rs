//! `supple-can` against the emulated arm, in one process and in virtual time: start-up, service, and every
//! injected fault to its end at the emulated motors.

mod faults;
mod link;
mod rig;
mod service;
mod start_up;
