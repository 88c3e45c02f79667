//! Simulated arm and environment: torques in, measurements out.
//!
//! The arm is a chain in joint coordinates with the rotor inertias on the diagonal of its mass matrix; the joints have
//! bristle friction, quantised encoders and quantised, delayed torques; [`options`] add what else a real arm has. The
//! tip is a sphere with a Hunt-Crossley contact force implemented here, because the impulse-based contact of the rapier
//! engine has no defined stiffness: its peak grows as the step shrinks. The engine solves contacts between scene objects
//! only, and runs only if one of them can move.
//!
//! The crate contains no controller; links other than the tip do not collide; integration is first-order
//! accurate. The same configuration and torques give bit-identical results.
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

pub mod actuators;
pub mod config;
pub mod contact;
pub mod elasticity;
pub mod filter;
pub mod friction;
pub mod friction_variation;
pub mod hand;
pub mod injection;
pub mod noise;
pub mod scene;

#[cfg(feature = "clap")]
mod args;
mod description;
mod error;
mod joint_frictions;
pub mod options;
mod plant;
mod record;
mod trace_file;
mod world;

pub use actuators::{ActuatorModel, Ripple, TorqueRipple};
#[cfg(feature = "clap")]
pub use args::{PlantArgs, SimulationArgs, SimulationArgsError};
pub use config::{ForceSensor, HardStops, Hose, PlantConfig};
pub use contact::{Contact, Material};
pub use elasticity::Elasticity;
pub use error::PlantError;
pub use friction::LuGre;
pub use friction_variation::{FrictionScale, FrictionVariation};
pub use hand::{Grip, Hand};
pub use injection::{ControllerView, Injection, InjectionError, InjectionKind, Injector, Trigger};
pub use options::{PlantOptions, PlantOptionsError};
pub use plant::Plant;
pub use record::{Measurement, StepRecord, Truth};
pub use scene::{FixedBlock, FreeBox, Ground, Layer, Scene, SceneError};
pub use trace_file::{Sample, TraceError, TraceFile};
pub use world::{Object, ObjectKind};
