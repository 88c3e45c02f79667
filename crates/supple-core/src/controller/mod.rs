//! The controller: an immutable [`Controller`], its [`State`], and [`step`], which advances the
//! state by one cycle.

mod activity;
mod activity_torques;
mod checks;
pub mod codes;
mod delayed_damping;
mod delayed_gains;
pub mod drive_guard;
mod encoders;
pub mod estimator;
mod fault;
mod gain_ramp;
mod handover;
pub mod latch;
mod learned_ramp;
mod learning;
mod limiter;
mod mode;
mod motion_check;
mod nullspace;
pub mod observer;
mod oscillation;
mod output;
mod plausibility;
mod pose_gains;
mod pose_task;
mod position_limits;
mod prepared;
mod presliding;
mod request_checks;
mod requests;
pub mod residual;
mod reversed_encoder;
mod set_point;
mod state;
mod step;
mod stop;
mod stopping_motion;
mod stuck_encoder;
mod supervision;
mod validate;
mod words;

pub use prepared::Controller;

pub use fault::{Fault, SafeAction};
pub use learned_ramp::LEARNED_RAMP_S;
pub use limiter::{LimitedTorque, MotorGroups, limit, limit_torque};
pub use mode::{Breakaway, LearningSwitch, Mode, Refusal, Request, SetPoint};
pub use motion_check::{check_motion, check_references};
pub use output::{CycleRecord, Input, Orientation, Output};
pub use pose_gains::{GainAxes, GainMatrices, GainPart};
pub use set_point::MAX_SET_POINT_AHEAD_S;
pub use state::State;
pub use step::step;
pub use validate::ConfigError;
pub use words::{JointLabel, NamesJoints, WithNames};
