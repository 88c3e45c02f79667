//! Reads URDF and TOML into a validated arm.
//!
//! A [`Description`] is read from a URDF, with the joints and the inertial data of the links, and a TOML with all other
//! data that a controller needs, or from a URDF alone. Unphysical, non-finite, unconnected and misspelt data are
//! rejected with file, element, value and remedy ([`ModelError`]), or repaired on request, including errors that URDF
//! parsers silently ignore.
//!
//! The crate depends on no simulator and, of this project, on the core's types alone: it provides [`supple_core::Arm`],
//! [`supple_core::Config`] and the few extra numbers for simulation and drawing.

mod assets;
mod bounds;
pub mod bus_settings;
mod const_generic;
mod delayed_damping;
mod denavit_hartenberg;
mod derive;
mod description;
mod dof;
mod error;
mod from_urdf;
mod frozen;
mod identified;
mod learned;
mod motor_constants;
pub mod paper;
mod paths;
mod poses;
pub mod reach;
mod repair;
mod resolve;
pub mod settings;
mod shapes;
mod tree;
pub mod unlimited;
#[cfg(feature = "clap")]
mod urdf_args;
mod urdf_name;
mod workspace;
mod xml;

pub use assets::assets;
pub use bus_settings::{BusFormat, BusKind};
pub use const_generic::Parts;
pub use denavit_hartenberg::{DhConvention, DhError, DhRow, dh_rows_of_csv, urdf_of_dh};
pub use derive::{Completed, Derived, tip_weight_n};
pub use description::Description;
pub use error::{Finding, ModelError};
pub use identified::{IdentifiedModel, MinimumThresholds};
pub use motor_constants::MotorConstants;
pub use paths::{PROBE_DWELL_S, Paths};
pub use resolve::{BusDescription, BusMotor, Motors, Tool};
pub use settings::{LearnedSettings, Settings, schema_json};
pub use shapes::{Capsule, Transform};
#[cfg(feature = "clap")]
pub use urdf_args::UrdfArgs;
pub use urdf_name::UrdfName;
