//! Server side of the lockstep protocol: one request of the host in progress.

use crate::bus::Event;
use crate::emulated_nodes::EmulatedNodes;
use crate::message::{Kind, Message};

/// A request in progress, with its partial answer.
#[derive(Debug)]
pub(crate) struct LockstepServer {
    request: Message,
    /// Number of the host's frames that have been delivered.
    delivered: usize,
    answer: Message,
    /// Number of frames of other nodes in the answer.
    frames: u32,
}

impl LockstepServer {
    /// Creates the server of a request that has not been started.
    pub fn new(request: Message) -> LockstepServer {
        LockstepServer {
            answer: Message::new(Kind::Stopped, 0, request.sequence),
            request,
            delivered: 0,
            frames: 0,
        }
    }

    /// Advances the arm by at most `max_ns` of its time; returns the answer once it is complete.
    pub fn run(&mut self, nodes: &mut impl EmulatedNodes, max_ns: u64) -> Option<&mut Message> {
        let end_ns = nodes.now_ns().saturating_add(max_ns);
        loop {
            // All frames of the request are delivered before the answer.
            let frame = self.request.host_frame(self.delivered);
            if frame.is_none() && self.is_complete() {
                return Some(self.finish(Kind::Stopped, nodes.now_ns()));
            }
            let until_ns = frame.map_or(self.request.time_ns, |(time_ns, _)| time_ns);
            let until_ns = until_ns.max(nodes.now_ns());
            match (nodes.run_until(until_ns.min(end_ns)), frame) {
                (Some(event), _) => {
                    self.answer.push(nodes.now_ns(), event);
                    self.frames += u32::from(matches!(event, Event::Frame(_)));
                }
                (None, _) if nodes.now_ns() < until_ns => return None,
                (None, Some((_, frame))) => {
                    nodes.receive_from_host(&frame);
                    self.delivered += 1;
                }
                (None, None) => return Some(self.finish(Kind::Reached, nodes.now_ns())),
            }
        }
    }

    /// Whether the answer contains enough events to be sent.
    fn is_complete(&self) -> bool {
        match self.request.frames {
            0 => !self.answer.is_empty(),
            frames => self.frames >= frames || self.answer.is_full(),
        }
    }

    fn finish(&mut self, kind: Kind, time_ns: u64) -> &mut Message {
        self.answer.kind = kind;
        self.answer.time_ns = time_ns;
        &mut self.answer
    }
}
