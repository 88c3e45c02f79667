//! From logs of a moving arm to a model that a body could have.
//!
//! ```
//! use supple_ident::{DMatrix, Log, Procedure, identify};
//! use supple_model::Description;
//!
//! # fn model(log: Log) -> Result<(), Box<dyn std::error::Error>> {
//! let description = Description::asset("wam4")?;
//! let fit = identify(&description.arm::<4>()?, &[log], &Procedure::default())?;
//! println!("rank {}, condition {:.0}", fit.rank(), fit.condition());
//! fit.save(&description, std::path::Path::new("identified"))?;
//! # Ok(())
//! # }
//! ```
//!
//! Nothing here runs while an arm moves: it allocates, iterates and takes its time.
#![forbid(unsafe_code)]

pub mod base;
pub mod columns;
pub mod compress;
pub mod consistent;
pub mod design;
mod dip;
mod error;
pub mod estimate;
pub mod filter;
pub mod fit;
pub mod learn;
mod log;
pub mod model;
mod motion;
pub mod paper;
pub mod payload;
mod procedure;
mod random;
mod read;
pub mod regressor;
pub mod ripple;
mod save;
pub mod select;
mod series;
pub mod validate;

pub use base::Base;
pub use columns::{Columns, FrictionColumns};
pub use dip::fit_with_dip;
pub use error::{IdentError, Warning};
pub use fit::{Fit, Options, Weights, fit};
pub use learn::{Learned, Learning, learn};
pub use log::Log;
pub use motion::{Motion, Preparation, resample};
pub use nalgebra::{DMatrix, DVector};
pub use procedure::{Choice, FrictionChoice, Method, Procedure, identify, identify_motions};
pub use read::{ReadError, read_csv, read_logs, read_mcap};
pub use ripple::{RippleSearch, fit_ripple};
pub use save::SaveError;
pub use series::SeriesLists;
pub use validate::Validation;
