//! Lockstep protocol between a host and an arm in another process that owns the time: datagrams, native byte
//! order.
//!
//! ```text
//! 0 kind   4..8 sequence   8..16 time [ns]   16..24 offset [ns]   24..32 sent [ns]   32..36 frames   36..40 entries
//! then for each entry: 0 kind   8..16 time [ns]   16..32 struct can_frame, or 16..88 struct canfd_frame
//! ```
//!
//! A request gives the time to run until, and the frames that the host has sent since the last request, each
//! with its time as an entry of the kind [`Event::Sent`]; in an answer this kind confirms a transmission. The answer contains the events up to its own time: that of the last event, or the requested
//! time if it was reached. `frames` is 0 if the arm must answer at the first event; otherwise the arm answers
//! after that many frames of other nodes (the host sends nothing before), or when the datagram is full. An answer has the sequence
//! number of its request. If the arm is synchronised to the wall clock, the offset is that of the machine's
//! monotonic clock from the arm's time, and "sent" is the time by that clock at which the datagram was sent.

use crate::bus::Event;
use crate::can_frame::{CAN_FRAME_BYTES, DecodedFrame, EncodedFrame, FD_FRAME_BYTES};
use supple_can_frame::CanFrame;

/// Maximum number of entries in a datagram. A classic bus at 1 Mbit/s carries no more frames in three milliseconds.
pub(crate) const ENTRIES: usize = 64;
/// Maximum size of a datagram.
pub(crate) const MAX_BYTES: usize = HEAD_BYTES + ENTRIES * MAX_ENTRY_BYTES;

const HEAD_BYTES: usize = 40;
const ENTRY_HEAD_BYTES: usize = 16;
const MAX_ENTRY_BYTES: usize = ENTRY_HEAD_BYTES + FD_FRAME_BYTES;

const FRAME: u8 = 1;
const SENT: u8 = 2;
const FAULT: u8 = 3;
const RUN_UNTIL: u8 = 4;
const REACHED: u8 = 5;
const STOPPED: u8 = 6;
/// Flag of the kind of an entry with an FD frame.
const FD: u8 = 0x80;

/// Kind of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Request of the host to run until a time.
    RunUntil,
    /// Answer: the arm has reached the requested time.
    Reached,
    /// Answer: the emulated time paused at the last event, before the requested time.
    Stopped,
}

/// An event on the bus with its time \[ns\].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry {
    pub time_ns: u64,
    pub event: Event,
}

/// A request or an answer.
#[derive(Clone, Debug)]
pub(crate) struct Message {
    pub kind: Kind,
    pub sequence: u32,
    pub time_ns: u64,
    pub offset_ns: u64,
    pub sent_ns: u64,
    pub frames: u32,
    entries: [Option<Entry>; ENTRIES],
    count: usize,
}

impl Message {
    /// Creates a message without entries.
    pub fn new(kind: Kind, time_ns: u64, sequence: u32) -> Message {
        Message {
            kind,
            sequence,
            time_ns,
            offset_ns: 0,
            sent_ns: 0,
            frames: 0,
            entries: [None; ENTRIES],
            count: 0,
        }
    }

    /// Appends an entry; false if the message is full.
    pub fn push(&mut self, time_ns: u64, event: Event) -> bool {
        let Some(slot) = self.entries.get_mut(self.count) else {
            return false;
        };
        *slot = Some(Entry { time_ns, event });
        self.count += 1;
        true
    }

    /// Removes all entries.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Whether there are no entries.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Whether no more entries fit.
    pub fn is_full(&self) -> bool {
        self.count == ENTRIES
    }

    /// Entries in order.
    pub fn entries(&self) -> impl Iterator<Item = &Entry> {
        self.entries[..self.count].iter().flatten()
    }

    /// Returns the frame of the host in the entry at `index`, with its time.
    pub fn host_frame(&self, index: usize) -> Option<(u64, CanFrame)> {
        match self.entries[..self.count].get(index)?.as_ref()? {
            Entry {
                time_ns,
                event: Event::Sent(frame),
            } => Some((*time_ns, *frame)),
            _ => None,
        }
    }

    /// Encodes the message; returns the bytes to send.
    pub fn emit<'a>(&self, bytes: &'a mut [u8; MAX_BYTES]) -> &'a [u8] {
        bytes[..HEAD_BYTES].fill(0);
        bytes[0] = match self.kind {
            Kind::RunUntil => RUN_UNTIL,
            Kind::Reached => REACHED,
            Kind::Stopped => STOPPED,
        };
        bytes[4..8].copy_from_slice(&self.sequence.to_ne_bytes());
        bytes[8..16].copy_from_slice(&self.time_ns.to_ne_bytes());
        bytes[16..24].copy_from_slice(&self.offset_ns.to_ne_bytes());
        bytes[24..32].copy_from_slice(&self.sent_ns.to_ne_bytes());
        bytes[32..36].copy_from_slice(&self.frames.to_ne_bytes());
        bytes[36..40].copy_from_slice(&(self.count as u32).to_ne_bytes());
        let mut end = HEAD_BYTES;
        for entry in self.entries() {
            let (kind, raw) = match &entry.event {
                Event::Frame(frame) => (FRAME, EncodedFrame::of_data(frame)),
                Event::Sent(frame) => (SENT, EncodedFrame::of_data(frame)),
                Event::Fault(fault) => (FAULT, EncodedFrame::of_fault(*fault)),
            };
            let fd = if raw.len() == FD_FRAME_BYTES { FD } else { 0 };
            let slot = &mut bytes[end..end + ENTRY_HEAD_BYTES + raw.len()];
            slot[..8].fill(0);
            slot[0] = kind | fd;
            slot[8..16].copy_from_slice(&entry.time_ns.to_ne_bytes());
            slot[ENTRY_HEAD_BYTES..].copy_from_slice(&raw);
            end += slot.len();
        }
        &bytes[..end]
    }

    /// Parses a message; `None` if the bytes are not a message.
    pub fn parse(bytes: &[u8]) -> Option<Message> {
        let kind = match *bytes.first()? {
            RUN_UNTIL => Kind::RunUntil,
            REACHED => Kind::Reached,
            STOPPED => Kind::Stopped,
            _ => return None,
        };
        let mut message = Message::new(kind, u64_at(bytes, 8)?, u32_at(bytes, 4)?);
        message.offset_ns = u64_at(bytes, 16)?;
        message.sent_ns = u64_at(bytes, 24)?;
        message.frames = u32_at(bytes, 32)?;
        let count = usize::try_from(u32_at(bytes, 36)?).ok()?;
        if count > ENTRIES {
            return None;
        }
        let mut rest = bytes.get(HEAD_BYTES..)?;
        for _ in 0..count {
            let kind = *rest.first()?;
            let raw_bytes = match kind & FD {
                0 => CAN_FRAME_BYTES,
                _ => FD_FRAME_BYTES,
            };
            let (slot, after) = rest.split_at_checked(ENTRY_HEAD_BYTES + raw_bytes)?;
            let event = match (kind & !FD, DecodedFrame::decode(&slot[ENTRY_HEAD_BYTES..])) {
                (FRAME, DecodedFrame::Data(frame)) => Event::Frame(frame),
                (SENT, DecodedFrame::Data(frame)) => Event::Sent(frame),
                (FAULT, DecodedFrame::Fault(fault)) => Event::Fault(fault),
                _ => return None,
            };
            message.push(u64_at(slot, 8)?, event);
            rest = after;
        }
        rest.is_empty().then_some(message)
    }
}

fn u64_at(bytes: &[u8], at: usize) -> Option<u64> {
    let raw = bytes.get(at..at + 8)?.try_into().ok()?;
    Some(u64::from_ne_bytes(raw))
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    let raw = bytes.get(at..at + 4)?.try_into().ok()?;
    Some(u32::from_ne_bytes(raw))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::BusFault;
    use supple_can_frame::CanId;

    #[test]
    fn messages_round_trip_and_truncated_ones_are_rejected() {
        let frame = CanFrame::from_raw(0x423, &[1, 2, 3]).expect("a frame");
        let long = CanId::extended(0x8001).expect("an id");
        let long = CanFrame::fd(long, true, &[7; 64]).expect("a frame");
        let mut message = Message::new(Kind::Stopped, 12, 7);
        (message.offset_ns, message.sent_ns, message.frames) = (3, 4, 5);
        for (time_ns, event) in [
            (9, Event::Sent(frame)),
            (10, Event::Frame(frame)),
            (11, Event::Frame(long)),
            (12, Event::Fault(BusFault::BusOff)),
        ] {
            assert!(message.push(time_ns, event));
        }
        let mut bytes = [0; MAX_BYTES];
        let written = message.emit(&mut bytes);
        let read = Message::parse(written).expect("a message");
        assert_eq!(format!("{read:?}"), format!("{message:?}"));
        assert_eq!(read.host_frame(0), Some((9, frame)));
        assert_eq!(read.host_frame(1), None);
        for length in 0..written.len() {
            assert!(Message::parse(&written[..length]).is_none(), "{length}");
        }
        message.clear();
        while message.push(12, Event::Frame(long)) {}
        assert!(message.is_full());
        assert_eq!(message.emit(&mut bytes).len(), MAX_BYTES);
    }
}
