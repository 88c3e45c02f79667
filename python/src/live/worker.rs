//! The thread that owns the ports of a connection: iceoryx2's ports stay in the thread that created them.
//!
//! The thread keeps the last telemetry for readers, sends requests and forwards replies. It computes nothing.

use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, channel, sync_channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};
use supple_ipc::message::{OperatorReply, Outcome, Telemetry};
use supple_ipc::{CommandSlot, Domain, IpcError, OperatorClient, TelemetryReader};

/// Number of cycles that are kept for readers.
pub const HISTORY: usize = 8192;
/// Time between two checks for telemetry without a request.
const POLL: Duration = Duration::from_millis(1);
/// Timeout for a reply.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(5);

/// Sends a request; returns its sequence number, or `None` if no controller receives it.
pub type Send =
    Box<dyn FnOnce(&mut OperatorClient) -> Result<Option<u64>, IpcError> + std::marker::Send>;

/// Why a request was not carried out.
#[derive(Debug, thiserror::Error)]
pub enum RequestError {
    /// Shared memory failed, or another program commands the system.
    #[error(transparent)]
    Ipc(#[from] IpcError),
    /// The controller refused the request, with its reason.
    #[error("{0}")]
    Refused(String),
    /// The connection has ended, with the reason.
    #[error("the connection has ended: {0}")]
    Ended(String),
    /// No controller answers.
    #[error("no controller answers: it has ended, or its queue of requests is full")]
    NoAnswer,
}

/// Telemetry that the thread shares with readers.
#[derive(Default)]
pub struct History {
    /// The last cycles, oldest first.
    pub cycles: VecDeque<Telemetry>,
    /// Number of earlier cycles that are no longer kept.
    pub dropped: u64,
    /// Number of cycles that this connection did not receive.
    pub lost: u64,
    /// Why the thread ended, if it did.
    pub ended: Option<String>,
    /// The controller's answer to the last set-point that it refused.
    pub refused_set_point: Option<String>,
}

impl History {
    /// Number of cycles received so far.
    pub fn received(&self) -> u64 {
        self.dropped + self.cycles.len() as u64
    }
}

#[derive(Default)]
struct Shared {
    history: Mutex<History>,
    changed: Condvar,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, History> {
        self.history.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

enum Command {
    /// A request whose reply is awaited.
    Request(Send, SyncSender<Result<OperatorReply, RequestError>>),
    /// A set-point, whose reply is kept if it is a refusal.
    SetPoint(Send),
}

/// A connection; dropping it ends the thread.
pub struct Worker {
    shared: Arc<Shared>,
    commands: Option<Sender<Command>>,
    thread: Option<JoinHandle<()>>,
}

impl Worker {
    /// Starts the thread and waits until it has opened its port.
    pub fn start(domain: Domain) -> Result<Worker, IpcError> {
        let shared = Arc::new(Shared::default());
        let (commands, to_send) = channel();
        let (ready, is_ready) = sync_channel(1);
        let of_thread = Arc::clone(&shared);
        let thread = Builder::new()
            .name("supple-connection".to_owned())
            .spawn(move || match TelemetryReader::new(&domain) {
                Ok(reader) => {
                    let _ = ready.send(Ok(()));
                    let ended = work(&domain, reader, &of_thread, &to_send);
                    of_thread.lock().ended = Some(match ended {
                        Ok(()) => "the connection is closed".to_owned(),
                        Err(error) => error.to_string(),
                    });
                    of_thread.changed.notify_all();
                }
                Err(error) => drop(ready.send(Err(error))),
            });
        let thread = thread.map_err(|error| IpcError::Service {
            service: "the thread of the connection".to_owned(),
            cause: error.to_string(),
        })?;
        match is_ready.recv() {
            Ok(Ok(())) => Ok(Worker {
                shared,
                commands: Some(commands),
                thread: Some(thread),
            }),
            Ok(Err(error)) => Err(error),
            Err(_) => Err(IpcError::Service {
                service: "the thread of the connection".to_owned(),
                cause: "it has ended".to_owned(),
            }),
        }
    }

    /// Calls `read` with the received telemetry.
    pub fn with_history<T>(&self, read: impl FnOnce(&mut History) -> T) -> T {
        read(&mut self.shared.lock())
    }

    /// Waits until more than `received` cycles have been received, the thread has ended, or the timeout has passed.
    /// Returns whether there are more.
    pub fn wait(&self, received: u64, timeout: Duration) -> bool {
        let start = Instant::now();
        let mut history = self.shared.lock();
        loop {
            if history.received() > received {
                return true;
            }
            let left = timeout.saturating_sub(start.elapsed());
            if left.is_zero() || history.ended.is_some() {
                return false;
            }
            let waited = self.shared.changed.wait_timeout(history, left);
            history = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Sends a request and waits until the controller replies that it carries it out, or has queued it.
    pub fn request(&self, send: Send) -> Result<OperatorReply, RequestError> {
        let (to, answer) = sync_channel(2);
        self.command(Command::Request(send, to))?;
        answer
            .recv_timeout(ANSWER_TIMEOUT)
            .unwrap_or(Err(RequestError::NoAnswer))
    }

    /// Sends a set-point without waiting for its reply.
    pub fn set_point(&self, send: Send) -> Result<(), RequestError> {
        self.command(Command::SetPoint(send))
    }

    fn command(&self, command: Command) -> Result<(), RequestError> {
        let commands = self.commands.as_ref().ok_or(RequestError::NoAnswer)?;
        commands.send(command).map_err(|_| {
            let ended = self.shared.lock().ended.clone();
            ended.map_or(RequestError::NoAnswer, RequestError::Ended)
        })
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        drop(self.commands.take());
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Ports and pending requests of a connection that has commanded something.
struct Commander {
    operator: OperatorClient,
    _slot: CommandSlot,
    pending: Vec<(u64, SyncSender<Result<OperatorReply, RequestError>>)>,
}

impl Commander {
    /// Returns the commander; the first call acquires the right to command.
    fn of<'a>(
        open: &'a mut Option<Commander>,
        domain: &Domain,
    ) -> Result<&'a mut Commander, IpcError> {
        if open.is_none() {
            *open = Some(Commander {
                _slot: CommandSlot::acquire(domain)?,
                operator: OperatorClient::new(domain)?,
                pending: Vec::new(),
            });
        }
        open.as_mut().ok_or_else(|| IpcError::Service {
            service: "operator_request".to_owned(),
            cause: "it is closed".to_owned(),
        })
    }

    fn send(&mut self, send: Send) -> Result<u64, RequestError> {
        send(&mut self.operator)?.ok_or(RequestError::NoAnswer)
    }

    /// Passes replies to waiting requests; the other replies are those of set-points.
    fn replies(&mut self, shared: &Shared) -> Result<(), IpcError> {
        while let Some(reply) = self.operator.receive()? {
            let refused = reply.outcome() == Outcome::Refused;
            let awaited = self
                .pending
                .iter()
                .position(|(of, _)| *of == reply.sequence);
            if let Some(index) = awaited {
                let (_, to) = self.pending.swap_remove(index);
                let answer = match refused {
                    true => Err(RequestError::Refused(reply.text.to_string())),
                    false => Ok(reply),
                };
                // The waiting caller may have given up.
                let _ = to.send(answer);
            } else if refused {
                shared.lock().refused_set_point = Some(reply.text.to_string());
            }
        }
        Ok(())
    }
}

fn work(
    domain: &Domain,
    mut reader: TelemetryReader,
    shared: &Shared,
    commands: &Receiver<Command>,
) -> Result<(), IpcError> {
    let mut commander = None;
    loop {
        match commands.recv_timeout(POLL) {
            Ok(Command::Request(send, to)) => {
                let sent = Commander::of(&mut commander, domain)
                    .map_err(RequestError::from)
                    .and_then(|commander| Ok((commander.send(send)?, commander)));
                match sent {
                    Ok((sequence, commander)) => commander.pending.push((sequence, to)),
                    Err(error) => drop(to.send(Err(error))),
                }
            }
            Ok(Command::SetPoint(send)) => {
                let sent = Commander::of(&mut commander, domain)
                    .map_err(RequestError::from)
                    .and_then(|commander| commander.send(send));
                if let Err(error) = sent {
                    shared.lock().refused_set_point = Some(error.to_string());
                }
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Ok(()),
        }
        receive(&mut reader, shared)?;
        if let Some(commander) = &mut commander {
            commander.replies(shared)?;
        }
    }
}

/// Adds new telemetry to the history.
fn receive(reader: &mut TelemetryReader, shared: &Shared) -> Result<(), IpcError> {
    let mut received = false;
    while let Some(telemetry) = reader.receive()? {
        let mut history = shared.lock();
        if history.cycles.len() == HISTORY {
            history.cycles.pop_front();
            history.dropped += 1;
        }
        history.cycles.push_back(telemetry);
        history.lost = reader.lost();
        received = true;
    }
    if received {
        shared.changed.notify_all();
    }
    Ok(())
}
