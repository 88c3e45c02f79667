//! From logs of a moving arm to a model that a body could have.
//!
//! Nothing here runs while an arm moves: it allocates, iterates and takes its time.
#![forbid(unsafe_code)]

pub mod base;
pub mod columns;
pub mod compress;
pub mod consistent;
mod error;
pub mod estimate;
pub mod filter;
pub mod fit;
mod log;
pub mod model;
mod motion;
pub mod paper;
pub mod regressor;
pub mod select;
pub mod validate;

pub use base::Base;
pub use columns::{Columns, FrictionColumns};
pub use error::{IdentError, Warning};
pub use fit::{Fit, Options, Weights, identify};
pub use log::Log;
pub use motion::{Motion, Preparation, resample};
pub use nalgebra::{DMatrix, DVector};
pub use validate::Validation;
