//! An emulated bus in real time: the arm's process owns the bus time, and the host synchronises it to CLOCK_MONOTONIC.
//!
//! A real bus answers within microseconds, whatever the load of the machine; an emulator process may take longer. The
//! host therefore sends requests as in virtual time ([`LockstepBus`](crate::virtual_time::LockstepBus)), the arm
//! computes the answer at once, and the host delivers the events of an answer once the clock reaches the answer's time. If the
//! arm's process stalls, bus time pauses for both sides, so that no reply is lost. If the host stalls by up to 20 ms, bus time
//! pauses by what exceeds [`MAX_HOST_LATENESS_NS`]; after a longer stall it does not, because the arm may have continued: if the
//! host is silent for [`PEER_TIMEOUT_NS`], the arm continues without it. If the arm is silent for as long, it counts as
//! powered off.

use crate::bus::{Bus, Event};
use crate::datagram::Side;
use crate::emulated_nodes::EmulatedNodes;
use crate::endpoint::{Delivery, Endpoint};
use crate::error::BusError;
use crate::folder::OwnerFolder;
use crate::lockstep_client::{LockstepClient, NextItem};
use crate::lockstep_server::LockstepServer;
use crate::message::{Kind, MAX_BYTES, Message};
use crate::wait::wait_readable_until;
use supple_can_frame::CanFrame;
use supple_realtime::{monotonic_ns, sleep_until_ns};

/// Maximum lateness that a host sees after a stall \[ns\].
pub const MAX_HOST_LATENESS_NS: u64 = 250_000;
/// Lateness of an answer above which emulated time pauses \[ns\].
const STALL_THRESHOLD_NS: u64 = 100_000;
/// Silence of one side after which the other continues without it \[ns\].
pub const PEER_TIMEOUT_NS: u64 = 30_000_000;
/// Stall of the host above which no time is paused, because the arm may have continued without it \[ns\].
const MAX_HOST_STALL_NS: u64 = 20_000_000;

/// Timeout for the first answer of the arm \[ns\].
const FIRST_ANSWER_TIMEOUT_NS: u64 = 1_000_000_000;
/// Maximum bus time that the arm's side runs for a request, and maximum time that it waits for one, before it returns \[ns\].
const SLICE_NS: u64 = 1_000_000;
/// Maximum lead of bus time over CLOCK_MONOTONIC when a slice begins \[ns\]; a button press is delayed by at most this and a
/// slice.
const MAX_LEAD_NS: u64 = 2_000_000;

/// The host's bus.
#[derive(Debug)]
pub struct PacedBus {
    endpoint: Endpoint,
    client: LockstepClient,
    /// Latest bus time that the arm has answered \[ns\].
    last_answer_ns: u64,
    /// CLOCK_MONOTONIC minus bus time \[ns\].
    offset_ns: u64,
    /// Offset at the start \[ns\]; its growth since then is the paused time.
    first_offset_ns: u64,
    /// Whether the arm left the last request unanswered.
    lost: bool,
}

impl PacedBus {
    /// Opens the host's side and adopts the time of the arm's process, which must be running.
    ///
    /// # Errors
    /// If the folder is not accessible only to its owner, another process has opened the host's side, or no arm answers.
    pub fn open(folder: &OwnerFolder) -> Result<PacedBus, BusError> {
        let (own, peer) = Side::Host.sockets();
        let mut bus = PacedBus {
            endpoint: Endpoint::new(folder, own, peer)?,
            client: LockstepClient::new(),
            last_answer_ns: 0,
            offset_ns: 0,
            first_offset_ns: 0,
            lost: false,
        };
        bus.client.prepare_request(0, 0);
        if bus.client.send_request(&bus.endpoint)? != Delivery::Delivered {
            return Err(bus.no_peer());
        }
        match bus.answer(monotonic_ns() + FIRST_ANSWER_TIMEOUT_NS)? {
            Some(answer) => {
                bus.offset_ns = answer.offset_ns;
                bus.first_offset_ns = answer.offset_ns;
                bus.last_answer_ns = answer.time_ns;
                Ok(bus)
            }
            None => Err(bus.no_peer()),
        }
    }

    fn no_peer(&self) -> BusError {
        BusError::NoPeer {
            path: self.endpoint.peer().to_owned(),
        }
    }

    /// Waits for the answer to the last request until the monotonic clock reaches `until_ns`.
    fn answer(&mut self, until_ns: u64) -> Result<Option<Message>, BusError> {
        loop {
            if let Some(answer) = self.client.answer(&self.endpoint)? {
                return Ok(Some(answer));
            }
            if monotonic_ns() >= until_ns {
                return Ok(None);
            }
            wait_readable_until(&self.endpoint, until_ns)?;
        }
    }

    /// Returns the current CLOCK_MONOTONIC, converted to bus time \[ns\].
    fn clock_as_bus_time_ns(&self) -> u64 {
        monotonic_ns().saturating_sub(self.offset_ns)
    }

    /// Returns the time for which emulated time must pause because the host has stalled \[ns\].
    fn host_stall_ns(&self) -> u64 {
        match self
            .clock_as_bus_time_ns()
            .saturating_sub(self.last_answer_ns)
        {
            since if self.lost || since > MAX_HOST_STALL_NS => 0,
            since => since.saturating_sub(MAX_HOST_LATENESS_NS),
        }
    }

    /// Advances the arm to `until_ns`, and waits until the clock reaches the answer's time.
    fn exchange(&mut self, until_ns: u64, frames: u32) -> Result<(), BusError> {
        self.offset_ns += self.host_stall_ns();
        let until_ns = until_ns.max(self.now_ns());
        let requested_ns = monotonic_ns();
        let request = self.client.prepare_request(until_ns, frames);
        request.offset_ns = self.offset_ns;
        request.sent_ns = requested_ns;
        let delivered = self.client.send_request(&self.endpoint)?;
        // The request is cleared even if it was not delivered: a frame without a receiver is never confirmed.
        self.client.clear_request();
        let until_monotonic_ns = until_ns + self.offset_ns;
        let deadline_ns = match delivered {
            Delivery::Delivered if !self.lost => until_monotonic_ns + PEER_TIMEOUT_NS,
            _ => until_monotonic_ns,
        };
        let answer = self.answer(deadline_ns)?;
        self.lost = answer.is_none();
        match answer {
            Some(answer) => {
                self.offset_ns = self.offset_ns.max(answer.offset_ns);
                self.last_answer_ns = self.last_answer_ns.max(answer.time_ns);
                let due_ns = requested_ns.max(answer.time_ns + self.offset_ns);
                self.add_stall(answer.sent_ns.saturating_sub(due_ns));
                self.sleep_until(answer.time_ns);
            }
            None => self.last_answer_ns = self.last_answer_ns.max(until_ns),
        }
        Ok(())
    }

    /// Pauses emulated time by the lateness of the answer, unless the request has timed out.
    fn add_stall(&mut self, late_ns: u64) {
        if (STALL_THRESHOLD_NS..=PEER_TIMEOUT_NS).contains(&late_ns) {
            self.offset_ns += late_ns;
        }
    }

    fn sleep_until(&self, time_ns: u64) {
        while self.clock_as_bus_time_ns() < time_ns {
            sleep_until_ns(time_ns + self.offset_ns);
        }
    }
}

impl Bus for PacedBus {
    fn now_ns(&self) -> u64 {
        let unpaused_ns = self.clock_as_bus_time_ns() - self.host_stall_ns();
        unpaused_ns.max(self.last_answer_ns)
    }

    fn monotonic_ns(&self, time_ns: u64) -> u64 {
        time_ns + self.offset_ns
    }

    fn clock_stall_ns(&self) -> u64 {
        self.offset_ns - self.first_offset_ns
    }

    fn send(&mut self, frame: &CanFrame) -> Result<(), BusError> {
        self.client.queue_frame(frame, self.now_ns())
    }

    fn receive_until(&mut self, until_ns: u64) -> Result<Option<Event>, BusError> {
        self.receive_with_lookahead(until_ns, 0)
    }

    fn receive_with_lookahead(
        &mut self,
        until_ns: u64,
        frames: u32,
    ) -> Result<Option<Event>, BusError> {
        match self.client.next(until_ns) {
            NextItem::Event(entry) => return Ok(Some(entry.event)),
            NextItem::Reached(_) => return Ok(None),
            NextItem::NeedRequest => self.exchange(until_ns, frames)?,
        }
        match self.client.next(until_ns) {
            NextItem::Event(entry) => Ok(Some(entry.event)),
            // An arm that does not answer sends no events.
            NextItem::Reached(_) | NextItem::NeedRequest => Ok(None),
        }
    }
}

/// The arm's side of a [`PacedBus`].
#[derive(Debug)]
pub struct PacedResponder {
    endpoint: Endpoint,
    offset_ns: u64,
    /// CLOCK_MONOTONIC at the last request received or answer sent \[ns\].
    last_seen_ns: u64,
    /// The host's request in progress.
    server: Option<LockstepServer>,
}

impl PacedResponder {
    /// Opens the arm's side in a folder; `now_ns` is the current time of the arm.
    ///
    /// # Errors
    /// If the folder is not accessible only to its owner, or another process has opened the arm's side.
    pub fn open(folder: &OwnerFolder, now_ns: u64) -> Result<PacedResponder, BusError> {
        let (own, peer) = Side::Arm.sockets();
        Ok(PacedResponder {
            endpoint: Endpoint::new(folder, own, peer)?,
            offset_ns: monotonic_ns().saturating_sub(now_ns),
            last_seen_ns: 0,
            server: None,
        })
    }

    /// Returns the current CLOCK_MONOTONIC, converted to bus time \[ns\].
    fn clock_as_bus_time_ns(&self) -> u64 {
        monotonic_ns().saturating_sub(self.offset_ns)
    }

    /// Serves one slice: advances the arm by up to a millisecond of bus time, or waits that long for a request. Without a host it
    /// advances the arm to the current time of the clock.
    ///
    /// # Errors
    /// If the socket fails. A missing host is not an error; another may connect.
    pub fn serve(&mut self, nodes: &mut impl EmulatedNodes) -> Result<(), BusError> {
        let mut bytes = [0; MAX_BYTES];
        if self.server.is_none() {
            self.server = self.next(&mut bytes)?;
        }
        if let Some(server) = &mut self.server {
            let not_before_ns = nodes.now_ns().saturating_sub(MAX_LEAD_NS) + self.offset_ns;
            sleep_until_ns(not_before_ns);
            if let Some(answer) = server.run(nodes, SLICE_NS) {
                answer.offset_ns = self.offset_ns;
                answer.sent_ns = monotonic_ns();
                self.last_seen_ns = answer.sent_ns;
                self.endpoint.send(answer.emit(&mut bytes))?;
                self.server = None;
            }
        } else if monotonic_ns() > self.last_seen_ns + PEER_TIMEOUT_NS {
            let present_ns = self.clock_as_bus_time_ns();
            while nodes.run_until(present_ns.max(nodes.now_ns())).is_some() {}
        }
        Ok(())
    }

    /// Returns the next request, if one arrives within a millisecond.
    fn next(&mut self, bytes: &mut [u8]) -> Result<Option<LockstepServer>, BusError> {
        let mut read = self.endpoint.receive_into(bytes)?.map(<[u8]>::len);
        if read.is_none() {
            wait_readable_until(&self.endpoint, monotonic_ns() + SLICE_NS)?;
            read = self.endpoint.receive_into(bytes)?.map(<[u8]>::len);
        }
        let message = read.and_then(|length| Message::parse(&bytes[..length]));
        let request = message.filter(|m| m.kind == Kind::RunUntil);
        Ok(request.map(|request| {
            self.last_seen_ns = monotonic_ns();
            self.offset_ns = self.offset_ns.max(request.offset_ns);
            LockstepServer::new(request)
        }))
    }

    /// CLOCK_MONOTONIC minus bus time \[ns\].
    pub fn offset_ns(&self) -> u64 {
        self.offset_ns
    }
}
