//! Controller and plant in one process, in virtual time: the paper's experiments.
//!
//! A [`Setup`] is a description taken as the truth about the plant; a [`Variant`] says what the
//! controller does not know of it. A [`Plan`] is a trajectory with both; [`run()`] brings the arm to its
//! start and follows it. [`demo()`] runs everything that the paper shows.
//!
//! ```
//! use supple_experiment::{Mismatch, Plan, Setup, Variant, run, scenario};
//! use supple_model::Description;
//! use supple_plant::Scene;
//!
//! let setup = Setup::<4>::new(&Description::asset("wam4")?, 0)?;
//! let variant = Variant {
//!     mismatch: Some(Mismatch::identified(0)),
//!     ..Variant::EXACT
//! };
//! let (trajectory, _) = scenario::sinusoid(1.0);
//! let plan = Plan {
//!     name: "a second of the sinusoid".to_owned(),
//!     config: setup.config(&variant)?,
//!     plant: setup.plant(&variant, Scene::default()),
//!     trajectory,
//!     duration_s: 1.0,
//! };
//! let run = run(&plan, &mut |_cycle, _time_s| Ok(()))?;
//! assert!(run.ended.is_none() && run.rms_error_m < 0.02);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Nothing here reads a clock: the same plan gives the same bits.

#![forbid(unsafe_code)]

mod breakaway;
pub mod calibrate;
mod demo;
mod error;
mod excite;
mod foretell;
mod job;
pub mod metrics;
mod mismatch;
pub mod probing;
mod quadrant;
mod record;
mod rig;
mod ripple;
mod run;
pub mod scenario;
mod session;
mod setup;
mod start;
pub mod summary;
mod trace;
mod tracking;

pub use breakaway::{JointBreakaway, RATE_NM_PER_S, STOP_RAD, breakaway};
pub use calibrate::{Calibrated, Calibration, Truthfulness, calibrate};
pub use demo::{Demo, DemoOptions, ProbingRun, Progress, demo};
pub use error::ExperimentError;
pub use excite::{constant_speed_runs, excitation, slow_motion};
pub use foretell::{Foretold, foretell};
pub use mismatch::Mismatch;
pub use quadrant::{Edge, EdgeMeter};
pub use record::Recorder;
pub use rig::{Cycle, Rig};
pub use ripple::ripple_on;
pub use run::{Ended, Plan, Run, Watch, run};
pub use session::{Onlooker, Recording, Session, Step};
pub use setup::{Setup, Variant};
pub use start::{active_joints, start_pose};
pub use trace::{JointTorque, Sample, Trace};
pub use tracking::{Tracking, tracking};
