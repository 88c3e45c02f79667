//! One WebSocket connection: reads the messages of the viewer and writes the messages that wait for it.

use crate::calls::{PendingCalls, ReplyTo};
use crate::command::{Command, set_parameters};
use crate::hub::{Answer, Hub, Viewer};
use crate::protocol::{
    ClientMessage, SERVICE_ID, ServiceCall, advertise, advertise_services, call_failure,
    call_response, parameter_values, server_info, service_call, status,
};
use core::time::Duration;
use std::net::TcpStream;
use std::time::Instant;
use supple_ipc::Domain;
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Error, Message, WebSocket};

/// Timeout of a read, after which waiting messages are written.
const READ_TIMEOUT: Duration = Duration::from_millis(10);
/// Timeout of a write to a viewer that does not read.
const WRITE_TIMEOUT: Duration = Duration::from_secs(2);
/// Maximum length of a message of a viewer \[bytes\].
const MAX_MESSAGE_BYTES: usize = 64 * 1024;
/// Time between two messages with changed parameters.
const PARAMETER_INTERVAL: Duration = Duration::from_millis(200);

/// Data of the server that a connection uses.
pub struct Context<'a> {
    /// State shared by the threads.
    pub hub: &'a Hub,
    /// The running system; `None` for a log.
    pub domain: Option<&'a Domain>,
    /// Name of the running system or of the log.
    pub name: &'a str,
    /// Id of this run of the server; not secret.
    pub session: &'a str,
}

/// Serves a viewer after the handshake; `rest` is the data that the viewer sent after it.
///
/// # Errors
/// If the connection fails.
pub fn serve(
    context: &Context<'_>,
    viewer: &Viewer,
    stream: TcpStream,
    rest: Vec<u8>,
) -> Result<(), Error> {
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(READ_TIMEOUT))?;
    stream.set_write_timeout(Some(WRITE_TIMEOUT))?;
    let config = WebSocketConfig::default()
        .max_message_size(Some(MAX_MESSAGE_BYTES))
        .max_frame_size(Some(MAX_MESSAGE_BYTES));
    let mut socket = WebSocket::from_partially_read(stream, rest, Role::Server, Some(config));
    let hub = context.hub;
    let commands = hub.accepts_commands();
    let info = server_info(context.name, context.session, commands);
    socket.send(Message::text(info))?;
    socket.send(Message::text(advertise(hub.channels())))?;
    if commands {
        socket.send(Message::text(advertise_services()))?;
    }
    let mut updates = ParameterUpdates::default();
    let mut calls = PendingCalls::default();
    loop {
        match socket.read() {
            Ok(Message::Text(text)) => {
                for answer in text_message(context, viewer, &mut updates, &mut calls, &text) {
                    socket.send(Message::text(answer))?;
                }
            }
            Ok(Message::Binary(bytes)) => {
                if let Some(answer) = binary_message(context, &mut calls, &bytes) {
                    socket.send(answer)?;
                }
            }
            Ok(_) => {}
            Err(Error::Io(error)) if is_timeout(&error) => {}
            Err(error) => return Err(error),
        }
        for (reply_to, answer) in calls.take_answers() {
            for message in replies(hub, reply_to, answer) {
                socket.send(message)?;
            }
        }
        if let Some(text) = updates.due(hub) {
            socket.write(Message::text(text))?;
        }
        while let Some(message) = viewer.next() {
            socket.write(Message::binary(message))?;
        }
        socket.flush()?;
    }
}

/// Sends changed parameters to a viewer that has subscribed to them.
#[derive(Default)]
struct ParameterUpdates {
    subscribed: bool,
    sent: Option<([f32; 3], [f32; 3], Instant)>,
}

impl ParameterUpdates {
    fn due(&mut self, hub: &Hub) -> Option<String> {
        let waits = |(_, _, at): ([f32; 3], [f32; 3], Instant)| at.elapsed() < PARAMETER_INTERVAL;
        if !self.subscribed || self.sent.is_some_and(waits) {
            return None;
        }
        let snapshot = hub.latest()?;
        let (stiffness, damping) = (snapshot.stiffness_n_per_m, snapshot.damping_n_s_per_m);
        let changed = self
            .sent
            .is_none_or(|(k, b, _)| (k, b) != (stiffness, damping));
        self.sent = Some((stiffness, damping, Instant::now()));
        changed.then(|| parameter_values(Some(&snapshot), &[], None))
    }
}

fn is_timeout(error: &std::io::Error) -> bool {
    use std::io::ErrorKind;
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut)
}

/// Handles a text message of the viewer; returns the answers that are available at once.
fn text_message(
    context: &Context<'_>,
    viewer: &Viewer,
    updates: &mut ParameterUpdates,
    calls: &mut PendingCalls,
    text: &str,
) -> Vec<String> {
    let hub = context.hub;
    let message = match serde_json::from_str(text) {
        Ok(message) => message,
        Err(error) => return vec![status(2, &format!("the message is invalid: {error}"))],
    };
    match message {
        ClientMessage::Subscribe { subscriptions } => {
            for subscription in subscriptions {
                if (subscription.channel_id as usize) < hub.channels().len() {
                    hub.subscribe(viewer, subscription.id, subscription.channel_id);
                }
            }
            Vec::new()
        }
        ClientMessage::Unsubscribe { subscription_ids } => {
            for id in subscription_ids {
                viewer.unsubscribe(id);
            }
            Vec::new()
        }
        ClientMessage::GetParameters {
            parameter_names,
            id,
        } => {
            let snapshot = hub.latest();
            vec![parameter_values(
                snapshot.as_ref(),
                &parameter_names,
                id.as_deref(),
            )]
        }
        ClientMessage::SetParameters { parameters, id } => {
            let values: Vec<_> = parameters.into_iter().map(|p| (p.name, p.value)).collect();
            match set_parameters(&values) {
                Ok(command) => {
                    let reply_to = ReplyTo::Parameters(id);
                    calls.start(hub, context.domain, command, reply_to);
                    Vec::new()
                }
                Err(reason) => parameter_reply(hub, id.as_deref(), Some(&reason)),
            }
        }
        ClientMessage::SubscribeParameterUpdates {} => {
            updates.subscribed = true;
            Vec::new()
        }
        ClientMessage::UnsubscribeParameterUpdates {} => {
            updates.subscribed = false;
            Vec::new()
        }
        ClientMessage::Other => Vec::new(),
    }
}

/// Handles a binary message of the viewer, which must be a service call; returns an answer that is available at once.
fn binary_message(
    context: &Context<'_>,
    calls: &mut PendingCalls,
    bytes: &[u8],
) -> Option<Message> {
    let call = service_call(bytes)?;
    if call.service_id != SERVICE_ID {
        let reason = "this service does not exist";
        return Some(Message::text(call_failure(&call, reason)));
    }
    match Command::parse(call.payload) {
        Ok(command) => {
            let reply_to = ReplyTo::Call {
                service_id: call.service_id,
                call_id: call.call_id,
            };
            calls.start(context.hub, context.domain, command, reply_to);
            None
        }
        Err(reason) => Some(Message::text(call_failure(&call, &reason))),
    }
}

/// Creates the messages that report the result of a command to a viewer.
fn replies(hub: &Hub, reply_to: ReplyTo, answer: Answer) -> Vec<Message> {
    match reply_to {
        ReplyTo::Parameters(id) => {
            let texts = parameter_reply(hub, id.as_deref(), answer.err().as_deref());
            texts.into_iter().map(Message::text).collect()
        }
        ReplyTo::Call {
            service_id,
            call_id,
        } => {
            let call = ServiceCall {
                service_id,
                call_id,
                payload: &[],
            };
            vec![match answer {
                Ok(mode) => {
                    let reply = serde_json::json!({"accepted": true, "mode": mode}).to_string();
                    Message::binary(call_response(&call, reply.as_bytes()))
                }
                Err(reason) => Message::text(call_failure(&call, &reason)),
            }]
        }
    }
}

/// Creates the message with the present parameters, preceded by the reason why they could not be set, if any.
fn parameter_reply(hub: &Hub, id: Option<&str>, refused: Option<&str>) -> Vec<String> {
    let snapshot = hub.latest();
    let now = parameter_values(snapshot.as_ref(), &[], id);
    let refused = refused.map(|reason| status(2, reason));
    refused.into_iter().chain([now]).collect()
}
