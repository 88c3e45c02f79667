//! The world outside the control path: telemetry, requests and replies.
//!
//! These never touch the control loop's thread: a status line that comes and goes costs it nothing.
//!
//! Requests are the one service with more than one writer, because operators come and go. They command
//! nothing: each is checked by the controller, which is the only writer of replies, telemetry and torques.

use crate::domain::Domain;
use crate::error::IpcError;
use crate::last_out::LastOut;
use crate::message::{OperatorReply, OperatorRequest, Telemetry};
use crate::place::{Kind, Place};
use crate::port::{Full, Reader, Terms, Writer};
use core::time::Duration;
use rustix::thread::{NanosleepRelativeResult, Timespec, nanosleep};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;
use supple_core::controller::Request;

/// Telemetry that a reader may lag behind, in cycles.
pub const TELEMETRY_DEPTH: usize = 2048;

const TELEMETRY: Terms = Terms {
    name: "telemetry",
    writers: 1,
    readers: 8,
    depth: TELEMETRY_DEPTH,
    oldest_goes: false,
};
const REQUESTS: Terms = Terms {
    name: "operator_request",
    writers: 8,
    readers: 1,
    depth: 16,
    oldest_goes: false,
};
const REPLIES: Terms = Terms {
    name: "operator_reply",
    writers: 1,
    readers: 8,
    depth: 64,
    oldest_goes: true,
};

/// Those who look, and those who ask, may hang: some places are not theirs. Together as many as the services have.
const LOOKERS: Kind = Kind {
    name: "reader",
    words: "those who look at telemetry",
    places: 5,
};
const RECORDERS: Kind = Kind {
    name: "recorder",
    words: "those who record telemetry",
    places: 3,
};
const ASKERS: Kind = Kind {
    name: "operator",
    words: "operators",
    places: 5,
};
const KEEPERS: Kind = Kind {
    name: "keeper",
    words: "programs that run the system",
    places: 3,
};
const _: () = assert!(LOOKERS.places + RECORDERS.places == TELEMETRY.readers);
const _: () = assert!(ASKERS.places + KEEPERS.places == REQUESTS.writers);
const _: () = assert!(REPLIES.readers == REQUESTS.writers);

/// How often a waiting reader looks: telemetry has no bell, so that it cannot be made to ring in vain.
const LOOK_EVERY: Duration = Duration::from_millis(1);

/// The controller's end.
#[derive(Debug)]
pub struct OutsideLink {
    telemetry: Writer<Telemetry>,
    requests: Reader<OperatorRequest>,
    replies: Writer<OperatorReply>,
    _last_out: LastOut,
}

impl OutsideLink {
    /// Takes the controller's place. With [`Full::Wait`] a reader of telemetry that is full holds it up.
    ///
    /// # Errors
    /// [`IpcError::SecondWriter`] where there is a controller already, and what else [`IpcError`] says.
    pub fn new(domain: &Domain, full: Full) -> Result<OutsideLink, IpcError> {
        let bytes = TELEMETRY.bytes_of::<Telemetry>()
            + REPLIES.bytes_of::<OperatorReply>()
            + REQUESTS.bytes_of_reader();
        let (ports, last_out) = domain.join(bytes, |node| {
            Ok((
                Writer::new(domain, node, &TELEMETRY, full)?,
                Reader::new(domain, node, &REQUESTS)?,
                Writer::new(domain, node, &REPLIES, Full::Lose)?,
            ))
        })?;
        let (telemetry, requests, replies) = ports;
        Ok(OutsideLink {
            telemetry,
            requests,
            replies,
            _last_out: last_out,
        })
    }

    /// Publishes the telemetry of a cycle.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn publish(&self, telemetry: &Telemetry) -> Result<(), IpcError> {
        self.telemetry.send(telemetry).map(|_| ())
    }

    /// The oldest request that was not read yet.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn request(&self) -> Result<Option<OperatorRequest>, IpcError> {
        self.requests.receive()
    }

    /// Answers one.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn reply(&self, reply: &OperatorReply) -> Result<(), IpcError> {
        self.replies.send(reply).map(|_| ())
    }
}

/// A reader of telemetry that counts what it lost.
#[derive(Debug)]
pub struct TelemetryReader {
    reader: Reader<Telemetry>,
    expected: Option<u64>,
    lost: u64,
    _last_out: LastOut,
    _place: Place,
}

impl TelemetryReader {
    /// Joins to look; sees what is published from now on.
    ///
    /// # Errors
    /// [`IpcError::NoPlace`] where 5 others look, and what else [`IpcError`] says.
    pub fn new(domain: &Domain) -> Result<TelemetryReader, IpcError> {
        TelemetryReader::of(domain, &LOOKERS)
    }

    /// As [`TelemetryReader::new`], for a log: in a place that those who look cannot take.
    ///
    /// # Errors
    /// As there, where 3 others record.
    pub fn for_log(domain: &Domain) -> Result<TelemetryReader, IpcError> {
        TelemetryReader::of(domain, &RECORDERS)
    }

    fn of(domain: &Domain, kind: &Kind) -> Result<TelemetryReader, IpcError> {
        let place = Place::take(domain, kind)?;
        let (reader, last_out) = domain.join(TELEMETRY.bytes_of_reader(), |node| {
            Reader::new(domain, node, &TELEMETRY)
        })?;
        Ok(TelemetryReader {
            reader,
            expected: None,
            lost: 0,
            _last_out: last_out,
            _place: place,
        })
    }

    /// The oldest telemetry that was not read yet. A controller that began again is not a loss.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn receive(&mut self) -> Result<Option<Telemetry>, IpcError> {
        let next = self.reader.receive()?;
        if let Some(telemetry) = &next {
            if let Some(expected) = self.expected {
                self.lost += telemetry.step.saturating_sub(expected);
            }
            self.expected = Some(telemetry.step + 1);
        }
        Ok(next)
    }

    /// As [`TelemetryReader::receive`], but waits for some at most for `timeout`.
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
            pause(LOOK_EVERY);
        }
    }

    /// Cycles whose telemetry was published and did not arrive here.
    pub fn lost(&self) -> u64 {
        self.lost
    }
}

/// Somebody who asks the controller for something.
#[derive(Debug)]
pub struct Operator {
    requests: Writer<OperatorRequest>,
    replies: Reader<OperatorReply>,
    number: u64,
    sequence: u64,
    _last_out: LastOut,
    _place: Place,
}

impl Operator {
    /// Joins to ask for something.
    ///
    /// # Errors
    /// [`IpcError::NoPlace`] where 5 others do, and what else [`IpcError`] says.
    pub fn new(domain: &Domain) -> Result<Operator, IpcError> {
        Operator::of(domain, &ASKERS)
    }

    /// As [`Operator::new`], for a program that runs the system: in a place that others cannot take.
    ///
    /// # Errors
    /// As there, where 3 others do.
    pub fn for_system(domain: &Domain) -> Result<Operator, IpcError> {
        Operator::of(domain, &KEEPERS)
    }

    fn of(domain: &Domain, kind: &Kind) -> Result<Operator, IpcError> {
        let place = Place::take(domain, kind)?;
        let bytes = REQUESTS.bytes_of::<OperatorRequest>() + REPLIES.bytes_of_reader();
        let (ports, last_out) = domain.join(bytes, |node| {
            Ok((
                Reader::new(domain, node, &REPLIES)?,
                Writer::new(domain, node, &REQUESTS, Full::Lose)?,
            ))
        })?;
        let (replies, requests) = ports;
        Ok(Operator {
            replies,
            requests,
            number: operator_number(),
            sequence: 0,
            _last_out: last_out,
            _place: place,
        })
    }

    /// Sends a request, to be heard in the next cycle or at `at_cycle`. Gives its sequence number; `None`
    /// where no controller is there, or it has too many requests waiting.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn send<const N: usize>(
        &mut self,
        request: &Request<N>,
        at_cycle: Option<u64>,
    ) -> Result<Option<u64>, IpcError> {
        self.sequence += 1;
        let message = OperatorRequest::new(self.number, self.sequence, at_cycle, request);
        let reached = self.requests.send(&message)?;
        Ok((reached > 0).then_some(self.sequence))
    }

    /// The oldest reply to a request of this operator that was not read yet. A request that waits for its
    /// cycle has two: [`Outcome::Queued`](crate::message::Outcome::Queued) first.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn receive(&self) -> Result<Option<OperatorReply>, IpcError> {
        while let Some(reply) = self.replies.receive()? {
            if reply.operator == self.number {
                return Ok(Some(reply));
            }
        }
        Ok(None)
    }
}

/// A number that no other operator has: that of the process, and which of its operators it is.
fn operator_number() -> u64 {
    static OPERATORS: AtomicU64 = AtomicU64::new(0);
    let process = u64::from(std::process::id());
    process << 32 | OPERATORS.fetch_add(1, Ordering::Relaxed)
}

/// Lets others run for a while; a signal cuts it short.
pub fn pause(duration: Duration) {
    let Ok(request) = Timespec::try_from(duration) else {
        return;
    };
    match nanosleep(&request) {
        NanosleepRelativeResult::Ok
        | NanosleepRelativeResult::Interrupted(_)
        | NanosleepRelativeResult::Err(_) => {}
    }
}
