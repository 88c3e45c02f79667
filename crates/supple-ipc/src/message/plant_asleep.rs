//! From the plant to the controller, before it sleeps.

use iceoryx2::prelude::ZeroCopySend;

/// The plant found no answer and goes to sleep: the answer needs a ring.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("supple.PlantAsleep.v1")]
pub struct PlantAsleep {
    /// Cycle of the arm state whose answer it waits for.
    pub cycle: u64,
}
