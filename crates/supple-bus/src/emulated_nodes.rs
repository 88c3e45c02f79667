//! The arm as seen from its bus.

use crate::bus::Event;
use supple_can_frame::CanFrame;

/// All nodes on the bus except the host.
pub trait EmulatedNodes {
    /// Time of the bus \[ns\].
    fn now_ns(&self) -> u64;

    /// The host sends a frame at the current time.
    fn host_sends(&mut self, frame: &CanFrame);

    /// Runs to the next event for the host or to `until_ns`, whichever comes first; the time is then that of the
    /// event or `until_ns`.
    fn run_until(&mut self, until_ns: u64) -> Option<Event>;
}
