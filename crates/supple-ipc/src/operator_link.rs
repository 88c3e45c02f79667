//! Telemetry, operator requests and replies: all messages outside the control path.
//!
//! The control loop's thread never uses these ports, so clients that connect and disconnect do not delay it.
//!
//! Only `operator_request` has several writers, because operators connect and disconnect. The controller checks every
//! request before it executes it, and is the only writer of replies, telemetry and torques.

use crate::cleanup::SharedMemoryCleanup;
use crate::client_slot::{ClientSlot, SlotKind};
use crate::domain::Domain;
use crate::error::IpcError;
use crate::message::{OperatorReply, OperatorRequest, Telemetry};
use crate::port::{Backpressure, QualityOfService, Reader, Writer};
use core::time::Duration;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;
use supple_core::controller::Request;
use supple_realtime::pause;

/// Number of cycles by which a reader may lag before it loses telemetry.
pub const TELEMETRY_DEPTH: usize = 2048;

const TELEMETRY: QualityOfService = QualityOfService {
    name: "telemetry",
    writers: 1,
    readers: 8,
    depth: TELEMETRY_DEPTH,
    overwrite_oldest: false,
};
const REQUESTS: QualityOfService = QualityOfService {
    name: "operator_request",
    writers: 8,
    readers: 1,
    depth: 16,
    overwrite_oldest: false,
};
const REPLIES: QualityOfService = QualityOfService {
    name: "operator_reply",
    writers: 1,
    readers: 8,
    depth: 64,
    overwrite_oldest: true,
};

// General clients (viewers and operators) may hang, so some slots of each service are reserved for the programs that
// run the system (recorders and supervisors). The slots of both kinds add up to the limit of the service.
const VIEWER_SLOTS: SlotKind = SlotKind {
    name: "reader",
    description: "viewers of telemetry",
    slots: 5,
};
const RECORDER_SLOTS: SlotKind = SlotKind {
    name: "recorder",
    description: "recorders of telemetry",
    slots: 3,
};
const OPERATOR_SLOTS: SlotKind = SlotKind {
    name: "operator",
    description: "operators",
    slots: 5,
};
const SUPERVISOR_SLOTS: SlotKind = SlotKind {
    name: "keeper",
    description: "programs that run the system",
    slots: 3,
};
/// Slot of programs that command a running system; only one program at a time, see [`CommandSlot`].
const COMMANDER_SLOTS: SlotKind = SlotKind {
    name: "commander",
    description: "programs that command the system",
    slots: 1,
};
const _: () = assert!(VIEWER_SLOTS.slots + RECORDER_SLOTS.slots == TELEMETRY.readers);
const _: () = assert!(OPERATOR_SLOTS.slots + SUPERVISOR_SLOTS.slots == REQUESTS.writers);
const _: () = assert!(REPLIES.readers == REQUESTS.writers);

/// Poll interval of a waiting reader. Telemetry has no wake-up socket, through which a client could slow the controller
/// down.
const POLL_INTERVAL: Duration = Duration::from_millis(1);

/// The controller's ports for telemetry, requests and replies.
#[derive(Debug)]
pub struct OperatorServer {
    telemetry: Writer<Telemetry>,
    requests: Reader<OperatorRequest>,
    replies: Writer<OperatorReply>,
    _cleanup: SharedMemoryCleanup,
}

impl OperatorServer {
    /// Joins the system as its controller. With [`Backpressure::Block`] a telemetry reader with a full queue blocks the
    /// controller.
    ///
    /// # Errors
    /// [`IpcError::SecondWriter`] if a controller has already joined; other variants of [`IpcError`] if the ports
    /// cannot be opened.
    pub fn new(domain: &Domain, backpressure: Backpressure) -> Result<OperatorServer, IpcError> {
        let bytes = TELEMETRY.bytes_of::<Telemetry>()
            + REPLIES.bytes_of::<OperatorReply>()
            + REQUESTS.bytes_of_reader();
        let (ports, cleanup) = domain.join(bytes, |node| {
            Ok((
                Writer::new(domain, node, &TELEMETRY, backpressure)?,
                Reader::new(domain, node, &REQUESTS)?,
                Writer::new(domain, node, &REPLIES, Backpressure::Drop)?,
            ))
        })?;
        let (telemetry, requests, replies) = ports;
        Ok(OperatorServer {
            telemetry,
            requests,
            replies,
            _cleanup: cleanup,
        })
    }

    /// Publishes the telemetry of a cycle.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn publish(&self, telemetry: &Telemetry) -> Result<(), IpcError> {
        self.telemetry.send(telemetry).map(|_| ())
    }

    /// Returns the oldest unread request.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn request(&self) -> Result<Option<OperatorRequest>, IpcError> {
        self.requests.receive()
    }

    /// Sends the reply to a request.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn reply(&self, reply: &OperatorReply) -> Result<(), IpcError> {
        self.replies.send(reply).map(|_| ())
    }
}

/// Reader of telemetry; counts the cycles that it has lost.
#[derive(Debug)]
pub struct TelemetryReader {
    reader: Reader<Telemetry>,
    expected: Option<u64>,
    lost: u64,
    _cleanup: SharedMemoryCleanup,
    _slot: ClientSlot,
}

impl TelemetryReader {
    /// Joins the system as a viewer, which receives all telemetry published after this call.
    ///
    /// # Errors
    /// [`IpcError::NoFreeSlot`] if all 5 viewer slots are in use; other variants of [`IpcError`] if the port cannot be
    /// opened.
    pub fn new(domain: &Domain) -> Result<TelemetryReader, IpcError> {
        TelemetryReader::of(domain, &VIEWER_SLOTS)
    }

    /// Joins the system as [`TelemetryReader::new`] does, but in a slot reserved for recorders.
    ///
    /// # Errors
    /// The same as those of [`TelemetryReader::new`]; there are 3 such slots.
    pub fn for_log(domain: &Domain) -> Result<TelemetryReader, IpcError> {
        TelemetryReader::of(domain, &RECORDER_SLOTS)
    }

    fn of(domain: &Domain, kind: &SlotKind) -> Result<TelemetryReader, IpcError> {
        let slot = ClientSlot::acquire(domain, kind)?;
        let (reader, cleanup) = domain.join(TELEMETRY.bytes_of_reader(), |node| {
            Reader::new(domain, node, &TELEMETRY)
        })?;
        Ok(TelemetryReader {
            reader,
            expected: None,
            lost: 0,
            _cleanup: cleanup,
            _slot: slot,
        })
    }

    /// Returns the oldest unread telemetry. A restart of the controller does not count as lost telemetry.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn receive(&mut self) -> Result<Option<Telemetry>, IpcError> {
        let next = self.reader.receive()?;
        if let Some(telemetry) = &next {
            if let Some(expected) = self.expected {
                self.lost += telemetry.step().saturating_sub(expected);
            }
            self.expected = Some(telemetry.step() + 1);
        }
        Ok(next)
    }

    /// Returns the oldest unread telemetry; waits for it for at most `timeout`.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn wait(&mut self, timeout: Duration) -> Result<Option<Telemetry>, IpcError> {
        let start = Instant::now();
        loop {
            if let Some(telemetry) = self.receive()? {
                return Ok(Some(telemetry));
            }
            if start.elapsed() >= timeout {
                return Ok(None);
            }
            pause(POLL_INTERVAL);
        }
    }

    /// Number of published cycles whose telemetry this reader did not receive.
    pub fn lost(&self) -> u64 {
        self.lost
    }
}

/// The right to command a system continuously, which only one program at a time can hold. It is a convention between
/// programs, such as those that use the Python package: the controller accepts requests from every operator, and a person
/// may intervene from the command line at any time. The kernel releases the right when the process ends.
#[derive(Debug)]
pub struct CommandSlot {
    _slot: ClientSlot,
}

impl CommandSlot {
    /// Acquires the right to command.
    ///
    /// # Errors
    /// [`IpcError::NoFreeSlot`] with the process that holds the right.
    pub fn acquire(domain: &Domain) -> Result<CommandSlot, IpcError> {
        ClientSlot::acquire(domain, &COMMANDER_SLOTS).map(|slot| CommandSlot { _slot: slot })
    }
}

/// Client that sends requests to the controller.
#[derive(Debug)]
pub struct OperatorClient {
    requests: Writer<OperatorRequest>,
    replies: Reader<OperatorReply>,
    operator_id: u64,
    sequence: u64,
    _cleanup: SharedMemoryCleanup,
    _slot: ClientSlot,
}

impl OperatorClient {
    /// Joins the system as a general client.
    ///
    /// # Errors
    /// [`IpcError::NoFreeSlot`] if all 5 general slots are in use; other variants of [`IpcError`] if the ports cannot
    /// be opened.
    pub fn new(domain: &Domain) -> Result<OperatorClient, IpcError> {
        OperatorClient::of(domain, &OPERATOR_SLOTS)
    }

    /// Joins the system as [`OperatorClient::new`] does, but in a slot reserved for the programs that run the system.
    ///
    /// # Errors
    /// The same as those of [`OperatorClient::new`]; there are 3 such slots.
    pub fn for_system(domain: &Domain) -> Result<OperatorClient, IpcError> {
        OperatorClient::of(domain, &SUPERVISOR_SLOTS)
    }

    fn of(domain: &Domain, kind: &SlotKind) -> Result<OperatorClient, IpcError> {
        let slot = ClientSlot::acquire(domain, kind)?;
        let bytes = REQUESTS.bytes_of::<OperatorRequest>() + REPLIES.bytes_of_reader();
        let (ports, cleanup) = domain.join(bytes, |node| {
            Ok((
                Reader::new(domain, node, &REPLIES)?,
                Writer::new(domain, node, &REQUESTS, Backpressure::Drop)?,
            ))
        })?;
        let (replies, requests) = ports;
        Ok(OperatorClient {
            replies,
            requests,
            operator_id: unique_operator_id(),
            sequence: 0,
            _cleanup: cleanup,
            _slot: slot,
        })
    }

    /// Sends a request that takes effect in the next cycle or at `at_cycle`. Returns its sequence number, or `None` if
    /// no controller is connected or its request queue is full.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn send<const N: usize>(
        &mut self,
        request: &Request<N>,
        at_cycle: Option<u64>,
    ) -> Result<Option<u64>, IpcError> {
        self.sequence += 1;
        let message = OperatorRequest::new(self.operator_id, self.sequence, at_cycle, request);
        let readers = self.requests.send(&message)?;
        Ok((readers > 0).then_some(self.sequence))
    }

    /// Returns the oldest unread reply to a request of this operator. A request that is queued until its cycle has two replies,
    /// the first with [`Outcome::Queued`](crate::message::Outcome::Queued).
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn receive(&self) -> Result<Option<OperatorReply>, IpcError> {
        while let Some(reply) = self.replies.receive()? {
            if reply.operator == self.operator_id {
                return Ok(Some(reply));
            }
        }
        Ok(None)
    }
}

/// Unique operator id: the process id and a counter within the process.
fn unique_operator_id() -> u64 {
    static OPERATORS: AtomicU64 = AtomicU64::new(0);
    let process = u64::from(std::process::id());
    process << 32 | OPERATORS.fetch_add(1, Ordering::Relaxed)
}
