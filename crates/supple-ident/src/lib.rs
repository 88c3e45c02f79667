//! Identification of physically consistent arm models from logs.
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
//! Offline only: allocates, iterates and has no time bound.
#![forbid(unsafe_code)]

pub mod base_parameters;
mod cancellation;
pub mod columns;
pub mod constrained_least_squares;
mod delay;
mod effect_rows;
pub mod effects;
mod error;
pub mod estimate;
pub mod excitation_design;
mod feedforward;
pub mod filter;
pub mod fit;
mod fit_stage;
mod fourier_coefficients;
mod joint_rows;
pub mod learn;
mod log;
pub mod log_checks;
pub mod model;
mod motion;
mod options;
pub mod paper_estimator;
pub mod payload;
mod presliding;
mod prior_rows;
mod procedure;
pub mod qr_reduction;
mod random;
mod read;
pub mod regressor;
pub mod ripple;
mod save;
pub mod select;
mod selection_result;
mod slow_motion;
mod spikes;
mod stribeck;
pub mod validate;
pub mod weigh;

pub use base_parameters::BaseParameters;
pub use cancellation::Cancellation;
pub use columns::{Columns, FrictionColumns};
pub use delay::{DelayEstimate, MAX_DELAY_S, estimate_delay};
pub use effects::Effects;
pub use error::{IdentError, Warning};
pub use feedforward::feedforward_nm;
pub use fit::{Fit, fit};
pub use fourier_coefficients::FourierCoefficients;
pub use learn::{Learned, Learning, learn};
pub use log::Log;
pub use motion::{ExcludedInterval, Motion, Preparation, resample};
pub use nalgebra::{DMatrix, DVector};
pub use options::{Options, Weights};
pub use presliding::presliding_rad;
pub use procedure::{FrictionChoice, Method, Procedure, identify, identify_motions};
pub use read::{ReadError, read_csv, read_logs, read_mcap};
pub use ripple::{RippleSearch, fit_ripple};
pub use save::SaveError;
pub use selection_result::SelectionResult;
pub use stribeck::fit_with_stribeck;
pub use supple_core::friction::LoadTorque;
pub use validate::{Validation, verdict};
