//! What a host and an arm in another process say to each other where the arm keeps the time: datagrams of
//! 48 bytes, native order.
//!
//! ```text
//! 0 kind   4..8 sequence   8..16 time [ns]   16..32 struct can_frame   32..40 offset [ns]   40..48 sent [ns]
//! host to arm: frame (sent now), run until      arm to host: frame, sent, fault, reached
//! ```
//!
//! An answer carries the sequence of the "run until" that it answers. Where the arm keeps to the wall clock,
//! the offset is that of the machine's monotonic clock over the arm's time, and "sent" is when the host asked
//! by that clock.

use crate::bus::Event;
use crate::can_frame::{CAN_FRAME_BYTES, WireFrame};
use supple_puck::CanFrame;

pub(crate) const MESSAGE_BYTES: usize = 48;

const FRAME: u8 = 1;
const SENT: u8 = 2;
const FAULT: u8 = 3;
const RUN_UNTIL: u8 = 4;
const REACHED: u8 = 5;

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Message {
    pub kind: u8,
    pub sequence: u32,
    pub time_ns: u64,
    pub offset_ns: u64,
    pub sent_ns: u64,
    pub raw: [u8; CAN_FRAME_BYTES],
}

/// What a host asks of the arm.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Asked {
    Frame(CanFrame),
    RunUntil,
}

impl Message {
    /// The host hands over a frame.
    pub fn frame(frame: &CanFrame, time_ns: u64) -> Message {
        Message {
            kind: FRAME,
            time_ns,
            raw: WireFrame::data(frame),
            ..Message::default()
        }
    }

    /// The host waits.
    pub fn run_until(time_ns: u64, sequence: u32) -> Message {
        Message {
            kind: RUN_UNTIL,
            time_ns,
            sequence,
            ..Message::default()
        }
    }

    /// What the arm answers to "run until".
    pub fn answer(event: Option<&Event>, time_ns: u64, sequence: u32, offset_ns: u64) -> Message {
        let (kind, raw) = match event {
            None => (REACHED, [0; CAN_FRAME_BYTES]),
            Some(Event::Frame(frame)) => (FRAME, WireFrame::data(frame)),
            Some(Event::Sent(frame)) => (SENT, WireFrame::data(frame)),
            Some(Event::Fault(fault)) => (FAULT, WireFrame::fault(*fault)),
        };
        Message {
            kind,
            sequence,
            time_ns,
            offset_ns,
            raw,
            ..Message::default()
        }
    }

    /// As an answer: the event, or none where the time was reached; `None` for what is no answer.
    pub fn event(&self) -> Option<Option<Event>> {
        match (self.kind, WireFrame::parse(&self.raw)) {
            (REACHED, _) => Some(None),
            (FRAME, WireFrame::Data(frame)) => Some(Some(Event::Frame(frame))),
            (SENT, WireFrame::Data(frame)) => Some(Some(Event::Sent(frame))),
            (FAULT, WireFrame::Fault(fault)) => Some(Some(Event::Fault(fault))),
            _ => None,
        }
    }

    /// As a question.
    pub fn asked(&self) -> Option<Asked> {
        match (self.kind, WireFrame::parse(&self.raw)) {
            (FRAME, WireFrame::Data(frame)) => Some(Asked::Frame(frame)),
            (RUN_UNTIL, _) => Some(Asked::RunUntil),
            _ => None,
        }
    }

    pub fn emit(&self) -> [u8; MESSAGE_BYTES] {
        let mut bytes = [0; MESSAGE_BYTES];
        bytes[0] = self.kind;
        bytes[4..8].copy_from_slice(&self.sequence.to_ne_bytes());
        bytes[8..16].copy_from_slice(&self.time_ns.to_ne_bytes());
        bytes[16..32].copy_from_slice(&self.raw);
        bytes[32..40].copy_from_slice(&self.offset_ns.to_ne_bytes());
        bytes[40..].copy_from_slice(&self.sent_ns.to_ne_bytes());
        bytes
    }

    pub fn parse(bytes: &[u8; MESSAGE_BYTES]) -> Message {
        let u64_at = |at: usize| {
            let mut raw = [0; 8];
            raw.copy_from_slice(&bytes[at..at + 8]);
            u64::from_ne_bytes(raw)
        };
        let (mut sequence, mut raw) = ([0; 4], [0; CAN_FRAME_BYTES]);
        sequence.copy_from_slice(&bytes[4..8]);
        raw.copy_from_slice(&bytes[16..32]);
        Message {
            kind: bytes[0],
            sequence: u32::from_ne_bytes(sequence),
            time_ns: u64_at(8),
            offset_ns: u64_at(32),
            sent_ns: u64_at(40),
            raw,
        }
    }
}
