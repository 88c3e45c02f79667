//! The arm and what it touches, as a simulated plant: torques in, measurements out.
//!
//! The arm is a reduced-coordinate multibody of the rapier engine with the rotor inertias on its
//! diagonal; the joints carry bristle friction, quantised encoders and quantised, delayed torques;
//! the tip is a ball that meets the [`Scene`] with a Hunt-Crossley force of this crate, since the
//! engine's own contact impulse has no stiffness of its own: its peak grows as the step shrinks. The
//! engine solves contacts between scene objects only.
//!
//! It is not a controller and knows none; arm links other than the tip touch nothing; a step is
//! first-order accurate. The same configuration and torques give the same bits.
//!
//! ```
//! use supple_core::{Arm, Body, Joint, Pose, Vector, nalgebra::Vector3};
//! use supple_plant::{Plant, PlantConfig};
//!
//! let pendulum = Joint {
//!     parent_from_link: Pose::IDENTITY,
//!     axis: Vector3::y(),
//!     body: Body::ball(1.0, 0.05, Vector3::new(0.5, 0.0, 0.0)),
//!     armature_kg_m2: 0.01,
//! };
//! let tip = Pose::from_translation(Vector3::new(0.5, 0.0, 0.0));
//! let arm = Arm::new(&[pendulum], tip, None, Vector3::new(0.0, 0.0, -9.81))?;
//! let mut plant = Plant::new(PlantConfig::ideal(arm), Vector::zeros(), Vector::zeros())?;
//! let measured = plant.cycle(&Vector::zeros());
//! assert!(measured.position_rad[0] > 0.0, "it falls, turning about +y");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]

pub mod config;
pub mod contact;
pub mod drive;
pub mod filter;
pub mod friction;
pub mod injection;
pub mod noise;
pub mod scene;

mod description;
mod error;
mod plant;
mod record;
mod trace_file;
mod world;

pub use config::{ForceSensor, PlantConfig, Stops};
pub use contact::{Contact, Material};
pub use drive::{Drive, Ripple};
pub use error::PlantError;
pub use friction::LuGre;
pub use injection::{Injection, InjectionError, InjectionKind, Injector, Sight, Trigger};
pub use plant::Plant;
pub use record::{Measurement, StepRecord, Truth};
pub use scene::{FixedBlock, FreeBox, Ground, Layer, Scene, SceneError};
pub use trace_file::{Sample, TraceError, TraceFile};
pub use world::{Object, ObjectKind};
