//! Joints that the user requests for a command.

use supple_cli::exit::Failure;
use supple_ident::IdentError;

/// Checks the requested joint numbers; returns them, or all joints of an arm with `dof` joints if none are requested.
///
/// # Errors
/// [`Failure::Ident`] unless the numbers are increasing and below `dof`.
pub(super) fn requested_joints(requested: &[usize], dof: usize) -> Result<Vec<usize>, Failure> {
    if requested.is_empty() {
        return Ok((0..dof).collect());
    }
    let increasing = requested.windows(2).all(|w| w[0] < w[1]);
    if increasing && requested.iter().all(|joint| *joint < dof) {
        return Ok(requested.to_vec());
    }
    Err(Failure::Ident(IdentError::Shape {
        argument: "joints".to_owned(),
        expected: format!("numbers below {dof}, increasing"),
        found: format!("{requested:?}"),
    }))
}
