//! Parses the frames that the host receives, which are distinguished by destination group.

use crate::force_torque::{Quantity, SensorReading};
use crate::frame::LengthError;
use crate::id::{Destination, GroupId, MessageId, NodeId};
use crate::position::PositionReply;
use crate::property::{PropertyError, Reply};
use core::fmt;
use supple_can_frame::CanFrame;

/// A parsed frame of a node of the arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Inbound {
    /// A motor puck's position.
    Position(PositionReply),
    /// The answer to a property request.
    Reply(Reply),
    /// A reading of the force/torque sensor.
    Sensor(SensorReading),
    /// A frame to a node, or to a group that the host does not read, such as the safety module's frames to the motors (CAN id
    /// 0x540) and tactile reports.
    Other,
}

/// Errors of parsing a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InboundError {
    /// The frame has an extended id or is an FD frame.
    Foreign,
    /// The sender is node 0: another host, or an echo.
    FromHost,
    /// A position of the wrong length, from this node.
    Position(NodeId, LengthError),
    /// A malformed reply from this node.
    Reply(NodeId, PropertyError),
    /// A sensor frame of the wrong length, from this node.
    Sensor(NodeId, LengthError),
}

impl fmt::Display for InboundError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            InboundError::Foreign => {
                f.write_str("frame is extended or FD, expected a classic one with an 11-bit id")
            }
            InboundError::FromHost => f.write_str("frame is from node 0, expected 1 to 31"),
            InboundError::Position(node, error) => {
                write!(f, "position of node {}: {error}", node.number())
            }
            InboundError::Reply(node, error) => {
                write!(f, "reply of node {}: {error}", node.number())
            }
            InboundError::Sensor(node, error) => {
                write!(f, "sensor frame of node {}: {error}", node.number())
            }
        }
    }
}

impl core::error::Error for InboundError {}

impl Inbound {
    /// Parses a frame; returns the sender and the contents. Replies may arrive in any order; match them by sender.
    ///
    /// # Errors
    /// See [`InboundError`].
    pub fn parse(frame: &CanFrame) -> Result<(NodeId, Inbound), InboundError> {
        let id = MessageId::of(frame).ok_or(InboundError::Foreign)?;
        let from = id.from();
        if from == NodeId::HOST {
            return Err(InboundError::FromHost);
        }
        let sensor = |quantity| match SensorReading::parse(quantity, frame) {
            Ok(reading) => Ok(Inbound::Sensor(reading)),
            Err(error) => Err(InboundError::Sensor(from, error)),
        };
        let inbound = match id.to() {
            Destination::Group(GroupId::POSITION) => PositionReply::parse(frame)
                .map(Inbound::Position)
                .map_err(|error| InboundError::Position(from, error))?,
            Destination::Group(GroupId::REPLY) => Reply::parse(frame)
                .map(Inbound::Reply)
                .map_err(|error| InboundError::Reply(from, error))?,
            Destination::Group(GroupId::FORCE) => sensor(Quantity::Force)?,
            Destination::Group(GroupId::TORQUE) => sensor(Quantity::Torque)?,
            Destination::Group(GroupId::ACCELERATION) => sensor(Quantity::Acceleration)?,
            Destination::Group(_) | Destination::Node(_) => Inbound::Other,
        };
        Ok((from, inbound))
    }
}
