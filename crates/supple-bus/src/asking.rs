//! A host's side of a conversation with an arm in another process: what it has handed over and not said yet,
//! what it was answered and has not taken in yet.

use crate::bus::Event;
use crate::endpoint::{Delivery, Endpoint};
use crate::error::BusError;
use crate::message::{ENTRIES, Entry, Kind, LONGEST_BYTES, Message};
use std::collections::VecDeque;
use supple_puck::CanFrame;

#[derive(Debug)]
pub(crate) struct Asking {
    question: Message,
    heard: VecDeque<Entry>,
    /// The arm has run to here with nothing more to tell \[ns\].
    reached_ns: Option<u64>,
    bytes: [u8; LONGEST_BYTES],
}

/// What comes next of an answer.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Next {
    Event(Entry),
    /// The time that was asked for \[ns\].
    Reached(u64),
    /// Nothing: the arm has to be asked.
    Ask,
}

impl Asking {
    pub fn new() -> Asking {
        Asking {
            question: Message::new(Kind::RunUntil, 0, 0),
            heard: VecDeque::with_capacity(ENTRIES),
            reached_ns: None,
            bytes: [0; LONGEST_BYTES],
        }
    }

    /// The arm is to hear this at `time_ns`, with the next question.
    pub fn hand_over(&mut self, frame: &CanFrame, time_ns: u64) -> Result<(), BusError> {
        match self.question.push(time_ns, Event::Sent(*frame)) {
            true => Ok(()),
            false => Err(BusError::Full),
        }
    }

    /// What is there already for a host that waits until `until_ns`.
    pub fn next(&mut self, until_ns: u64) -> Next {
        if let Some(entry) = self.heard.pop_front() {
            return Next::Event(entry);
        }
        match self.reached_ns.take() {
            Some(reached_ns) if until_ns <= reached_ns && self.question.is_empty() => {
                Next::Reached(reached_ns)
            }
            _ => Next::Ask,
        }
    }

    /// The next question, with all that was handed over.
    pub fn ask(&mut self, until_ns: u64, frames: u32) -> &mut Message {
        self.question.sequence = self.question.sequence.wrapping_add(1);
        self.question.time_ns = until_ns;
        self.question.frames = frames;
        &mut self.question
    }

    /// Posts the question as it is.
    pub fn post(&mut self, endpoint: &Endpoint) -> Result<Delivery, BusError> {
        endpoint.send(self.question.emit(&mut self.bytes))
    }

    /// The question is over, answered or not: what was handed over with it is not handed over again.
    pub fn over(&mut self) {
        self.question.clear();
    }

    /// The answer to the last question if it is there. Answers to older ones, which were waited for in vain,
    /// are passed over: what they tell did not come.
    pub fn answer(&mut self, endpoint: &Endpoint) -> Result<Option<Message>, BusError> {
        while let Some(bytes) = endpoint.receive_into(&mut self.bytes)? {
            let answer = Message::parse(bytes).filter(|m| m.kind != Kind::RunUntil);
            if let Some(answer) = answer
                && answer.sequence == self.question.sequence
            {
                self.heard.extend(answer.entries());
                self.reached_ns = (answer.kind == Kind::Reached).then_some(answer.time_ns);
                return Ok(Some(answer));
            }
        }
        Ok(None)
    }
}
