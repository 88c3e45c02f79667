//! Blocking access to the properties of nodes during start-up, one property at a time.

use crate::drives::barrett::error::CanError;
use supple_bus::{Bus, BusFault, Event};
use supple_can_frame::CanFrame;
use supple_puck::property::{get, set};
use supple_puck::{Destination, GroupId, Inbound, NodeId, PropertyId, Value};

/// One millisecond in nanoseconds.
pub const MS: u64 = 1_000_000;
/// Timeout of a reply; libbarrett found 1 ms too short on fast computers.
const REPLY_NS: u64 = 5 * MS;
/// Minimum time after a frame that sets a property \[ns\].
const SETTING_INTERVAL_NS: u64 = 10 * MS;
/// Number of requests before a node counts as silent.
const MAX_ATTEMPTS: u32 = 3;

/// The host's access to the bus during start-up.
pub struct Host<'a, B> {
    /// The bus.
    pub bus: &'a mut B,
    /// Shutdown request: start-up calls it repeatedly and ends if it returns `true`.
    pub stop: &'a dyn Fn() -> bool,
}

impl<B: Bus> Host<'_, B> {
    /// Reads a property; returns `None` if the node does not answer.
    ///
    /// # Errors
    /// If the bus fails.
    pub fn get_property(
        &mut self,
        node: NodeId,
        property: PropertyId,
    ) -> Result<Option<i32>, CanError> {
        for _ in 0..MAX_ATTEMPTS {
            self.bus.send(&get(node, property))?;
            let until_ns = self.bus.now_ns() + REPLY_NS;
            while let Some(frame) = self.next(until_ns)? {
                match Inbound::parse(&frame) {
                    Ok((from, Inbound::Reply(reply)))
                        if from == node && reply.property == property =>
                    {
                        return Ok(Some(reply.value.get()));
                    }
                    // Other frames are replies to other requests and are ignored.
                    _ => {}
                }
            }
        }
        Ok(None)
    }

    /// Sets a property of a node or group, then keeps the bus silent for [`SETTING_INTERVAL_NS`].
    ///
    /// # Errors
    /// If the bus fails, or a shutdown is requested.
    pub fn set_property(
        &mut self,
        to: impl Into<Destination>,
        property: PropertyId,
        value: i32,
    ) -> Result<(), CanError> {
        self.bus.send(&set(to, property, Value::Wide(value)))?;
        self.wait_silently(SETTING_INTERVAL_NS)
    }

    /// Receives for this time without sending.
    ///
    /// # Errors
    /// If the bus fails, or a shutdown is requested.
    pub fn wait_silently(&mut self, duration_ns: u64) -> Result<(), CanError> {
        let until_ns = self.bus.now_ns() + duration_ns;
        while self.next(until_ns)?.is_some() {}
        if (self.stop)() {
            return Err(CanError::Stopped);
        }
        Ok(())
    }

    /// Requests the positions; returns them once `joints` nodes have replied or the timeout has passed.
    ///
    /// # Errors
    /// If the bus fails.
    pub fn positions(
        &mut self,
        property: PropertyId,
        joints: usize,
    ) -> Result<Vec<(NodeId, i32)>, CanError> {
        self.bus.send(&get(GroupId::ARM, property))?;
        let until_ns = self.bus.now_ns() + REPLY_NS;
        let mut positions = Vec::with_capacity(joints);
        while positions.len() < joints
            && let Some(frame) = self.next(until_ns)?
        {
            if let Ok((from, Inbound::Position(reply))) = Inbound::parse(&frame) {
                positions.push((from, reply.motor.get()));
            }
        }
        Ok(positions)
    }

    /// Returns the next frame that a node sent, not this host. Ignores all bus faults except bus-off: without a powered node, no
    /// node acknowledges the requests with which the start-up searches for nodes.
    fn next(&mut self, until_ns: u64) -> Result<Option<CanFrame>, CanError> {
        loop {
            match self.bus.receive_until(until_ns)? {
                None => return Ok(None),
                Some(Event::Frame(frame)) => return Ok(Some(frame)),
                Some(Event::Fault(fault @ BusFault::BusOff)) => {
                    return Err(CanError::BusFault(fault));
                }
                Some(Event::Sent(_) | Event::Fault(_)) => {}
            }
        }
    }
}
