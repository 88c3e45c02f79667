//! Client connections of the pendant socket: reads a line from each client without blocking, and answers it.
//!
//! A client that sends nothing stays connected until its slot is needed. Every other client is disconnected after its answer,
//! or after a timeout if it does not read the answer. The numbers of clients of both kinds are bounded.

use core::time::Duration;
use rustix::event::{PollFd, PollFlags, poll};
use std::io::{ErrorKind, Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Sender, SyncSender, sync_channel};

/// Maximum number of clients that have not sent their line yet; a further client replaces the oldest one.
const MAX_CLIENTS_WITHOUT_REQUEST: usize = 16;
/// Maximum number of clients with a pending answer; further commands are executed without an answer.
const MAX_CLIENTS_AWAITING_ANSWER: usize = 32;
/// Maximum length of a line \[bytes\].
const LINE_BYTES: usize = 256;
/// Timeout for an answer, and for writing it to the client.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(2);

/// Time before the next attempt if a connection cannot be accepted.
const ACCEPT_RETRY_INTERVAL: Duration = Duration::from_millis(1);

/// A line of a client, and the channel for its answer.
pub(crate) struct PendantRequest {
    pub line: String,
    pub answer: SyncSender<String>,
}

/// A client that has not sent its line yet.
struct Client {
    stream: UnixStream,
    line: Vec<u8>,
}

/// Result of reading from a client.
enum ReadResult {
    /// The client has not sent a complete line yet.
    Incomplete,
    /// A line, or the data that a client sent before it closed its sending side.
    Line(String),
    /// The line exceeds the maximum length.
    TooLong,
    /// The client has disconnected.
    Disconnected,
}

/// Accepts connections and forwards one line of each client, until the receiver is dropped.
pub(crate) fn serve(listener: &UnixListener, requests: &Sender<PendantRequest>) {
    let awaiting_answer = Arc::new(AtomicUsize::new(0));
    let mut without_request: Vec<Client> = Vec::with_capacity(MAX_CLIENTS_WITHOUT_REQUEST);
    loop {
        wait(listener, &without_request);
        match listener.accept() {
            Ok((stream, _)) if stream.set_nonblocking(true).is_ok() => {
                if without_request.len() == MAX_CLIENTS_WITHOUT_REQUEST {
                    without_request.remove(0);
                }
                without_request.push(Client {
                    stream,
                    line: Vec::with_capacity(LINE_BYTES),
                });
            }
            Err(error) if error.kind() != ErrorKind::WouldBlock => {
                // The usual cause is that no file descriptor is left: the oldest client is disconnected.
                if !without_request.is_empty() {
                    without_request.remove(0);
                }
                std::thread::park_timeout(ACCEPT_RETRY_INTERVAL);
            }
            _ => {}
        }
        let mut index = 0;
        while let Some(client) = without_request.get_mut(index) {
            match client.read_line() {
                ReadResult::Incomplete => index += 1,
                ReadResult::Disconnected => drop(without_request.remove(index)),
                ReadResult::TooLong => {
                    let stream = without_request.remove(index).stream;
                    let text = format!("refused: a request has at most {LINE_BYTES} bytes");
                    write_with_timeout(stream, &text);
                }
                ReadResult::Line(line) => {
                    let stream = without_request.remove(index).stream;
                    if !dispatch(stream, line, requests, &awaiting_answer) {
                        return;
                    }
                }
            }
        }
    }
}

/// Waits until a client connects or sends data.
fn wait(listener: &UnixListener, without_request: &[Client]) {
    let mut polled = vec![PollFd::new(listener, PollFlags::IN)];
    polled.extend(
        without_request
            .iter()
            .map(|client| PollFd::new(&client.stream, PollFlags::IN)),
    );
    // A signal causes one extra iteration.
    let _ = poll(&mut polled, None);
}

impl Client {
    fn read_line(&mut self) -> ReadResult {
        let mut bytes = [0; LINE_BYTES];
        let space = LINE_BYTES - self.line.len();
        let ended = match self.stream.read(&mut bytes[..space]) {
            Ok(0) if self.line.is_empty() => return ReadResult::Disconnected,
            Ok(length) => {
                self.line.extend(&bytes[..length]);
                let has_end = length == 0 || self.line.contains(&b'\n');
                if !has_end && self.line.len() == LINE_BYTES {
                    return ReadResult::TooLong;
                }
                has_end
            }
            Err(error) => match error.kind() {
                ErrorKind::WouldBlock | ErrorKind::Interrupted => false,
                _ => return ReadResult::Disconnected,
            },
        };
        match ended {
            false => ReadResult::Incomplete,
            true => {
                let line = self.line.split(|byte| *byte == b'\n').next();
                ReadResult::Line(String::from_utf8_lossy(line.unwrap_or_default()).into_owned())
            }
        }
    }
}

/// Forwards a line and starts a thread that writes the answer; returns false if the receiver is dropped.
fn dispatch(
    stream: UnixStream,
    line: String,
    requests: &Sender<PendantRequest>,
    awaiting_answer: &Arc<AtomicUsize>,
) -> bool {
    let (answer, receiver) = sync_channel(1);
    if requests.send(PendantRequest { line, answer }).is_err() {
        return false;
    }
    if awaiting_answer.load(Ordering::Relaxed) >= MAX_CLIENTS_AWAITING_ANSWER {
        return true;
    }
    awaiting_answer.fetch_add(1, Ordering::Relaxed);
    let done = awaiting_answer.clone();
    let started = std::thread::Builder::new()
        .name("pendant-answer".to_owned())
        .spawn(move || {
            if let Ok(text) = receiver.recv_timeout(ANSWER_TIMEOUT) {
                write_with_timeout(stream, &text);
            }
            done.fetch_sub(1, Ordering::Relaxed);
        });
    if started.is_err() {
        awaiting_answer.fetch_sub(1, Ordering::Relaxed);
    }
    true
}

fn write_with_timeout(mut stream: UnixStream, text: &str) {
    let ready = stream
        .set_nonblocking(false)
        .and_then(|()| stream.set_write_timeout(Some(ANSWER_TIMEOUT)));
    if ready.is_ok() {
        // The client may have disconnected.
        let _ = writeln!(stream, "{text}");
    }
}
