//! A bus in virtual time: whoever plays the arm owns the time, and it advances only while the host waits.
//!
//! In one process the arm is a [`Peer`] inside a [`Direct`]. Between processes the host has a
//! [`Lockstep`], the arm's process a [`Responder`]; the two speak datagrams in the folder of
//! [`DatagramBus`](crate::DatagramBus).
//!
//! The host sends any number of frames, then "run until", and waits; the arm answers with the first event
//! for the host, or "reached". So the same inputs give the same order of everything, at any speed.

use crate::bus::{Bus, Event};
use crate::clock::{monotonic_ns, wait_readable_until};
use crate::datagram::Side;
use crate::endpoint::{Delivery, Endpoint};
use crate::error::BusError;
use crate::folder::OwnerFolder;
use crate::message::{Asked, MESSAGE_BYTES, Message};
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
            now_ns: 0,
        };
        while bus.receive_until(0)?.is_some() {}
        Ok(bus)
    }

    fn post(&self, message: &Message) -> Result<(), BusError> {
        let patience = monotonic_ns() + PATIENCE_NS;
        loop {
            match self.endpoint.send(&message.emit())? {
                Delivery::Delivered => return Ok(()),
                // No time passes on the bus while the peer reads what is queued.
                Delivery::Full if monotonic_ns() < patience => std::thread::yield_now(),
                Delivery::Full | Delivery::NoPeer => return Err(self.no_peer()),
            }
        }
    }

    fn no_peer(&self) -> BusError {
        BusError::NoPeer {
            path: self.endpoint.peer().to_owned(),
        }
    }

    fn answer(&self) -> Result<Message, BusError> {
        let patience = monotonic_ns() + PATIENCE_NS;
        loop {
            if let Some(bytes) = self.endpoint.receive::<MESSAGE_BYTES>()? {
                return Ok(Message::parse(&bytes));
            }
            if monotonic_ns() > patience {
                return Err(self.no_peer());
            }
            wait_readable_until(&self.endpoint, patience)?;
        }
    }
}

impl Bus for Lockstep {
    fn now_ns(&self) -> u64 {
        self.now_ns
    }

    fn send(&mut self, frame: &CanFrame) -> Result<(), BusError> {
        self.post(&Message::frame(frame, self.now_ns))
    }

    fn receive_until(&mut self, until_ns: u64) -> Result<Option<Event>, BusError> {
        self.post(&Message::run_until(until_ns, 0))?;
        loop {
            let message = self.answer()?;
            let Some(event) = message.event() else {
                continue;
            };
            self.now_ns = message.time_ns;
            return Ok(event);
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

    /// Serves one message of the host; `false` if none came within `idle_ns` of the machine's time.
    ///
    /// # Errors
    /// Where the socket fails. A host that has gone is none: another may come.
    pub fn serve(&mut self, peer: &mut impl Peer, idle_ns: u64) -> Result<bool, BusError> {
        let Some(bytes) = self.next(idle_ns)? else {
            return Ok(false);
        };
        let message = Message::parse(&bytes);
        match message.asked() {
            Some(Asked::Frame(frame)) => peer.host_sends(&frame),
            Some(Asked::RunUntil) => {
                let event = peer.run_until(message.time_ns.max(peer.now_ns()));
                let answer = Message::answer(event.as_ref(), peer.now_ns(), message.sequence, 0);
                self.endpoint.send(&answer.emit())?;
            }
            None => {}
        }
        Ok(true)
    }

    fn next(&self, idle_ns: u64) -> Result<Option<[u8; MESSAGE_BYTES]>, BusError> {
        if let Some(bytes) = self.endpoint.receive()? {
            return Ok(Some(bytes));
        }
        wait_readable_until(&self.endpoint, monotonic_ns() + idle_ns)?;
        self.endpoint.receive()
    }
}

impl AsFd for Responder {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.endpoint.as_fd()
    }
}
