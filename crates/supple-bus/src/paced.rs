//! An emulated bus by the wall clock: the arm's process keeps the time and holds it to the wall's.
//!
//! A cable answers within microseconds whatever the machine does; a process that plays one does not. So the
//! host asks as in virtual time ([`Lockstep`](crate::virtual_time::Lockstep)), and the arm answers when the
//! wall clock has come to the event. Where the arm's process is held up, the emulated time stands still for
//! both sides: no reply is lost to a busy machine. A host that is held up is late, by [`MOST_NS`] at the most.
//! But a host that is silent for [`SILENCE_NS`] does not hold up the time: the arm goes on without it; and an
//! arm that is silent is one without power.

use crate::bus::{Bus, Event};
use crate::clock::{monotonic_ns, wait_readable_until};
use crate::datagram::Side;
use crate::endpoint::{Delivery, Endpoint};
use crate::error::BusError;
use crate::folder::OwnerFolder;
use crate::message::{Asked, MESSAGE_BYTES, Message};
use crate::virtual_time::Peer;
use std::collections::VecDeque;
use supple_puck::CanFrame;

/// By how much a host that was held up is late at the most \[ns\].
pub const MOST_NS: u64 = 250_000;
/// By how much an answer of the arm may be late before the time stood still instead \[ns\].
const FORGIVEN_NS: u64 = 100_000;
/// Silence of one side after which the other goes on alone \[ns\].
pub const SILENCE_NS: u64 = 30_000_000;
/// How long a host may have been held up before the time has gone on without it \[ns\].
const HELD_UP_NS: u64 = 20_000_000;

/// How long an arm may take for its first answer \[ns\].
const OPEN_NS: u64 = 1_000_000_000;
/// Longest that the arm's side is at work before it returns \[ns\].
const SLICE_NS: u64 = 1_000_000;
/// Events that came while a frame was handed over; a bus at 1 Mbit/s has fewer in a millisecond.
const WAITING: usize = 64;

/// The host's bus.
#[derive(Debug)]
pub struct Paced {
    endpoint: Endpoint,
    /// The arm's time as it was last known \[ns\].
    base_ns: u64,
    /// The machine's clock over the arm's time \[ns\].
    offset_ns: u64,
    sequence: u32,
    /// The arm did not answer the last question.
    lost: bool,
    waiting: VecDeque<Event>,
}

impl Paced {
    /// Opens the host's side and takes over the time of the arm's process, which must be there.
    ///
    /// # Errors
    /// Where the folder is not the owner's alone, another process is the host, or no arm answers.
    pub fn open(folder: &OwnerFolder) -> Result<Paced, BusError> {
        let (own, peer) = Side::Host.sockets();
        let mut bus = Paced {
            endpoint: Endpoint::new(folder, own, peer)?,
            base_ns: 0,
            offset_ns: 0,
            sequence: 0,
            lost: false,
            waiting: VecDeque::with_capacity(WAITING),
        };
        bus.sequence = 1;
        if bus.post(&Message::run_until(0, 1))? != Delivery::Delivered {
            return Err(bus.no_peer());
        }
        let patience_ns = monotonic_ns() + OPEN_NS;
        if bus.answer(patience_ns)?.is_none() {
            return Err(bus.no_peer());
        }
        Ok(bus)
    }

    fn no_peer(&self) -> BusError {
        BusError::NoPeer {
            path: self.endpoint.peer().to_owned(),
        }
    }

    fn post(&self, message: &Message) -> Result<Delivery, BusError> {
        self.endpoint.send(&message.emit())
    }

    /// The answer to the last question, until the machine's clock shows `until_ns`: with or without an event.
    fn answer(&mut self, until_ns: u64) -> Result<Option<Option<Event>>, BusError> {
        loop {
            while let Some(bytes) = self.endpoint.receive::<MESSAGE_BYTES>()? {
                let message = Message::parse(&bytes);
                // What answers an older question was waited for in vain: a reply that did not come.
                if let (Some(event), true) = (message.event(), message.sequence == self.sequence) {
                    self.offset_ns = self.offset_ns.max(message.offset_ns);
                    self.base_ns = self.base_ns.max(message.time_ns);
                    return Ok(Some(event));
                }
            }
            if monotonic_ns() >= until_ns {
                return Ok(None);
            }
            wait_readable_until(&self.endpoint, until_ns)?;
        }
    }

    /// The wall clock in the arm's time \[ns\].
    fn wall_ns(&self) -> u64 {
        monotonic_ns().saturating_sub(self.offset_ns)
    }

    /// By how much the time stood still for a host that was held up \[ns\].
    fn held_up_ns(&self) -> u64 {
        match self.wall_ns().saturating_sub(self.base_ns) {
            since if self.lost || since > HELD_UP_NS => 0,
            since => since.saturating_sub(MOST_NS),
        }
    }

    /// Lets the arm run to `until_ns`, but at least to now, or to an event.
    fn exchange(&mut self, until_ns: u64) -> Result<Option<Event>, BusError> {
        self.offset_ns += self.held_up_ns();
        let until_ns = until_ns.max(self.now_ns());
        self.sequence = self.sequence.wrapping_add(1);
        let delivered = self.post(&Message {
            offset_ns: self.offset_ns,
            sent_ns: monotonic_ns(),
            ..Message::run_until(until_ns, self.sequence)
        })?;
        let wall_ns = until_ns + self.offset_ns;
        let patience_ns = match delivered {
            Delivery::Delivered if !self.lost => wall_ns + SILENCE_NS,
            _ => wall_ns,
        };
        let answer = self.answer(patience_ns)?;
        self.lost = answer.is_none();
        if self.lost {
            self.base_ns = self.base_ns.max(until_ns);
        }
        Ok(answer.flatten())
    }
}

impl Bus for Paced {
    fn now_ns(&self) -> u64 {
        let wall_ns = self.wall_ns() - self.held_up_ns();
        wall_ns.max(self.base_ns)
    }

    fn monotonic_ns(&self, time_ns: u64) -> u64 {
        time_ns + self.offset_ns
    }

    fn send(&mut self, frame: &CanFrame) -> Result<(), BusError> {
        let now_ns = self.now_ns();
        while self.base_ns < now_ns
            && self.waiting.len() < WAITING
            && let Some(event) = self.exchange(now_ns)?
        {
            self.waiting.push_back(event);
        }
        let message = Message {
            offset_ns: self.offset_ns,
            ..Message::frame(frame, now_ns)
        };
        match self.post(&message)? {
            // A frame to nobody is never confirmed.
            Delivery::Delivered | Delivery::NoPeer => Ok(()),
            Delivery::Full => Err(BusError::Full),
        }
    }

    fn receive_until(&mut self, until_ns: u64) -> Result<Option<Event>, BusError> {
        match self.waiting.pop_front() {
            Some(event) => Ok(Some(event)),
            None => self.exchange(until_ns),
        }
    }
}

/// The arm's side of a [`Paced`].
#[derive(Debug)]
pub struct Pacer {
    endpoint: Endpoint,
    offset_ns: u64,
    /// When the host was last heard \[ns\].
    heard_ns: u64,
    /// What the host waits for.
    asked: Option<Message>,
}

impl Pacer {
    /// Opens the arm's side in a folder; the arm's time is `now_ns`.
    ///
    /// # Errors
    /// Where the folder is not the owner's alone, or another process is the arm.
    pub fn open(folder: &OwnerFolder, now_ns: u64) -> Result<Pacer, BusError> {
        let (own, peer) = Side::Arm.sockets();
        Ok(Pacer {
            endpoint: Endpoint::new(folder, own, peer)?,
            offset_ns: monotonic_ns().saturating_sub(now_ns),
            heard_ns: 0,
            asked: None,
        })
    }

    /// The wall clock in the arm's time \[ns\].
    fn wall_ns(&self) -> u64 {
        monotonic_ns().saturating_sub(self.offset_ns)
    }

    /// Lets the arm run and serves its host, for about a millisecond at the most.
    ///
    /// # Errors
    /// Where the socket fails. A host that has gone is none: another may come.
    pub fn turn(&mut self, peer: &mut impl Peer) -> Result<(), BusError> {
        if let Some(asked) = self.asked {
            let until_ns = asked.time_ns.max(peer.now_ns());
            let event = peer.run_until(until_ns.min(peer.now_ns() + SLICE_NS));
            let now_ns = peer.now_ns();
            while self.wall_ns() < now_ns {
                wait_readable_until(&self.endpoint, now_ns + self.offset_ns)?;
            }
            if event.is_some() || now_ns >= until_ns {
                self.stand_still(now_ns, asked.sent_ns);
                let event = event.as_ref();
                let answer = Message::answer(event, now_ns, asked.sequence, self.offset_ns);
                self.endpoint.send(&answer.emit())?;
                self.asked = None;
                self.heard_ns = monotonic_ns();
            }
            return Ok(());
        }
        if let Some(message) = self.next()? {
            self.heard_ns = monotonic_ns();
            self.offset_ns = self.offset_ns.max(message.offset_ns);
            match message.asked() {
                Some(Asked::Frame(frame)) => peer.host_sends(&frame),
                Some(Asked::RunUntil) => self.asked = Some(message),
                None => {}
            }
        } else if monotonic_ns() > self.heard_ns + SILENCE_NS {
            let wall_ns = self.wall_ns();
            while peer.run_until(wall_ns.max(peer.now_ns())).is_some() {}
        }
        Ok(())
    }

    fn next(&mut self) -> Result<Option<Message>, BusError> {
        let mut bytes = self.endpoint.receive::<MESSAGE_BYTES>()?;
        if bytes.is_none() {
            wait_readable_until(&self.endpoint, monotonic_ns() + SLICE_NS)?;
            bytes = self.endpoint.receive()?;
        }
        Ok(bytes.as_ref().map(Message::parse))
    }

    /// The time by which an answer is late did not pass, unless nobody waited for it any more.
    fn stand_still(&mut self, now_ns: u64, sent_ns: u64) {
        let due_ns = sent_ns.max(now_ns + self.offset_ns);
        let late_ns = monotonic_ns().saturating_sub(due_ns);
        if (FORGIVEN_NS..=SILENCE_NS).contains(&late_ns) {
            self.offset_ns += late_ns;
        }
    }

    /// The machine's monotonic clock over the arm's time \[ns\].
    pub fn offset_ns(&self) -> u64 {
        self.offset_ns
    }
}
