//! Test client: HTTP requests and a WebSocket with arbitrary headers.

use serde_json::Value;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};
use tungstenite::protocol::Role;
use tungstenite::{Error, Message, WebSocket};

/// Timeout of a message that must arrive.
const MESSAGE_TIMEOUT: Duration = Duration::from_secs(60);

/// Splits a URL into address and path, such as `http://127.0.0.1:4000/token/`.
pub fn split(url: &str) -> (String, String) {
    let rest = url.split_once("://").expect("a scheme").1;
    let (address, path) = rest.split_once('/').expect("a path");
    (address.to_owned(), format!("/{path}"))
}

/// Sends a request with these header lines; returns status and body.
pub fn get(address: &str, path: &str, headers: &str) -> (u16, String) {
    let mut stream = TcpStream::connect(address).expect("a server");
    stream
        .set_read_timeout(Some(MESSAGE_TIMEOUT))
        .expect("a timeout");
    write!(stream, "GET {path} HTTP/1.1\r\n{headers}\r\n").expect("sent");
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).expect("an answer");
    let answer = String::from_utf8_lossy(&answer).into_owned();
    let (head, body) = answer.split_once("\r\n\r\n").expect("a head");
    let status = head.split(' ').nth(1).and_then(|code| code.parse().ok());
    (status.expect("a status"), body.to_owned())
}

/// Requests a URL as [`get`] does, with the host of the URL.
pub fn get_url(url: &str) -> (u16, String) {
    let (address, path) = split(url);
    get(&address, &path, &format!("Host: {address}\r\n"))
}

/// A connected viewer.
pub struct Client(WebSocket<TcpStream>);

impl Client {
    /// Connects with additional header lines, such as an origin.
    ///
    /// # Errors
    /// The status of a response that is not an upgrade.
    pub fn connect(url: &str, headers: &str) -> Result<Client, u16> {
        let (address, path) = split(url);
        let mut stream = TcpStream::connect(&address).expect("a server");
        stream
            .set_read_timeout(Some(MESSAGE_TIMEOUT))
            .expect("a timeout");
        write!(
            stream,
            "GET {path} HTTP/1.1\r\nHost: {address}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
             Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\
             Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n{headers}\r\n"
        )
        .expect("sent");
        let mut head = Vec::new();
        while !head.ends_with(b"\r\n\r\n") {
            let mut byte = [0];
            stream.read_exact(&mut byte).expect("a head");
            head.push(byte[0]);
        }
        let head = String::from_utf8_lossy(&head).into_owned();
        let status: u16 = head
            .split(' ')
            .nth(1)
            .and_then(|code| code.parse().ok())
            .expect("a status");
        if status != 101 {
            return Err(status);
        }
        assert!(head.contains("s3pPLMBiTxaQ9kYGzzhZRbK+xOo="), "{head}");
        assert!(head.contains("foxglove.websocket.v1"), "{head}");
        Ok(Client(WebSocket::from_raw_socket(
            stream,
            Role::Client,
            None,
        )))
    }

    pub fn send(&mut self, message: &Value) {
        let message = Message::text(message.to_string());
        self.0.send(message).expect("sent");
    }

    /// Waits for the next message for which `wanted` returns a value, and returns it; calls `meanwhile` between messages.
    pub fn wait_for<T>(
        &mut self,
        meanwhile: &mut dyn FnMut(),
        mut wanted: impl FnMut(&Message) -> Option<T>,
    ) -> T {
        let short = Some(Duration::from_millis(5));
        self.0.get_ref().set_read_timeout(short).expect("a timeout");
        let start = Instant::now();
        loop {
            assert!(
                start.elapsed() < MESSAGE_TIMEOUT,
                "the message did not arrive"
            );
            meanwhile();
            match self.0.read() {
                Ok(message) => {
                    if let Some(found) = wanted(&message) {
                        return found;
                    }
                }
                Err(Error::Io(error)) if error.kind() == std::io::ErrorKind::WouldBlock => {}
                Err(error) => panic!("{error}"),
            }
        }
    }

    /// Waits for the next text message with this operation.
    pub fn wait_for_op(&mut self, meanwhile: &mut dyn FnMut(), op: &str) -> Value {
        self.wait_for(meanwhile, |message| {
            let Message::Text(text) = message else {
                return None;
            };
            let value: Value = serde_json::from_str(text.as_str()).expect("JSON");
            (value["op"] == op).then_some(value)
        })
    }

    /// Waits for the next message of this subscription and returns its payload.
    pub fn wait_for_data(&mut self, meanwhile: &mut dyn FnMut(), subscription: u32) -> Vec<u8> {
        self.wait_for(meanwhile, |message| {
            let Message::Binary(bytes) = message else {
                return None;
            };
            let of_this = bytes[0] == 1 && bytes[1..5] == subscription.to_le_bytes();
            of_this.then(|| bytes[13..].to_vec())
        })
    }

    /// Calls the service; returns the reply, or the error message.
    pub fn call(&mut self, meanwhile: &mut dyn FnMut(), command: &Value) -> Result<Value, String> {
        self.begin_call(77, command);
        let (call, answer) = self.wait_for_answer(meanwhile);
        assert_eq!(call, 77);
        answer
    }

    /// Calls the service with this call id, without waiting for the answer.
    pub fn begin_call(&mut self, call: u8, command: &Value) {
        let mut bytes = vec![2, 1, 0, 0, 0, call, 0, 0, 0, 4, 0, 0, 0];
        bytes.extend_from_slice(b"json");
        bytes.extend_from_slice(command.to_string().as_bytes());
        self.0.send(Message::binary(bytes)).expect("sent");
    }

    /// Waits for the next answer to any call; returns it with the id of the call.
    pub fn wait_for_answer(&mut self, meanwhile: &mut dyn FnMut()) -> (u64, Result<Value, String>) {
        self.wait_for(meanwhile, |message| match message {
            Message::Binary(bytes) if bytes[0] == 3 => {
                let call = u64::from(bytes[5]);
                Some((
                    call,
                    Ok(serde_json::from_slice(&bytes[17..]).expect("JSON")),
                ))
            }
            Message::Text(text) => {
                let value: Value = serde_json::from_str(text.as_str()).expect("JSON");
                let failed = value["op"] == "serviceCallFailure";
                let reason = value["message"].as_str().unwrap_or_default().to_owned();
                failed.then(|| (value["callId"].as_u64().expect("an id"), Err(reason)))
            }
            _ => None,
        })
    }

    /// Returns the port of this side of the connection.
    pub fn port(&self) -> u16 {
        let address = self.0.get_ref().local_addr();
        address.expect("an address").port()
    }
}
