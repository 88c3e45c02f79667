//! Refines a controller's model while the arm moves.
//!
//! A [`Learner`] is given the record of every control cycle. It compares the commanded torque with the torque that the
//! model needs for the measured motion, and estimates what explains the difference: friction, payload, base tilt, torque
//! offsets, torque constants, and a smooth map of the rest over each joint's angle and direction of motion
//! ([`supple_core::learned`]). It returns its estimates as requests to the controller, each for a given cycle. It reads
//! no clock and no file: the same records give the same requests, bit for bit.
//!
//! The tracking error is not used: at low gains, adapting to it makes tracking worse.
//!
//! **Prediction error** ([`rows`]). Torque and model pass the same filters, in the form of the generalised momentum,
//! so that no acceleration is differentiated.
//! **Estimate** ([`solve`]). Recursive least squares with a Gaussian prior around the model and with forgetting: a parameter that
//! the motion does not excite keeps the model's value. The samples of a joint count once both directions of its motion are among
//! them, or once it has crept on in one. Each number stays within its bounds, [`supple_core::learned::LearnedBounds`].
//! **Freeze** ([`FreezeReason`]). Contact, faults, idle drives, torque limits, modes in which people push, and torques that
//! the present uncertainty does not explain. Samples are used only if none of these follows within half a second.

#![forbid(unsafe_code)]

mod freeze;
mod gate;
mod information;
mod learner;
mod prior;
mod report;
pub mod rows;
pub mod solve;
mod travel;

pub use freeze::FreezeReason;
pub use learner::{Learner, Scheduled, requests_in_flight};
pub use prior::{Prior, unknowns};
pub use report::Report;
