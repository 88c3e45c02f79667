//! Questions and answers before the cycle begins: one property at a time.

use crate::error::CanError;
use supple_bus::{Bus, BusFault, Event};
use supple_puck::property::{get, set};
use supple_puck::{CanFrame, Destination, GroupId, Inbound, NodeId, PropertyId, Value};

/// Millisecond in nanoseconds.
pub const MS: u64 = 1_000_000;
/// How long a node may take; libbarrett found 1 ms too short on fast computers.
const REPLY_NS: u64 = 5 * MS;
/// Least time between frames that configure a node.
const PACE_NS: u64 = 10 * MS;
/// How often a question is put before a node counts as silent.
const TRIES: u32 = 3;

/// The host's end of the bus during start-up.
pub struct Host<'a, B> {
    /// The bus.
    pub bus: &'a mut B,
    /// Asked now and then; `true` ends the start-up.
    pub stop: &'a dyn Fn() -> bool,
}

impl<B: Bus> Host<'_, B> {
    /// The value of a property; `None` where the node does not answer.
    ///
    /// # Errors
    /// Where the bus fails.
    pub fn ask(&mut self, node: NodeId, property: PropertyId) -> Result<Option<i32>, CanError> {
        for _ in 0..TRIES {
            self.bus.send(&get(node, property))?;
            let until_ns = self.bus.now_ns() + REPLY_NS;
            while let Some(frame) = self.next(until_ns)? {
                match Inbound::parse(&frame) {
                    Ok((from, Inbound::Reply(reply)))
                        if from == node && reply.property == property =>
                    {
                        return Ok(Some(reply.value.get()));
                    }
                    // Whatever else is on the bus answers someone else, or an earlier question.
                    _ => {}
                }
            }
        }
        Ok(None)
    }

    /// Sets a property of a node or group, and leaves the bus alone for a while.
    ///
    /// # Errors
    /// Where the bus fails, or the operator ends the start-up.
    pub fn tell(
        &mut self,
        to: impl Into<Destination>,
        property: PropertyId,
        value: i32,
    ) -> Result<(), CanError> {
        self.bus.send(&set(to, property, Value::Wide(value)))?;
        self.quiet(PACE_NS)
    }

    /// Says nothing for a while.
    ///
    /// # Errors
    /// Where the bus fails, or the operator ends the start-up.
    pub fn quiet(&mut self, duration_ns: u64) -> Result<(), CanError> {
        let until_ns = self.bus.now_ns() + duration_ns;
        while self.next(until_ns)?.is_some() {}
        if (self.stop)() {
            return Err(CanError::Stopped);
        }
        Ok(())
    }

    /// One position of every node that answers until `joints` have.
    ///
    /// # Errors
    /// Where the bus fails.
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

    /// The next frame of another node. A bus without anybody on it is not a fault here: nodes are being
    /// looked for.
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
