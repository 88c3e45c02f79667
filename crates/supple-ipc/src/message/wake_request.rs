//! Message from the plant to the controller: the plant is about to block until it is notified.

use iceoryx2::prelude::ZeroCopySend;

/// The plant has not received the torque command yet and is about to block: the controller must notify the plant once
/// it has sent the command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("supple.WakeRequest.v1")]
pub struct WakeRequest {
    /// Cycle of the arm state for which the plant awaits a torque command.
    pub cycle: u64,
}
