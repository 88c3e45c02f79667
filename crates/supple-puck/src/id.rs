//! Message ids: `G FFFFF TTTTT`, which are the group bit, the sender's node, and the receiver's node or group.
//!
//! Every 11-bit number is a valid id, so only numbers above 0x7FF are rejected. Source: manual page 46
//! and libbarrett's masks; libbarrett for the meaning of the groups.

use core::fmt;
use supple_can_frame::{CanFrame, CanId};

const GROUP_BIT: u16 = 0x400;
const FROM_SHIFT: u16 = 5;
const FIVE_BITS: u16 = 0x1f;

/// Error: a number does not fit into its field of the id.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IdError {
    /// The node number is above 31.
    Node(u8),
    /// The group number is above 31.
    Group(u8),
    /// The message id is above 0x7FF.
    Message(u32),
}

impl fmt::Display for IdError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            IdError::Node(n) => write!(f, "node is {n}, it must be 0 to 31"),
            IdError::Group(n) => write!(f, "group is {n}, it must be 0 to 31"),
            IdError::Message(n) => write!(f, "message id is {n:#x}, it must be at most 0x7ff"),
        }
    }
}

impl core::error::Error for IdError {}

/// A node of the bus, 0 to 31.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct NodeId(u8);

impl NodeId {
    /// The host computer.
    pub const HOST: NodeId = NodeId(0);
    /// Force/torque sensor at the wrist.
    pub const FORCE_TORQUE: NodeId = NodeId(8);
    /// Safety module.
    pub const SAFETY: NodeId = NodeId(10);

    /// Creates the id of node `number`.
    ///
    /// # Errors
    /// [`IdError::Node`] for a number above 31.
    pub const fn new(number: u8) -> Result<NodeId, IdError> {
        if number < 32 {
            Ok(NodeId(number))
        } else {
            Err(IdError::Node(number))
        }
    }

    /// Motor puck of joint `number`, 1 to 7; `None` for other numbers.
    pub const fn joint(number: u8) -> Option<NodeId> {
        if number >= 1 && number <= 7 {
            Some(NodeId(number))
        } else {
            None
        }
    }

    /// Motor puck `number` of the hand, 1 to 4, at nodes 11 to 14; `None` for other numbers.
    pub const fn hand(number: u8) -> Option<NodeId> {
        if number >= 1 && number <= 4 {
            Some(NodeId(10 + number))
        } else {
            None
        }
    }

    /// Number, 0 to 31.
    pub const fn number(self) -> u8 {
        self.0
    }
}

/// A group of nodes, 0 to 31. A puck belongs to at most three.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct GroupId(u8);

impl GroupId {
    /// All actuators, without the safety module.
    pub const ACTUATORS: GroupId = GroupId(0);
    /// Motor pucks 1 to 4, which receive packed torques.
    pub const LOWER_TORQUES: GroupId = GroupId(1);
    /// Motor pucks 5 to 7, which receive packed torques.
    pub const UPPER_TORQUES: GroupId = GroupId(2);
    /// Destination of the motor pucks' position replies, which the safety module also receives.
    pub const POSITION: GroupId = GroupId(3);
    /// Motor pucks 1 to 7 (libbarrett, OWD). In the 2008 manual: 1 to 4.
    pub const ARM: GroupId = GroupId(4);
    /// Pucks of the hand (libbarrett, OWD). In the 2008 manual: pucks 5 to 7.
    pub const HAND: GroupId = GroupId(5);
    /// Destination of replies to property requests.
    pub const REPLY: GroupId = GroupId(6);
    /// Destination of secondary encoder positions.
    pub const SECONDARY_POSITION: GroupId = GroupId(7);
    /// Tactile reports of the ten strongest cells.
    pub const TACTILE_TOP_TEN: GroupId = GroupId(8);
    /// Tactile reports of all cells.
    pub const TACTILE_FULL: GroupId = GroupId(9);
    /// Forces of the force/torque sensor.
    pub const FORCE: GroupId = GroupId(10);
    /// Torques of the force/torque sensor.
    pub const TORQUE: GroupId = GroupId(11);
    /// Accelerations of the force/torque sensor.
    pub const ACCELERATION: GroupId = GroupId(12);

    /// Creates the id of group `number`.
    ///
    /// # Errors
    /// [`IdError::Group`] for a number above 31.
    pub const fn new(number: u8) -> Result<GroupId, IdError> {
        if number < 32 {
            Ok(GroupId(number))
        } else {
            Err(IdError::Group(number))
        }
    }

    /// Number, 0 to 31.
    pub const fn number(self) -> u8 {
        self.0
    }
}

/// Destination of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Destination {
    /// One node.
    Node(NodeId),
    /// All members of a group.
    Group(GroupId),
}

impl From<NodeId> for Destination {
    fn from(node: NodeId) -> Destination {
        Destination::Node(node)
    }
}

impl From<GroupId> for Destination {
    fn from(group: GroupId) -> Destination {
        Destination::Group(group)
    }
}

/// The 11-bit id of a frame. The lowest id wins the bus arbitration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct MessageId(u16);

impl MessageId {
    /// Id of a message from node to node.
    pub const fn to_node(from: NodeId, to: NodeId) -> MessageId {
        MessageId(((from.0 as u16) << FROM_SHIFT) | to.0 as u16)
    }

    /// Id of a message from node to group.
    pub const fn to_group(from: NodeId, to: GroupId) -> MessageId {
        MessageId(GROUP_BIT | ((from.0 as u16) << FROM_SHIFT) | to.0 as u16)
    }

    /// Id of a message from a node to any destination.
    pub const fn new(from: NodeId, to: Destination) -> MessageId {
        match to {
            Destination::Node(node) => MessageId::to_node(from, node),
            Destination::Group(group) => MessageId::to_group(from, group),
        }
    }

    /// Creates the id from its number on the bus.
    ///
    /// # Errors
    /// [`IdError::Message`] for a number above 0x7FF.
    pub const fn from_raw(raw: u32) -> Result<MessageId, IdError> {
        if raw <= 0x7ff {
            Ok(MessageId(raw as u16))
        } else {
            Err(IdError::Message(raw))
        }
    }

    /// Returns the id of a frame; `None` for a frame with an extended id and for an FD frame, which this protocol does not use.
    pub const fn of(frame: &CanFrame) -> Option<MessageId> {
        match frame.id().as_standard() {
            Some(raw) if !frame.is_fd() => Some(MessageId(raw)),
            _ => None,
        }
    }

    /// The id of a frame.
    pub const fn can_id(self) -> CanId {
        CanId::standard_masked(self.0)
    }

    /// Number on the bus, 0 to 0x7FF.
    pub const fn raw(self) -> u16 {
        self.0
    }

    /// Sender.
    pub const fn from(self) -> NodeId {
        NodeId(((self.0 >> FROM_SHIFT) & FIVE_BITS) as u8)
    }

    /// Destination.
    pub const fn to(self) -> Destination {
        let number = (self.0 & FIVE_BITS) as u8;
        if self.0 & GROUP_BIT == 0 {
            Destination::Node(NodeId(number))
        } else {
            Destination::Group(GroupId(number))
        }
    }
}

impl From<MessageId> for CanId {
    fn from(id: MessageId) -> CanId {
        id.can_id()
    }
}

impl fmt::Display for MessageId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let from = self.from().0;
        match self.to() {
            Destination::Node(to) => write!(f, "{from} to node {}", to.0),
            Destination::Group(to) => write!(f, "{from} to group {}", to.0),
        }
    }
}
