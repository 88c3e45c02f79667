//! Sent by the plant to the controller before the plant blocks.

use iceoryx2::prelude::ZeroCopySend;

/// The plant has no answer yet and is about to block: the controller must notify it after the answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("supple.WakeRequest.v1")]
pub struct WakeRequest {
    /// Cycle of the arm state whose answer it waits for.
    pub cycle: u64,
}
