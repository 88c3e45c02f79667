//! From a number of joints to code for arms of this size.

/// Evaluates an expression for a number of joints that is known only at run time: 3 to 7, as in `supple_core::sizes`.
///
/// `with_dof!(description.dof(), N => run::<N>(&description))` returns the value of the expression in `Ok`,
/// or [`ModelError::Dof`](crate::ModelError::Dof) for another number of joints.
///
/// ```
/// let description = supple_model::Description::asset("wam4")?;
/// let names = supple_model::with_dof!(description.dof(), N => {
///     let home = description.home::<N>()?;
///     home.len()
/// })?;
/// assert_eq!(names, 4);
/// # Ok::<(), supple_model::ModelError>(())
/// ```
#[macro_export]
macro_rules! with_dof {
    ($dof:expr, $n:ident => $body:expr) => {
        match $dof {
            3 => $crate::with_dof!(@one 3, $n, $body),
            4 => $crate::with_dof!(@one 4, $n, $body),
            5 => $crate::with_dof!(@one 5, $n, $body),
            6 => $crate::with_dof!(@one 6, $n, $body),
            7 => $crate::with_dof!(@one 7, $n, $body),
            found => ::core::result::Result::Err($crate::ModelError::Dof { found }),
        }
    };
    (@one $value:literal, $n:ident, $body:expr) => {{
        const $n: usize = $value;
        ::core::result::Result::Ok($body)
    }};
}
