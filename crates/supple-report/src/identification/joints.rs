//! The joints that a command names.

use supple_cli::exit::Failure;
use supple_ident::IdentError;

/// The requested joints, or all joints below `dof`.
pub(super) fn joints(requested: &[usize], dof: usize) -> Result<Vec<usize>, Failure> {
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
