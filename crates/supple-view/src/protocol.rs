//! Messages of the Foxglove WebSocket protocol, version 1: what stock viewers such as Lichtblick speak, and the page too.
//! Source: <https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md>.
//!
//! Written here and not taken from the Foxglove SDK: its server accepts whoever connects, and this one moves an arm.

use crate::command::{PARAMETERS, SCHEMA, parameter};
use crate::snapshot::Snapshot;
use serde::Deserialize;
use serde_json::{Value, json};

/// Subprotocols that viewers ask for: the protocol's own name, and that of newer clients for the same messages.
pub const SUBPROTOCOLS: [&str; 2] = ["foxglove.websocket.v1", "foxglove.sdk.v1"];
/// Id of the service that takes commands.
pub const SERVICE_ID: u32 = 1;
/// Name of this service.
pub const SERVICE_NAME: &str = "/request";

/// Opcode of a message on a subscribed channel.
const MESSAGE_DATA: u8 = 1;
/// Opcode of a request to a service.
const SERVICE_CALL_REQUEST: u8 = 2;
/// Opcode of its response.
const SERVICE_CALL_RESPONSE: u8 = 3;

/// A channel that viewers can subscribe to; its id is its index.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Channel {
    /// Topic.
    pub topic: String,
    /// Encoding of its messages.
    pub encoding: &'static str,
    /// Name of their type.
    pub schema_name: String,
    /// Encoding of its definition.
    pub schema_encoding: &'static str,
    /// The definition.
    pub schema: String,
}

/// What a viewer sends as text.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(tag = "op", rename_all = "camelCase")]
pub enum ClientMessage {
    /// Channels to send from now on.
    Subscribe {
        /// Each with the id under which its messages are sent.
        subscriptions: Vec<Subscription>,
    },
    /// Subscriptions to end.
    #[serde(rename_all = "camelCase")]
    Unsubscribe {
        /// Their ids.
        subscription_ids: Vec<u32>,
    },
    /// Asks for parameters.
    #[serde(rename_all = "camelCase")]
    GetParameters {
        /// Names; none for all.
        parameter_names: Vec<String>,
        /// To be repeated in the answer.
        id: Option<String>,
    },
    /// Changes parameters.
    SetParameters {
        /// Name and value of each.
        parameters: Vec<Parameter>,
        /// To be repeated in the answer.
        id: Option<String>,
    },
    /// Asks for the values of parameters whenever they change: of all, whatever the names.
    SubscribeParameterUpdates {},
    /// Ends that.
    UnsubscribeParameterUpdates {},
    /// Anything else, which needs no answer.
    #[serde(other)]
    Other,
}

/// A channel to send.
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
    /// Its name.
    pub name: String,
    /// Its value.
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
    /// Its data.
    pub payload: &'a [u8],
}

/// The message `serverInfo`, the first to a viewer.
pub fn server_info(name: &str, session: &str, accepts_commands: bool) -> String {
    let capabilities: &[&str] = match accepts_commands {
        true => &["parameters", "parametersSubscribe", "services"],
        false => &["parameters", "parametersSubscribe"],
    };
    json!({"op": "serverInfo", "name": name, "capabilities": capabilities, "supportedEncodings": ["json"],
           "metadata": {}, "sessionId": session})
    .to_string()
}

/// The message `advertise`, with the channels.
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

/// The message `advertiseServices`, with the service that takes commands.
pub fn advertise_services() -> String {
    let described = |name: &str, schema: &str| json!({"encoding": "json", "schemaName": name, "schemaEncoding": "jsonschema", "schema": schema});
    json!({"op": "advertiseServices", "services": [{
        "id": SERVICE_ID, "name": SERVICE_NAME, "type": "supple/Request",
        "request": described("supple.Request", SCHEMA),
        "response": described("supple.Reply", r#"{"type":"object"}"#),
    }]})
    .to_string()
}

/// The message `parameterValues`, for these names, or for all parameters if there are none.
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

/// A status message; level 2 is an error.
pub fn status(level: u8, message: &str) -> String {
    json!({"op": "status", "level": level, "message": message}).to_string()
}

/// A failed call of a service.
pub fn call_failure(call: &ServiceCall<'_>, message: &str) -> String {
    json!({"op": "serviceCallFailure", "serviceId": call.service_id, "callId": call.call_id, "message": message})
        .to_string()
}

/// A message on a channel, to this subscription.
pub fn message_data(subscription: u32, time_ns: u64, payload: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(13 + payload.len());
    bytes.push(MESSAGE_DATA);
    bytes.extend_from_slice(&subscription.to_le_bytes());
    bytes.extend_from_slice(&time_ns.to_le_bytes());
    bytes.extend_from_slice(payload);
    bytes
}

/// The response to a call of a service, in JSON.
pub fn call_response(call: &ServiceCall<'_>, payload: &[u8]) -> Vec<u8> {
    let mut bytes = vec![SERVICE_CALL_RESPONSE];
    bytes.extend_from_slice(&call.service_id.to_le_bytes());
    bytes.extend_from_slice(&call.call_id.to_le_bytes());
    bytes.extend_from_slice(&4_u32.to_le_bytes());
    bytes.extend_from_slice(b"json");
    bytes.extend_from_slice(payload);
    bytes
}

/// Parses a binary message of a viewer; `None` if it is no call of a service in JSON.
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
    fn bytes_are_those_of_the_specification() {
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
    fn messages_of_viewers_are_read_and_unknown_ones_ignored() {
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
