//! An emulated arm with any type of drives on a bus in real time.

use supple_bus::virtual_time::EmulatedNodes;
use supple_bus::{Bus, BusError, BusFault, DatagramBus, Event, SocketCan};
use supple_can_frame::CanFrame;

/// Delay above which this process counts as stalled; the arm's clock pauses for it \[ns\].
const STALL_THRESHOLD_NS: u64 = 50_000_000;
/// Maximum wait between polls of the pendant's socket \[ns\].
const POLL_INTERVAL_NS: u64 = 1_000_000;

/// The arm's side of a bus in real time.
pub trait ArmBus: Bus {
    /// Sends an error frame to the host.
    ///
    /// # Errors
    /// If the bus fails.
    fn fault(&mut self, fault: BusFault) -> Result<(), BusError>;
}

impl ArmBus for DatagramBus {
    fn fault(&mut self, fault: BusFault) -> Result<(), BusError> {
        self.send_fault(fault)
    }
}

impl ArmBus for SocketCan {
    fn fault(&mut self, fault: BusFault) -> Result<(), BusError> {
        self.send_fault(fault)
    }
}

/// An emulated arm that runs in real time.
pub trait EmulatedArm: EmulatedNodes {
    /// Time of the next event that does not depend on the host \[ns\].
    fn next_ns(&self) -> u64;

    /// Pauses the arm for `gap_ns`.
    fn shift_clock(&mut self, gap_ns: u64);

    /// Sets the monotonic clock minus the arm's clock \[ns\].
    fn set_offset_ns(&mut self, offset_ns: u64);

    /// Whether a received frame is one of the host.
    fn is_from_host(&self, frame: &CanFrame) -> bool;
}

/// Advances the arm to the bus time and sends its frames. If this process stalled, the arm's clock pauses for
/// that time instead.
///
/// # Errors
/// If the bus fails.
pub fn advance_to_bus_time(
    emulator: &mut impl EmulatedArm,
    bus: &mut impl ArmBus,
) -> Result<(), BusError> {
    let now_ns = bus.now_ns();
    let behind_ns = now_ns.saturating_sub(emulator.now_ns());
    if behind_ns > STALL_THRESHOLD_NS {
        emulator.shift_clock(behind_ns);
    }
    while let Some(event) = emulator.run_until(now_ns) {
        match event {
            // If the host does not read, frames are lost, as on a real bus.
            Event::Frame(frame) => match bus.send(&frame) {
                Ok(()) | Err(BusError::Full) => {}
                Err(error) => return Err(error),
            },
            Event::Fault(fault) => bus.fault(fault)?,
            Event::Sent(_) => {}
        }
    }
    Ok(())
}

/// Waits for a frame of the host until the arm's next own event, at most for a millisecond.
///
/// # Errors
/// If the bus fails.
pub fn receive_host_frame(
    emulator: &mut impl EmulatedArm,
    bus: &mut impl ArmBus,
) -> Result<(), BusError> {
    let until_ns = emulator.next_ns().min(bus.now_ns() + POLL_INTERVAL_NS);
    if let Some(Event::Frame(frame)) = bus.receive_until(until_ns)?
        && emulator.is_from_host(&frame)
    {
        advance_to_bus_time(emulator, bus)?;
        emulator.receive_from_host(&frame);
    }
    Ok(())
}
