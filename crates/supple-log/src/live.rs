//! The messages of a log for connected live viewers: the same channels, message definitions and bytes.

use crate::cdr;
use crate::emit::{Extras, MessageSink, Topic, base_frame, emit};
use crate::error::LogError;
use serde::Serialize;
use supple_core::controller::CycleRecord;
use supple_model::Description;

/// The channels of a running system, in the order of [`LiveMessage::channel`].
const TOPICS: [Topic; 7] = [
    Topic::RobotDescription,
    Topic::ControllerState,
    Topic::JointStates,
    Topic::WrenchExt,
    Topic::WrenchObserved,
    Topic::Tf,
    Topic::CycleTiming,
];

/// A channel with its message definition; the encoding of its messages is `cdr`, that of the definition `ros2msg`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LiveChannel {
    /// Topic.
    pub topic: String,
    /// Name of the message type.
    pub schema_name: String,
    /// Message definition.
    pub schema: String,
}

/// A message of a channel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LiveMessage {
    /// Index of the channel in [`LiveEncoder::channels`].
    pub channel: usize,
    /// The bytes of the message.
    pub data: Vec<u8>,
}

/// Encodes the steps of an arm with `N` joints.
#[derive(Debug)]
pub struct LiveEncoder<const N: usize> {
    description: Description,
    base: String,
    words: Vec<u64>,
}

impl<const N: usize> LiveEncoder<N> {
    /// Creates an encoder for this arm.
    ///
    /// # Errors
    /// [`LogError::Model`] if the description does not have `N` joints.
    pub fn new(description: &Description) -> Result<Self, LogError> {
        let home = description.home::<N>()?;
        Ok(LiveEncoder {
            base: base_frame(description, home.as_slice())?,
            description: description.clone(),
            words: Vec::new(),
        })
    }

    /// Returns all channels.
    ///
    /// # Errors
    /// [`LogError::Format`] if a message type is not defined, which would be a bug.
    pub fn channels() -> Result<Vec<LiveChannel>, LogError> {
        let channel = |topic: &Topic| {
            let channel = topic.channel(N).map_err(unencodable)?;
            Ok(LiveChannel {
                topic: channel.topic.clone(),
                schema_name: channel.schema.name.clone(),
                schema: String::from_utf8_lossy(&channel.schema.text).into_owned(),
            })
        };
        TOPICS.iter().map(channel).collect()
    }

    /// Returns the message with the URDF, which a viewer needs once.
    ///
    /// # Errors
    /// [`LogError::Format`] if the URDF cannot be encoded.
    pub fn robot_description(&mut self) -> Result<LiveMessage, LogError> {
        let mut messages = Messages {
            words: &mut self.words,
            put: Vec::new(),
        };
        let text = self.description.urdf().to_owned();
        messages.put(Topic::RobotDescription, 0, 0, &text)?;
        let first = messages.put.pop();
        first.ok_or_else(|| unencodable("no message".to_owned()))
    }

    /// Returns the messages of a step, as in a log, but always with the transforms of the links. `time_ns` counts from the epoch.
    ///
    /// # Errors
    /// [`LogError::Format`] if a message cannot be encoded.
    pub fn encode(
        &mut self,
        time_ns: u64,
        record: &CycleRecord<N>,
        extras: &Extras<N>,
    ) -> Result<Vec<LiveMessage>, LogError> {
        let mut messages = Messages {
            words: &mut self.words,
            put: Vec::new(),
        };
        let arm = (&self.description, self.base.as_str());
        emit(&mut messages, arm, time_ns, record, extras, true)?;
        Ok(messages.put)
    }
}

/// Collects messages.
struct Messages<'a> {
    words: &'a mut Vec<u64>,
    put: Vec<LiveMessage>,
}

impl MessageSink for Messages<'_> {
    fn words(&mut self) -> &mut Vec<u64> {
        self.words
    }

    fn put<T: Serialize>(
        &mut self,
        channel: Topic,
        _step: u64,
        _time_ns: u64,
        value: &T,
    ) -> Result<(), LogError> {
        let Some(channel) = TOPICS.iter().position(|topic| *topic == channel) else {
            return Ok(());
        };
        let mut data = Vec::new();
        cdr::encode(value, &mut data).map_err(|error| unencodable(error.to_string()))?;
        self.put.push(LiveMessage { channel, data });
        Ok(())
    }
}

fn unencodable(message: String) -> LogError {
    LogError::Format {
        file: "live messages".to_owned(),
        message,
    }
}
