//! Motions that were taught by hand, or are given as points: reads them, plans them within the limits, and repeats them as
//! set-points.
//!
//! A [`RecordedMotion`] has times; [`time_waypoints`] computes times for waypoints. [`Repetition::plan`] converts a motion to
//! set-points that the controller's checks accept, slower than recorded if the limits require it.

mod file;
mod repetition;
mod smoothing;
mod waypoints;

pub use file::{Points, PointsError, RecordedMotion, read_points};
pub use repetition::{Repetition, RepetitionError};
pub use waypoints::{WaypointError, time_waypoints};
