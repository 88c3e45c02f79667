//! The error of a wrong number of values.

use crate::error::{ModelError, Reporter};

pub(super) fn wrong_count(
    report: Reporter<'_>,
    element: &str,
    found: usize,
    expected: usize,
) -> ModelError {
    report.invalid(
        element,
        format!("must have one entry for each joint that moves, {expected}"),
        format!("{found} entries"),
        "list one value for each joint that moves, from the root link to tip_frame; leave out fixed, locked, mimic and prismatic joints",
    )
}
