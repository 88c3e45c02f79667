//! URDF and TOML into an arm that cannot be wrong.
//!
//! A [`Description`] is read from two files: a URDF, which says where the joints are and what the
//! links weigh, and a TOML, which says everything else a controller needs. What is not physical, not
//! finite, not connected or not meant is refused with file, element, value and remedy
//! ([`ModelError`]); what a URDF parser lets pass in silence is refused here.
//!
//! It knows no simulator and no controller: it gives [`supple_core::Arm`] and
//! [`supple_core::Config`], and the few numbers that a plant and a drawing need besides.

mod assets;
mod borders;
mod bounds;
mod description;
mod error;
mod identified;
pub mod paper;
mod resolve;
pub mod settings;
mod shapes;
mod sized;
mod tree;
pub mod unlimited;
mod xml;

pub use assets::assets;
pub use description::Description;
pub use error::{Finding, ModelError};
pub use identified::Replacement;
pub use resolve::{Motors, Tool};
pub use settings::{Settings, schema_json};
pub use shapes::{Capsule, Transform};
pub use sized::Parts;
