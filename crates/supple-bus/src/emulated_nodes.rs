//! Interface of the emulated nodes of an arm.

use crate::bus::Event;
use supple_can_frame::CanFrame;

/// All nodes on the bus except the host.
pub trait EmulatedNodes {
    /// Time of the bus \[ns\].
    fn now_ns(&self) -> u64;

    /// Receives a frame that the host sends at the current time.
    fn receive_from_host(&mut self, frame: &CanFrame);

    /// Advances the time to the next event for the host, which it returns, or to `until_ns`, whichever comes first.
    fn run_until(&mut self, until_ns: u64) -> Option<Event>;
}
