//! Motions that were shown by hand, or are given as points: read, planned within the limits, and repeated as set-points.
//!
//! A [`RecordedMotion`] has times; [`time_waypoints`] gives times to points without any. [`Repetition::plan`] turns it into
//! set-points that the controller's own checks accept, slower than recorded where the limits need that.

mod file;
mod repetition;
mod smoothing;
mod waypoints;

pub use file::{Points, PointsError, RecordedMotion, read_points};
pub use repetition::{Repetition, RepetitionError};
pub use waypoints::{WaypointError, time_waypoints};
