//! Properties: the named values of a puck, read and set by id.
//!
//! ```text
//! get    A=0 PPPPPPP                          1 byte
//! set    A=1 PPPPPPP   00   value             4 bytes (16-bit value) or 6 (32-bit value)
//! ```
//!
//! The value is little-endian two's complement. A puck's reply is a set frame to [`GroupId::REPLY`]. Exceptions
//! to this form have separate modules: [`position`](crate::position), [`torque`](crate::torque),
//! [`force_torque`](crate::force_torque). The id of a property depends on the firmware: [`PropertyTable`].
//! Source: libbarrett, btclient, manual.

mod id;
mod ids;
mod names;
mod table;

pub(crate) use id::SET_BIT;
pub use id::{Property, PropertyId, Width};

pub use table::{FirmwareTooOld, PropertyTable, PuckKind, Slot};

use crate::frame::LengthError;
use crate::id::{Destination, GroupId, MessageId, NodeId};
use core::fmt;
use supple_can_frame::CanFrame;

impl Property {
    /// All properties.
    pub fn all() -> impl Iterator<Item = Property> {
        (0..ids::NAMES.len() as u8).map(Property)
    }

    /// Returns the name of the property, or the more common one if it has two names.
    pub fn name(self) -> &'static str {
        ids::NAMES[usize::from(self.0)]
    }

    /// The property with this name, in capitals; `None` if libbarrett's property lists do not contain it.
    pub fn from_name(name: &str) -> Option<Property> {
        let alias = ids::ALIASES.iter().find(|(alias, _)| *alias == name);
        let named = || Property::all().find(|property| property.name() == name);
        alias.map(|&(_, property)| property).or_else(named)
    }
}

impl fmt::Debug for Property {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl fmt::Display for Property {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl PropertyId {
    /// Creates the id `number`; `None` for a number above 127.
    pub const fn new(number: u8) -> Option<PropertyId> {
        if number & SET_BIT == 0 {
            Some(PropertyId(number))
        } else {
            None
        }
    }

    /// Number, 0 to 127.
    pub const fn number(self) -> u8 {
        self.0
    }

    pub(crate) const fn from_byte(byte: u8) -> PropertyId {
        PropertyId(byte & !SET_BIT)
    }
}

/// A property's value with its width.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Value {
    /// 16 bits.
    Narrow(i16),
    /// 32 bits. A host may send this for properties of either width.
    Wide(i32),
}

impl Value {
    /// The value, sign-extended.
    pub const fn get(self) -> i32 {
        match self {
            Value::Narrow(value) => value as i32,
            Value::Wide(value) => value,
        }
    }

    /// Creates a value of this width; `None` if it does not fit into 16 bits.
    pub fn of_width(value: i32, width: Width) -> Option<Value> {
        match width {
            Width::Narrow => i16::try_from(value).ok().map(Value::Narrow),
            Width::Wide => Some(Value::Wide(value)),
        }
    }
}

/// A property message: a request for a value, or a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PropertyMessage {
    /// Requests a value.
    Get(PropertyId),
    /// Sets a value, or replies with it.
    Set(PropertyId, Value),
}

/// Errors of parsing a property message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PropertyError {
    /// The payload has neither one, four nor six bytes.
    Length(LengthError),
    /// The message is a single byte with the set bit.
    SetWithoutValue(u8),
    /// A value follows a byte without the set bit.
    GetWithValue(u8),
    /// The second byte is not zero.
    Padding(u8),
    /// The message is a request for the property of this id, but a reply was expected.
    NotAReply(PropertyId),
}

impl fmt::Display for PropertyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            PropertyError::Length(error) => write!(f, "property message: {error}"),
            PropertyError::SetWithoutValue(byte) => write!(
                f,
                "property message is the single byte {byte:#04x}, expected a value after its set bit"
            ),
            PropertyError::GetWithValue(byte) => write!(
                f,
                "property message begins with {byte:#04x}, expected bit 0x80 set before a value"
            ),
            PropertyError::Padding(byte) => write!(
                f,
                "second byte of the property message is {byte:#04x}, expected 0"
            ),
            PropertyError::NotAReply(id) => {
                write!(f, "request for property {}, expected a reply", id.0)
            }
        }
    }
}

impl core::error::Error for PropertyError {}

impl PropertyMessage {
    /// Parses a property message. Does not check sender and destination.
    ///
    /// # Errors
    /// See [`PropertyError`].
    pub fn parse(frame: &CanFrame) -> Result<PropertyMessage, PropertyError> {
        let (head, padding, value) = match *frame.payload() {
            [head] if head & SET_BIT == 0 => return Ok(PropertyMessage::Get(PropertyId(head))),
            [head] => return Err(PropertyError::SetWithoutValue(head)),
            [head, padding, a, b] => (head, padding, Value::Narrow(i16::from_le_bytes([a, b]))),
            [head, padding, a, b, c, d] => {
                let value = i32::from_le_bytes([a, b, c, d]);
                (head, padding, Value::Wide(value))
            }
            _ => return Err(PropertyError::Length(LengthError::of(frame, &[1, 4, 6]))),
        };
        if head & SET_BIT == 0 {
            return Err(PropertyError::GetWithValue(head));
        }
        if padding != 0 {
            return Err(PropertyError::Padding(padding));
        }
        Ok(PropertyMessage::Set(PropertyId::from_byte(head), value))
    }

    /// Encodes the frame from a node to a node or group.
    pub const fn emit(&self, from: NodeId, to: Destination) -> CanFrame {
        let id = MessageId::new(from, to);
        match *self {
            PropertyMessage::Get(property) => CanFrame::of(id.can_id(), [property.0]),
            PropertyMessage::Set(property, Value::Narrow(value)) => {
                let [a, b] = value.to_le_bytes();
                CanFrame::of(id.can_id(), [property.0 | SET_BIT, 0, a, b])
            }
            PropertyMessage::Set(property, Value::Wide(value)) => {
                let [a, b, c, d] = value.to_le_bytes();
                CanFrame::of(id.can_id(), [property.0 | SET_BIT, 0, a, b, c, d])
            }
        }
    }
}

/// Encodes the host's request for a property.
pub fn get(to: impl Into<Destination>, property: PropertyId) -> CanFrame {
    PropertyMessage::Get(property).emit(NodeId::HOST, to.into())
}

/// Encodes the frame with which the host sets a property. Pucks do not answer it; read [`Property::STAT`] to check that the
/// puck has processed it.
pub fn set(to: impl Into<Destination>, property: PropertyId, value: Value) -> CanFrame {
    PropertyMessage::Set(property, value).emit(NodeId::HOST, to.into())
}

/// A puck's answer to a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reply {
    /// Property id.
    pub property: PropertyId,
    /// Its value.
    pub value: Value,
}

impl Reply {
    /// Parses a frame to [`GroupId::REPLY`]. Does not check sender and destination.
    ///
    /// # Errors
    /// See [`PropertyError`]; a request is also an error.
    pub fn parse(frame: &CanFrame) -> Result<Reply, PropertyError> {
        match PropertyMessage::parse(frame)? {
            PropertyMessage::Set(property, value) => Ok(Reply { property, value }),
            PropertyMessage::Get(property) => Err(PropertyError::NotAReply(property)),
        }
    }

    /// Encodes the frame that node `from` sends.
    pub const fn emit(&self, from: NodeId) -> CanFrame {
        let message = PropertyMessage::Set(self.property, self.value);
        message.emit(from, Destination::Group(GroupId::REPLY))
    }
}
