//! An emulated bus by the wall clock: the arm's process keeps the time, its host holds it to the wall's.
//!
//! A cable answers within microseconds whatever the machine does; a process that plays one does not. So the
//! host asks as in virtual time ([`Lockstep`](crate::virtual_time::Lockstep)), the arm computes and answers at
//! once, and the host takes the answer in when the wall clock has come to it. Where the arm's process is held
//! up, the emulated time stands still for both sides: no reply is lost to a busy machine. A host that is held up
//! is late, by [`MOST_NS`] at the most. But a host that is silent for [`SILENCE_NS`] does not hold up the time:
//! the arm goes on without it; and an arm that is silent is one without power.

use crate::asked::Asked;
use crate::asking::{Asking, Next};
use crate::bus::{Bus, Event};
use crate::clock::{monotonic_ns, sleep_until_ns, wait_readable_until};
use crate::datagram::Side;
use crate::endpoint::{Delivery, Endpoint};
use crate::error::BusError;
use crate::folder::OwnerFolder;
use crate::message::{Kind, LONGEST_BYTES, Message};
use crate::virtual_time::Peer;
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
/// Longest that the arm's side runs or waits before it returns \[ns\].
const SLICE_NS: u64 = 1_000_000;
/// By how much the arm's side is before the wall clock at the most \[ns\]: what an operator does at the pendant
/// comes no later than that.
const AHEAD_NS: u64 = 2_000_000;

/// The host's bus.
#[derive(Debug)]
pub struct Paced {
    endpoint: Endpoint,
    asking: Asking,
    /// The arm's time as it was last known \[ns\].
    base_ns: u64,
    /// The machine's clock over the arm's time \[ns\].
    offset_ns: u64,
    /// The same at the beginning: what came since is time that stood still \[ns\].
    first_offset_ns: u64,
    /// The arm did not answer the last question.
    lost: bool,
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
            asking: Asking::new(),
            base_ns: 0,
            offset_ns: 0,
            first_offset_ns: 0,
            lost: false,
        };
        bus.asking.ask(0, 0);
        if bus.asking.post(&bus.endpoint)? != Delivery::Delivered {
            return Err(bus.no_peer());
        }
        match bus.answer(monotonic_ns() + OPEN_NS)? {
            Some(answer) => {
                bus.offset_ns = answer.offset_ns;
                bus.first_offset_ns = answer.offset_ns;
                bus.base_ns = answer.time_ns;
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

    /// The answer to the last question, until the machine's clock shows `until_ns`.
    fn answer(&mut self, until_ns: u64) -> Result<Option<Message>, BusError> {
        loop {
            if let Some(answer) = self.asking.answer(&self.endpoint)? {
                return Ok(Some(answer));
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

    /// Lets the arm run as far as it is to, and waits until the wall clock has come there.
    fn exchange(&mut self, until_ns: u64, frames: u32) -> Result<(), BusError> {
        self.offset_ns += self.held_up_ns();
        let until_ns = until_ns.max(self.now_ns());
        let asked_ns = monotonic_ns();
        let question = self.asking.ask(until_ns, frames);
        question.offset_ns = self.offset_ns;
        question.sent_ns = asked_ns;
        let delivered = self.asking.post(&self.endpoint)?;
        // A frame to nobody is never confirmed.
        self.asking.over();
        let wall_ns = until_ns + self.offset_ns;
        let patience_ns = match delivered {
            Delivery::Delivered if !self.lost => wall_ns + SILENCE_NS,
            _ => wall_ns,
        };
        let answer = self.answer(patience_ns)?;
        self.lost = answer.is_none();
        match answer {
            Some(answer) => {
                self.offset_ns = self.offset_ns.max(answer.offset_ns);
                self.base_ns = self.base_ns.max(answer.time_ns);
                let due_ns = asked_ns.max(answer.time_ns + self.offset_ns);
                self.stand_still(answer.sent_ns.saturating_sub(due_ns));
                self.sleep_until(answer.time_ns);
            }
            None => self.base_ns = self.base_ns.max(until_ns),
        }
        Ok(())
    }

    /// The time by which an answer is late did not pass, unless nobody waited for it any more.
    fn stand_still(&mut self, late_ns: u64) {
        if (FORGIVEN_NS..=SILENCE_NS).contains(&late_ns) {
            self.offset_ns += late_ns;
        }
    }

    fn sleep_until(&self, time_ns: u64) {
        while self.wall_ns() < time_ns {
            sleep_until_ns(time_ns + self.offset_ns);
        }
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

    fn stood_still_ns(&self) -> u64 {
        self.offset_ns - self.first_offset_ns
    }

    fn send(&mut self, frame: &CanFrame) -> Result<(), BusError> {
        self.asking.hand_over(frame, self.now_ns())
    }

    fn receive_until(&mut self, until_ns: u64) -> Result<Option<Event>, BusError> {
        self.receive_ahead(until_ns, 0)
    }

    fn receive_ahead(&mut self, until_ns: u64, frames: u32) -> Result<Option<Event>, BusError> {
        match self.asking.next(until_ns) {
            Next::Event(entry) => return Ok(Some(entry.event)),
            Next::Reached(_) => return Ok(None),
            Next::Ask => self.exchange(until_ns, frames)?,
        }
        match self.asking.next(until_ns) {
            Next::Event(entry) => Ok(Some(entry.event)),
            // An arm that does not answer tells nothing.
            Next::Reached(_) | Next::Ask => Ok(None),
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
    asked: Option<Asked>,
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

    /// Serves its host: lets the arm run for about a millisecond of its time, or waits for as long.
    ///
    /// # Errors
    /// Where the socket fails. A host that has gone is none: another may come.
    pub fn turn(&mut self, peer: &mut impl Peer) -> Result<(), BusError> {
        let mut bytes = [0; LONGEST_BYTES];
        if self.asked.is_none() {
            self.asked = self.next(&mut bytes)?;
        }
        if let Some(asked) = &mut self.asked {
            let not_before_ns = peer.now_ns().saturating_sub(AHEAD_NS) + self.offset_ns;
            sleep_until_ns(not_before_ns);
            if let Some(answer) = asked.run(peer, SLICE_NS) {
                answer.offset_ns = self.offset_ns;
                answer.sent_ns = monotonic_ns();
                self.heard_ns = answer.sent_ns;
                self.endpoint.send(answer.emit(&mut bytes))?;
                self.asked = None;
            }
        } else if monotonic_ns() > self.heard_ns + SILENCE_NS {
            let wall_ns = self.wall_ns();
            while peer.run_until(wall_ns.max(peer.now_ns())).is_some() {}
        }
        Ok(())
    }

    /// The next question, if one comes within a millisecond.
    fn next(&mut self, bytes: &mut [u8]) -> Result<Option<Asked>, BusError> {
        let mut read = self.endpoint.receive_into(bytes)?.map(<[u8]>::len);
        if read.is_none() {
            wait_readable_until(&self.endpoint, monotonic_ns() + SLICE_NS)?;
            read = self.endpoint.receive_into(bytes)?.map(<[u8]>::len);
        }
        let message = read.and_then(|length| Message::parse(&bytes[..length]));
        let question = message.filter(|m| m.kind == Kind::RunUntil);
        Ok(question.map(|question| {
            self.heard_ns = monotonic_ns();
            self.offset_ns = self.offset_ns.max(question.offset_ns);
            Asked::new(question)
        }))
    }

    /// The machine's monotonic clock over the arm's time \[ns\].
    pub fn offset_ns(&self) -> u64 {
        self.offset_ns
    }
}
