//! Calibration of an arm. The steps are the same for the simulated arm in this process and for systems of processes
//! ([`MotionArm`]).
//!
//! ```text
//! wiring -> swept space confirmed -> warm-up -> breakaway -> first pass -> first fit (loaded)
//!        -> full pass -> slow -> constant speed -> validation motion -> identification (loaded) -> float -> sinusoid
//!        -> weighing, if a weight is given
//! ```
//!
//! A finished step is never repeated: [`Progress`] is written after each step. The model of the first fit is loaded before the
//! arm moves at full amplitude. If contact stops a motion, the arm moves back to the start of the motion and repeats it.

mod arm;
mod error;
mod fitting;
mod in_process;
mod motions;
mod options;
mod progress;
mod steps;
mod sweep;
mod thresholds;
mod wiring;

pub(crate) use options::HOLD_REMEDY;
pub use options::{
    DRAWING, FIRST_MODEL, LEARNED_MODEL, LEARNING_S, LOGS, Operator, ProcedureOptions,
};

pub use arm::{Collector, Motion, MotionArm, PerformedMotion, StopCause, Stopped};
pub use error::ProcedureError;
pub use fitting::read_excitations;
pub use in_process::{InProcessArm, moves_joints};
pub use motions::Motions;
pub use progress::{FILE, FinishedStep, FitQuality, Progress, STEPS, SinusoidResult, StepName};
pub use steps::hold_check::{HeldPose, HoldCheck, HoldCheckOptions, check_hold};
pub use steps::single::{SingleMotion, excite_arm, track_arm};
pub use steps::{CalibratedArm, calibrate_arm};
pub use sweep::Sweep;
pub use wiring::JointWiring;
