//! State of the controller that the plant receives.

use supple_core::controller::Mode;

/// State of the controller that the plant receives in one cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControllerView {
    /// Whether the drives are active.
    pub active: bool,
    /// Mode of the torque command of this cycle; `None` if there is no command or the mode is unknown.
    pub mode: Option<Mode>,
}
