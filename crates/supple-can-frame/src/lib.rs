//! Frames of classic CAN and CAN FD, and their durations on the bus.
//!
//! [`CanFrame`] holds any data frame of either format; [`timing`] counts its bits, exactly from its content or as bounds from
//! its payload length, and [`BitRates`] converts them to a duration. This crate has no vendor's protocol and accesses no bus.
//! Remote frames are not supported: no supported arm uses them.
//!
//! ```
//! use supple_can_frame::{BitRates, CanFrame, CanId};
//!
//! let command = CanFrame::new(CanId::standard(0x001)?, &[0xff; 8])?;
//! let poll = CanFrame::fd(CanId::extended(0x8001)?, true, &[0x50; 48])?;
//! assert!(BitRates::CLASSIC_1M.duration_ns(&command) <= 135_000);
//! assert!(BitRates::FD_1M_5M.duration_ns(&poll) < 160_000);
//! # Ok::<(), supple_can_frame::FrameError>(())
//! ```
#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod frame;
mod id;
mod rates;
pub mod timing;

pub use frame::{CanFrame, FrameError, FrameFormat, MAX_CLASSIC_BYTES, MAX_FD_BYTES};
pub use id::{CanId, CanIdError};
pub use rates::BitRates;
