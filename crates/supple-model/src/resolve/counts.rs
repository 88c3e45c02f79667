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
        format!("must have one entry per moving joint, {expected}"),
        format!("{found} entries"),
        "count the movable joints from the root link to tip_frame, fixed ones left out",
    )
}
