//! A question of the host, as the arm's process works through it.

use crate::bus::Event;
use crate::message::{Kind, Message};
use crate::virtual_time::Peer;

/// A question under way, with its answer as far as it has come.
#[derive(Debug)]
pub(crate) struct Asked {
    question: Message,
    /// Frames of the host that have been taken over.
    taken: usize,
    answer: Message,
    /// Frames of others among what has happened.
    frames: u32,
}

impl Asked {
    /// Nothing of it done yet.
    pub fn new(question: Message) -> Asked {
        Asked {
            answer: Message::new(Kind::Stopped, 0, question.sequence),
            question,
            taken: 0,
            frames: 0,
        }
    }

    /// Runs the arm on, at most for `most_ns` of its time; the answer, once there is one.
    pub fn run(&mut self, peer: &mut impl Peer, most_ns: u64) -> Option<&mut Message> {
        let end_ns = peer.now_ns().saturating_add(most_ns);
        loop {
            // What the host has said already is heard before anything is answered.
            let frame = self.question.handed_over(self.taken);
            if frame.is_none() && self.is_enough() {
                return Some(self.ended(Kind::Stopped, peer.now_ns()));
            }
            let until_ns = frame.map_or(self.question.time_ns, |(time_ns, _)| time_ns);
            let until_ns = until_ns.max(peer.now_ns());
            match (peer.run_until(until_ns.min(end_ns)), frame) {
                (Some(event), _) => {
                    self.answer.push(peer.now_ns(), event);
                    self.frames += u32::from(matches!(event, Event::Frame(_)));
                }
                (None, _) if peer.now_ns() < until_ns => return None,
                (None, Some((_, frame))) => {
                    peer.host_sends(&frame);
                    self.taken += 1;
                }
                (None, None) => return Some(self.ended(Kind::Reached, peer.now_ns())),
            }
        }
    }

    /// The host is to hear what there is.
    fn is_enough(&self) -> bool {
        match self.question.frames {
            0 => !self.answer.is_empty(),
            frames => self.frames >= frames || self.answer.is_full(),
        }
    }

    fn ended(&mut self, kind: Kind, time_ns: u64) -> &mut Message {
        self.answer.kind = kind;
        self.answer.time_ns = time_ns;
        &mut self.answer
    }
}
