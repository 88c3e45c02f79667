//! A bus in virtual time: the arm's side owns the time, which advances only while the host waits.
//!
//! In one process, a [`DirectBus`] contains the arm as [`EmulatedNodes`]. Between two processes, the host uses a
//! [`LockstepBus`] and the arm's process a [`LockstepResponder`]; they exchange datagrams in the folder of
//! [`DatagramBus`](crate::DatagramBus).
//!
//! The host sends any number of frames, then "run until", and waits. The arm answers with the first event for
//! the host, or "reached"; with lookahead ([`Bus::receive_with_lookahead`]) it answers with several events at
//! once, up to the number of frames that the host expects. The same inputs therefore give the same order of events
//! at any speed.

use crate::bus::{Bus, Event};
use crate::datagram::Side;
pub use crate::emulated_nodes::EmulatedNodes;
use crate::endpoint::{Delivery, Endpoint};
use crate::error::BusError;
use crate::folder::OwnerFolder;
use crate::lockstep_client::{LockstepClient, NextItem};
use crate::lockstep_server::LockstepServer;
use crate::message::{Kind, MAX_BYTES, Message};
use crate::wait::wait_readable_until;
use rustix::fd::{AsFd, BorrowedFd};
use supple_can_frame::CanFrame;
use supple_realtime::monotonic_ns;

/// Bus of the host, with the emulated nodes in the same process.
#[derive(Debug)]
pub struct DirectBus<P>(pub P);

impl<P: EmulatedNodes> Bus for DirectBus<P> {
    fn now_ns(&self) -> u64 {
        self.0.now_ns()
    }

    fn send(&mut self, frame: &CanFrame) -> Result<(), BusError> {
        self.0.receive_from_host(frame);
        Ok(())
    }

    fn receive_until(&mut self, until_ns: u64) -> Result<Option<Event>, BusError> {
        Ok(self.0.run_until(until_ns))
    }
}

/// Timeout for an answer, in real time. It does not affect bus time; it detects an arm process that has ended.
const ANSWER_TIMEOUT_NS: u64 = 5_000_000_000;

/// Bus of the host, with the emulated nodes in another process.
#[derive(Debug)]
pub struct LockstepBus {
    endpoint: Endpoint,
    client: LockstepClient,
    now_ns: u64,
}

impl LockstepBus {
    /// Opens the host's side and adopts the time of the arm's process, which must be running.
    ///
    /// # Errors
    /// If the folder is not accessible only to its owner, another process has already opened the host's
    /// side, or no arm answers.
    pub fn open(folder: &OwnerFolder) -> Result<LockstepBus, BusError> {
        let (own, peer) = Side::Host.sockets();
        let mut bus = LockstepBus {
            endpoint: Endpoint::new(folder, own, peer)?,
            client: LockstepClient::new(),
            now_ns: 0,
        };
        // Discards events until the arm answers "reached", which carries the arm's time.
        while bus.receive_until(0)?.is_some() {}
        Ok(bus)
    }

    fn exchange(&mut self) -> Result<(), BusError> {
        let deadline_ns = monotonic_ns() + ANSWER_TIMEOUT_NS;
        loop {
            match self.client.send_request(&self.endpoint)? {
                Delivery::Delivered => break,
                // The peer has not read its queue yet. Bus time does not advance while this process retries.
                Delivery::Full if monotonic_ns() < deadline_ns => std::thread::yield_now(),
                Delivery::Full | Delivery::NoPeer => return Err(self.no_peer()),
            }
        }
        self.client.clear_request();
        while self.client.answer(&self.endpoint)?.is_none() {
            if monotonic_ns() > deadline_ns {
                return Err(self.no_peer());
            }
            wait_readable_until(&self.endpoint, deadline_ns)?;
        }
        Ok(())
    }

    fn no_peer(&self) -> BusError {
        BusError::NoPeer {
            path: self.endpoint.peer().to_owned(),
        }
    }
}

impl Bus for LockstepBus {
    fn now_ns(&self) -> u64 {
        self.now_ns
    }

    fn send(&mut self, frame: &CanFrame) -> Result<(), BusError> {
        self.client.queue_frame(frame, self.now_ns)
    }

    fn receive_until(&mut self, until_ns: u64) -> Result<Option<Event>, BusError> {
        self.receive_with_lookahead(until_ns, 0)
    }

    fn receive_with_lookahead(
        &mut self,
        until_ns: u64,
        frames: u32,
    ) -> Result<Option<Event>, BusError> {
        loop {
            match self.client.next(until_ns) {
                NextItem::Event(entry) => {
                    self.now_ns = entry.time_ns;
                    return Ok(Some(entry.event));
                }
                NextItem::Reached(time_ns) => {
                    self.now_ns = time_ns;
                    return Ok(None);
                }
                NextItem::NeedRequest => {
                    self.client.prepare_request(until_ns, frames);
                    self.exchange()?;
                }
            }
        }
    }
}

/// The arm's side of a [`LockstepBus`].
#[derive(Debug)]
pub struct LockstepResponder {
    endpoint: Endpoint,
}

impl LockstepResponder {
    /// Opens the arm's side in a folder.
    ///
    /// # Errors
    /// If the folder is not accessible only to its owner, or another process has already opened the arm's side.
    pub fn open(folder: &OwnerFolder) -> Result<LockstepResponder, BusError> {
        let (own, peer) = Side::Arm.sockets();
        Ok(LockstepResponder {
            endpoint: Endpoint::new(folder, own, peer)?,
        })
    }

    /// Serves one request of the host; returns `false` if no request arrived within `timeout_ns` of real time.
    ///
    /// # Errors
    /// If the socket fails. A host that has ended is not an error; another may connect.
    pub fn serve(
        &mut self,
        nodes: &mut impl EmulatedNodes,
        timeout_ns: u64,
    ) -> Result<bool, BusError> {
        let mut bytes = [0; MAX_BYTES];
        let Some(length) = self.receive_message(&mut bytes, timeout_ns)? else {
            return Ok(false);
        };
        let message = Message::parse(&bytes[..length]);
        // With no limit on the arm's time, one call completes the request.
        if let Some(request) = message.filter(|m| m.kind == Kind::RunUntil)
            && let Some(answer) = LockstepServer::new(request).run(nodes, u64::MAX)
        {
            self.endpoint.send(answer.emit(&mut bytes))?;
        }
        Ok(true)
    }

    /// Waits for a datagram of the host and reads it into `bytes`; returns its length, `None` after the timeout.
    fn receive_message(
        &self,
        bytes: &mut [u8],
        timeout_ns: u64,
    ) -> Result<Option<usize>, BusError> {
        if let Some(read) = self.endpoint.receive_into(bytes)? {
            return Ok(Some(read.len()));
        }
        wait_readable_until(&self.endpoint, monotonic_ns() + timeout_ns)?;
        Ok(self.endpoint.receive_into(bytes)?.map(<[u8]>::len))
    }
}

impl AsFd for LockstepResponder {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.endpoint.as_fd()
    }
}
