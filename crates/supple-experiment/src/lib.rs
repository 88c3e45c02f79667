//! Controller and plant in one process, in virtual time: the paper's experiments.
//!
//! A [`Setup`] builds the plant from a description; a [`Variant`] defines how the controller's model differs
//! from it. A [`Plan`] combines both with a trajectory; [`run()`] moves the arm to the start and tracks the
//! trajectory. [`demo()`] runs all experiments of the paper.
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
//!     learning: false,
//!     gain_change: None,
//! };
//! let run = run(&plan, &mut |_cycle, _time_s| Ok(()))?;
//! assert!(run.ended.is_none() && run.rms_error_m < 0.02);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! No function reads a clock: the same plan gives bit-identical results.

#![forbid(unsafe_code)]

mod adapted;
mod approach_time;
mod breakaway;
pub mod calibrate;
mod calibrated_runs;
mod demo;
mod demo_options;
mod deviation;
pub mod effects;
mod error;
mod excite;
mod job;
pub mod metrics;
mod mismatch;
pub mod paper_procedure;
mod pose;
pub mod probing;
pub mod procedure;
mod quadrant;
mod record;
mod recorded_logs;
mod request_sequence;
mod residual_error;
mod rig;
mod ripple;
mod run;
pub mod scenario;
mod setup;
mod start;
pub mod summary;
pub mod teaching;
mod trace;
mod tracking;
mod tracking_prediction;
mod weighing_result;
mod wiring;

pub use adapted::Adapted;
pub use approach_time::approach_s;
pub use breakaway::{JointBreakaway, RATE_NM_PER_S, STOP_RAD, breakaway};
pub use calibrate::{Calibration, CalibrationResult, ModelAccuracy, calibrate};
pub use calibrated_runs::{CalibratedRuns, PressingForces, SeedFailure, SeedFault};
pub use demo::{Demo, ProbingRun, Progress, demo};
pub use demo_options::DemoOptions;
pub use deviation::Deviation;
pub use error::ExperimentError;
pub use excite::{constant_speed_runs, excitation, slow_motion};
pub use mismatch::Mismatch;
pub use pose::{PoseMotion, PoseTracking, pose_start, track_pose};
pub use quadrant::{SegmentErrorAccumulator, SegmentPass};
pub use record::Recorder;
pub use request_sequence::{Recording, RequestSequence, Step, StepCallback};
pub use residual_error::{
    ErrorInterval, NO_INTERVAL, SinusoidRegion, error_interval, error_interval_of,
    feedforward_residual_nm,
};
pub use rig::{Cycle, Rig};
pub use ripple::identify_ripple;
pub use run::{CycleCallback, FaultEnd, GainChange, Plan, Run, run};
pub use setup::{Setup, Variant};
pub use start::{active_joints, start_pose};
pub use trace::{JointTorque, Sample, Trace};
pub use tracking::{IdentifiedModelTracking, track_with_identified_model};
pub use tracking_prediction::{GOOD_M, TrackingPrediction, predict_tracking_error};
pub use weighing_result::{JointTorqueScale, WeighingResult};
pub use wiring::Wiring;
