//! Who is connected to the pendant's socket: lines are collected from all of them, and none holds up another.
//!
//! A client that says nothing keeps its place until others need it; one that does not read its answer is left after a
//! while. The number of both is bounded.

use core::time::Duration;
use rustix::event::{PollFd, PollFlags, poll};
use std::io::{ErrorKind, Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Sender, SyncSender, sync_channel};

/// Clients that have not said their line yet; of more, the one that came first is hung up on.
const SILENT: usize = 16;
/// Clients that wait for their answer, or read it; of more, what they ask is done and not answered.
const ANSWERED: usize = 32;
/// Longest line \[bytes\].
const LINE_BYTES: usize = 256;
/// How long an answer is waited for, and how long its reader.
const ANSWER_WITHIN: Duration = Duration::from_secs(2);

/// How long it is waited before the next attempt where a connection cannot be taken.
const NO_DESCRIPTOR: Duration = Duration::from_millis(1);

/// A line, and where its answer goes.
pub(crate) struct Question {
    pub line: String,
    pub answer: SyncSender<String>,
}

/// One that has not said its line yet.
struct Client {
    stream: UnixStream,
    line: Vec<u8>,
}

/// What came of listening to a client.
enum Said {
    /// Nothing yet, or the beginning of a line.
    NotYet,
    /// All of it.
    Line(String),
    /// It has gone.
    Gone,
}

/// Takes connections and hands on their lines, until nobody takes them any more.
pub(crate) fn serve(listener: &UnixListener, questions: &Sender<Question>) {
    let answering = Arc::new(AtomicUsize::new(0));
    let mut silent: Vec<Client> = Vec::with_capacity(SILENT);
    loop {
        wait(listener, &silent);
        match listener.accept() {
            Ok((stream, _)) if stream.set_nonblocking(true).is_ok() => {
                if silent.len() == SILENT {
                    silent.remove(0);
                }
                silent.push(Client {
                    stream,
                    line: Vec::with_capacity(LINE_BYTES),
                });
            }
            Err(error) if error.kind() != ErrorKind::WouldBlock => {
                // No descriptor is left for it: the oldest gives up his.
                if !silent.is_empty() {
                    silent.remove(0);
                }
                std::thread::park_timeout(NO_DESCRIPTOR);
            }
            _ => {}
        }
        let mut index = 0;
        while let Some(client) = silent.get_mut(index) {
            match client.listen() {
                Said::NotYet => index += 1,
                Said::Gone => drop(silent.remove(index)),
                Said::Line(line) => {
                    let stream = silent.remove(index).stream;
                    if !hand_on(stream, line, questions, &answering) {
                        return;
                    }
                }
            }
        }
    }
}

/// Until a client comes or says something.
fn wait(listener: &UnixListener, silent: &[Client]) {
    let mut waited = vec![PollFd::new(listener, PollFlags::IN)];
    waited.extend(
        silent
            .iter()
            .map(|client| PollFd::new(&client.stream, PollFlags::IN)),
    );
    // A signal in between costs one look.
    let _ = poll(&mut waited, None);
}

impl Client {
    fn listen(&mut self) -> Said {
        let mut bytes = [0; LINE_BYTES];
        let room = LINE_BYTES - self.line.len();
        let ended = match self.stream.read(&mut bytes[..room]) {
            Ok(0) if self.line.is_empty() => return Said::Gone,
            Ok(length) => {
                self.line.extend(&bytes[..length]);
                length == 0 || self.line.contains(&b'\n') || self.line.len() == LINE_BYTES
            }
            Err(error) => match error.kind() {
                ErrorKind::WouldBlock | ErrorKind::Interrupted => false,
                _ => return Said::Gone,
            },
        };
        match ended {
            false => Said::NotYet,
            true => {
                let line = self.line.split(|byte| *byte == b'\n').next();
                Said::Line(String::from_utf8_lossy(line.unwrap_or_default()).into_owned())
            }
        }
    }
}

/// Hands a line on, and has its answer written by a thread of its own; false where nobody takes lines any more.
fn hand_on(
    stream: UnixStream,
    line: String,
    questions: &Sender<Question>,
    answering: &Arc<AtomicUsize>,
) -> bool {
    let (answer, answered) = sync_channel(1);
    if questions.send(Question { line, answer }).is_err() {
        return false;
    }
    if answering.load(Ordering::Relaxed) >= ANSWERED {
        return true;
    }
    answering.fetch_add(1, Ordering::Relaxed);
    let done = answering.clone();
    let started = std::thread::Builder::new()
        .name("pendant-answer".to_owned())
        .spawn(move || {
            if let Ok(text) = answered.recv_timeout(ANSWER_WITHIN) {
                write_within(stream, &text);
            }
            done.fetch_sub(1, Ordering::Relaxed);
        });
    if started.is_err() {
        answering.fetch_sub(1, Ordering::Relaxed);
    }
    true
}

fn write_within(mut stream: UnixStream, text: &str) {
    let ready = stream
        .set_nonblocking(false)
        .and_then(|()| stream.set_write_timeout(Some(ANSWER_WITHIN)));
    if ready.is_ok() {
        // Who asked may have gone.
        let _ = writeln!(stream, "{text}");
    }
}
