//! The controller as the plant sees it.

use supple_core::controller::Mode;

/// State of the controller as the plant sees it in one cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControllerView {
    /// The drives are active.
    pub active: bool,
    /// Mode of the torque command of this cycle; `None` if there is no command or the mode is unknown.
    pub mode: Option<Mode>,
}
