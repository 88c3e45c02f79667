//! A bus in virtual time: whoever plays the arm owns the time, and it advances only while the host waits.
//!
//! In one process the arm is a [`Peer`] inside a [`Direct`]. Between processes the host has a
//! [`Lockstep`], the arm's process a [`Responder`]; the two speak datagrams in the folder of
//! [`DatagramBus`](crate::DatagramBus).
//!
//! The host sends any number of frames, then "run until", and waits; the arm answers with the first event
//! for the host, or "reached"; or, where the host has said that it will be silent meanwhile
//! ([`Bus::receive_ahead`]), with all that has happened until then. So the same inputs give the same order of
//! everything, at any speed.

use crate::asked::Asked;
use crate::asking::{Asking, Next};
use crate::bus::{Bus, Event};
use crate::clock::{monotonic_ns, wait_readable_until};
use crate::datagram::Side;
use crate::endpoint::{Delivery, Endpoint};
use crate::error::BusError;
use crate::folder::OwnerFolder;
use crate::message::{Kind, LONGEST_BYTES, Message};
use rustix::fd::{AsFd, BorrowedFd};
use supple_puck::CanFrame;

/// Everything on the bus but the host.
pub trait Peer {
    /// Its time \[ns\].
    fn now_ns(&self) -> u64;

    /// The host hands over a frame, now.
    fn host_sends(&mut self, frame: &CanFrame);

    /// Runs to the next event for the host, or to `until_ns`, whichever comes first; its time is then
    /// that of the event, or `until_ns`.
    fn run_until(&mut self, until_ns: u64) -> Option<Event>;
}

/// The bus of a host in the peer's own process.
#[derive(Debug)]
pub struct Direct<P>(pub P);

impl<P: Peer> Bus for Direct<P> {
    fn now_ns(&self) -> u64 {
        self.0.now_ns()
    }

    fn send(&mut self, frame: &CanFrame) -> Result<(), BusError> {
        self.0.host_sends(frame);
        Ok(())
    }

    fn receive_until(&mut self, until_ns: u64) -> Result<Option<Event>, BusError> {
        Ok(self.0.run_until(until_ns))
    }
}

/// How long a peer may take to answer, on the machine's clock. It is no deadline of the bus: it tells an
/// arm's process that has ended from one that is busy.
const PATIENCE_NS: u64 = 5_000_000_000;

/// The host's bus, the arm in another process.
#[derive(Debug)]
pub struct Lockstep {
    endpoint: Endpoint,
    asking: Asking,
    now_ns: u64,
}

impl Lockstep {
    /// Opens the host's side and takes over the time of the arm's process, which must be there.
    ///
    /// # Errors
    /// Where the folder is not the owner's alone, another process is the host, or no arm answers.
    pub fn open(folder: &OwnerFolder) -> Result<Lockstep, BusError> {
        let (own, peer) = Side::Host.sockets();
        let mut bus = Lockstep {
            endpoint: Endpoint::new(folder, own, peer)?,
            asking: Asking::new(),
            now_ns: 0,
        };
        while bus.receive_until(0)?.is_some() {}
        Ok(bus)
    }

    fn exchange(&mut self) -> Result<(), BusError> {
        let patience = monotonic_ns() + PATIENCE_NS;
        loop {
            match self.asking.post(&self.endpoint)? {
                Delivery::Delivered => break,
                // No time passes on the bus while the peer reads what is queued.
                Delivery::Full if monotonic_ns() < patience => std::thread::yield_now(),
                Delivery::Full | Delivery::NoPeer => return Err(self.no_peer()),
            }
        }
        self.asking.over();
        while self.asking.answer(&self.endpoint)?.is_none() {
            if monotonic_ns() > patience {
                return Err(self.no_peer());
            }
            wait_readable_until(&self.endpoint, patience)?;
        }
        Ok(())
    }

    fn no_peer(&self) -> BusError {
        BusError::NoPeer {
            path: self.endpoint.peer().to_owned(),
        }
    }
}

impl Bus for Lockstep {
    fn now_ns(&self) -> u64 {
        self.now_ns
    }

    fn send(&mut self, frame: &CanFrame) -> Result<(), BusError> {
        self.asking.hand_over(frame, self.now_ns)
    }

    fn receive_until(&mut self, until_ns: u64) -> Result<Option<Event>, BusError> {
        self.receive_ahead(until_ns, 0)
    }

    fn receive_ahead(&mut self, until_ns: u64, frames: u32) -> Result<Option<Event>, BusError> {
        loop {
            match self.asking.next(until_ns) {
                Next::Event(entry) => {
                    self.now_ns = entry.time_ns;
                    return Ok(Some(entry.event));
                }
                Next::Reached(time_ns) => {
                    self.now_ns = time_ns;
                    return Ok(None);
                }
                Next::Ask => {
                    self.asking.ask(until_ns, frames);
                    self.exchange()?;
                }
            }
        }
    }
}

/// The arm's side of a [`Lockstep`].
#[derive(Debug)]
pub struct Responder {
    endpoint: Endpoint,
}

impl Responder {
    /// Opens the arm's side in a folder.
    ///
    /// # Errors
    /// Where the folder is not the owner's alone, or another process is the arm.
    pub fn open(folder: &OwnerFolder) -> Result<Responder, BusError> {
        let (own, peer) = Side::Arm.sockets();
        Ok(Responder {
            endpoint: Endpoint::new(folder, own, peer)?,
        })
    }

    /// Serves one question of the host; `false` if none came within `idle_ns` of the machine's time.
    ///
    /// # Errors
    /// Where the socket fails. A host that has gone is none: another may come.
    pub fn serve(&mut self, peer: &mut impl Peer, idle_ns: u64) -> Result<bool, BusError> {
        let mut bytes = [0; LONGEST_BYTES];
        let Some(length) = self.next(&mut bytes, idle_ns)? else {
            return Ok(false);
        };
        let message = Message::parse(&bytes[..length]);
        if let Some(question) = message.filter(|m| m.kind == Kind::RunUntil)
            && let Some(answer) = Asked::new(question).run(peer, u64::MAX)
        {
            self.endpoint.send(answer.emit(&mut bytes))?;
        }
        Ok(true)
    }

    fn next(&self, bytes: &mut [u8], idle_ns: u64) -> Result<Option<usize>, BusError> {
        if let Some(read) = self.endpoint.receive_into(bytes)? {
            return Ok(Some(read.len()));
        }
        wait_readable_until(&self.endpoint, monotonic_ns() + idle_ns)?;
        Ok(self.endpoint.receive_into(bytes)?.map(<[u8]>::len))
    }
}

impl AsFd for Responder {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.endpoint.as_fd()
    }
}
