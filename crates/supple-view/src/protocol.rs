//! Messages of the Foxglove WebSocket protocol, version 1, which the page and other viewers such as Lichtblick use.
//! Source: <https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md>.
//!
//! This module replaces the Foxglove SDK because the server of the SDK accepts every client, and this server moves an arm.

use crate::command::{PARAMETERS, SCHEMA, parameter};
use crate::snapshot::Snapshot;
use serde::Deserialize;
use serde_json::{Value, json};

/// Subprotocols that viewers request: the name of the protocol, and the name that newer clients use for the same messages.
pub const SUBPROTOCOLS: [&str; 2] = ["foxglove.websocket.v1", "foxglove.sdk.v1"];
/// Id of the service that takes commands.
pub const SERVICE_ID: u32 = 1;
/// Name of the service that takes commands.
pub const SERVICE_NAME: &str = "/request";

/// Opcode of a message on a subscribed channel.
const MESSAGE_DATA: u8 = 1;
/// Opcode of a request to a service.
const SERVICE_CALL_REQUEST: u8 = 2;
/// Opcode of a response of a service.
const SERVICE_CALL_RESPONSE: u8 = 3;

/// A channel that viewers can subscribe to; its id is its index.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Channel {
    /// Topic.
    pub topic: String,
    /// Encoding of the messages.
    pub encoding: &'static str,
    /// Name of the message type.
    pub schema_name: String,
    /// Encoding of the definition of the message type.
    pub schema_encoding: &'static str,
    /// Definition of the message type.
    pub schema: String,
}

/// Text message of a viewer.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(tag = "op", rename_all = "camelCase")]
pub enum ClientMessage {
    /// Subscribes to channels.
    Subscribe {
        /// The subscriptions.
        subscriptions: Vec<Subscription>,
    },
    /// Ends subscriptions.
    #[serde(rename_all = "camelCase")]
    Unsubscribe {
        /// Ids of the subscriptions.
        subscription_ids: Vec<u32>,
    },
    /// Requests parameters.
    #[serde(rename_all = "camelCase")]
    GetParameters {
        /// Names of the parameters; an empty list requests all.
        parameter_names: Vec<String>,
        /// Id that the answer repeats.
        id: Option<String>,
    },
    /// Changes parameters.
    SetParameters {
        /// The parameters.
        parameters: Vec<Parameter>,
        /// Id that the answer repeats.
        id: Option<String>,
    },
    /// Requests the values of all parameters whenever they change; parameter names are ignored.
    SubscribeParameterUpdates {},
    /// Ends the updates of parameters.
    UnsubscribeParameterUpdates {},
    /// Any other message, which needs no answer.
    #[serde(other)]
    Other,
}

/// A subscription to a channel.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "camelCase")]
pub struct Subscription {
    /// Id of the subscription, chosen by the viewer.
    pub id: u32,
    /// Id of the channel.
    pub channel_id: u32,
}

/// A parameter to change.
#[derive(Clone, Debug, Deserialize, PartialEq)]
pub struct Parameter {
    /// Name of the parameter.
    pub name: String,
    /// Value of the parameter.
    #[serde(default)]
    pub value: Value,
}

/// A request to a service.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ServiceCall<'a> {
    /// Id of the service.
    pub service_id: u32,
    /// Id of the call, chosen by the viewer.
    pub call_id: u32,
    /// Data of the request.
    pub payload: &'a [u8],
}

/// Creates the message `serverInfo`, which a viewer receives first.
pub fn server_info(name: &str, session: &str, accepts_commands: bool) -> String {
    let capabilities: &[&str] = match accepts_commands {
        true => &["parameters", "parametersSubscribe", "services"],
        false => &["parameters", "parametersSubscribe"],
    };
    json!({"op": "serverInfo", "name": name, "capabilities": capabilities, "supportedEncodings": ["json"],
           "metadata": {}, "sessionId": session})
    .to_string()
}

/// Creates the message `advertise` with the channels.
pub fn advertise(channels: &[Channel]) -> String {
    let channels: Vec<Value> = channels
        .iter()
        .enumerate()
        .map(|(id, channel)| {
            json!({"id": id, "topic": channel.topic, "encoding": channel.encoding,
                   "schemaName": channel.schema_name, "schemaEncoding": channel.schema_encoding,
                   "schema": channel.schema})
        })
        .collect();
    json!({"op": "advertise", "channels": channels}).to_string()
}

/// Creates the message `advertiseServices` with the service that takes commands.
pub fn advertise_services() -> String {
    let described = |name: &str, schema: &str| json!({"encoding": "json", "schemaName": name, "schemaEncoding": "jsonschema", "schema": schema});
    json!({"op": "advertiseServices", "services": [{
        "id": SERVICE_ID, "name": SERVICE_NAME, "type": "supple/Request",
        "request": described("supple.Request", SCHEMA),
        "response": described("supple.Reply", r#"{"type":"object"}"#),
    }]})
    .to_string()
}

/// Creates the message `parameterValues` for these names, or for all parameters if `names` is empty.
pub fn parameter_values(snapshot: Option<&Snapshot>, names: &[String], id: Option<&str>) -> String {
    let wanted = |name: &&&str| names.is_empty() || names.iter().any(|other| other == **name);
    let value = |name: &&str| {
        let value = parameter(snapshot?, name)?;
        Some(json!({"name": name, "type": "float64_array", "value": value}))
    };
    let parameters: Vec<Value> = PARAMETERS.iter().filter(wanted).filter_map(value).collect();
    let mut message = json!({"op": "parameterValues", "parameters": parameters});
    if let Some(id) = id {
        message["id"] = json!(id);
    }
    message.to_string()
}

/// Creates a status message; level 2 is an error.
pub fn status(level: u8, message: &str) -> String {
    json!({"op": "status", "level": level, "message": message}).to_string()
}

/// Creates the message for a failed service call.
pub fn call_failure(call: &ServiceCall<'_>, message: &str) -> String {
    json!({"op": "serviceCallFailure", "serviceId": call.service_id, "callId": call.call_id, "message": message})
        .to_string()
}

/// Creates a message on a channel for this subscription.
pub fn message_data(subscription: u32, time_ns: u64, payload: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(13 + payload.len());
    bytes.push(MESSAGE_DATA);
    bytes.extend_from_slice(&subscription.to_le_bytes());
    bytes.extend_from_slice(&time_ns.to_le_bytes());
    bytes.extend_from_slice(payload);
    bytes
}

/// Creates the response to a service call, in JSON.
pub fn call_response(call: &ServiceCall<'_>, payload: &[u8]) -> Vec<u8> {
    let mut bytes = vec![SERVICE_CALL_RESPONSE];
    bytes.extend_from_slice(&call.service_id.to_le_bytes());
    bytes.extend_from_slice(&call.call_id.to_le_bytes());
    bytes.extend_from_slice(&4_u32.to_le_bytes());
    bytes.extend_from_slice(b"json");
    bytes.extend_from_slice(payload);
    bytes
}

/// Parses a binary message of a viewer; returns `None` if it is not a service call in JSON.
pub fn service_call(bytes: &[u8]) -> Option<ServiceCall<'_>> {
    let (&SERVICE_CALL_REQUEST, rest) = bytes.split_first()? else {
        return None;
    };
    let (service, rest) = rest.split_first_chunk::<4>()?;
    let (call, rest) = rest.split_first_chunk::<4>()?;
    let (length, rest) = rest.split_first_chunk::<4>()?;
    let length = usize::try_from(u32::from_le_bytes(*length)).ok()?;
    let (encoding, payload) = rest.split_at_checked(length)?;
    (encoding == b"json").then_some(ServiceCall {
        service_id: u32::from_le_bytes(*service),
        call_id: u32::from_le_bytes(*call),
        payload,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encoded_messages_equal_the_specification() {
        // Section "Message Data": opcode, subscription, time, payload, little-endian.
        let message = message_data(0x0102, 0x0304, b"ab");
        assert_eq!(message, [1, 2, 1, 0, 0, 4, 3, 0, 0, 0, 0, 0, 0, b'a', b'b']);
        let bytes = [&[2, 1, 0, 0, 0, 9, 0, 0, 0, 4, 0, 0, 0][..], b"json{}"].concat();
        let call = service_call(&bytes).expect("a call");
        assert_eq!(
            (call.service_id, call.call_id, call.payload),
            (1, 9, &b"{}"[..])
        );
        let response = call_response(&call, b"{}");
        assert_eq!(response[1..], bytes[1..]);
        assert_eq!(response[0], 3);
        for end in 0..13 + 4 {
            assert_eq!(service_call(&bytes[..end]), None, "{end}");
        }
        let huge = [
            &[2, 1, 0, 0, 0, 9, 0, 0, 0, 255, 255, 255, 255][..],
            b"json",
        ]
        .concat();
        assert_eq!(service_call(&huge), None);
    }

    #[test]
    fn messages_of_viewers_are_parsed_and_unknown_ones_ignored() {
        let read = |text: &str| serde_json::from_str::<ClientMessage>(text);
        let subscribe = r#"{"op":"subscribe","subscriptions":[{"id":7,"channelId":2}]}"#;
        let subscriptions = vec![Subscription {
            id: 7,
            channel_id: 2,
        }];
        assert_eq!(
            read(subscribe).ok(),
            Some(ClientMessage::Subscribe { subscriptions })
        );
        let end = r#"{"op":"unsubscribe","subscriptionIds":[7]}"#;
        let subscription_ids = vec![7];
        assert_eq!(
            read(end).ok(),
            Some(ClientMessage::Unsubscribe { subscription_ids })
        );
        let other = r#"{"op":"subscribeConnectionGraph"}"#;
        assert_eq!(read(other).ok(), Some(ClientMessage::Other));
        let updates = r#"{"op":"subscribeParameterUpdates","parameterNames":["a"]}"#;
        assert_eq!(
            read(updates).ok(),
            Some(ClientMessage::SubscribeParameterUpdates {})
        );
        assert!(read("{}").is_err());
    }
}
