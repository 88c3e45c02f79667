//! Conformance tests of a bus. Each test receives the host's side of the bus under test.

use crate::echo::echo_of;
use supple_bus::{Bus, BusError, Event};
use supple_can_frame::{CanFrame, CanId};

/// Timeout of an answer: long enough for a thread to be scheduled on a busy machine \[ns\]. Only a failed test reaches it.
const ANSWER_TIMEOUT_NS: u64 = 10_000_000_000;
/// Duration of a wait without events \[ns\].
const WAIT_NS: u64 = 3_000_000;

type BusUnderTest = Box<dyn Bus>;

fn frame(id: u32, payload: &[u8]) -> CanFrame {
    CanFrame::from_raw(id, payload).unwrap()
}

fn next(bus: &mut BusUnderTest) -> Event {
    let until_ns = bus.now_ns() + ANSWER_TIMEOUT_NS;
    loop {
        if let Some(event) = bus.receive_until(until_ns).unwrap() {
            return event;
        }
        assert!(bus.now_ns() < until_ns, "no event arrived");
    }
}

/// Receives until `frames` frames are confirmed and answered; returns the confirmed frames and the answers, each in order.
fn collect(bus: &mut BusUnderTest, frames: usize) -> (Vec<CanFrame>, Vec<CanFrame>) {
    let (mut sent, mut answers) = (Vec::new(), Vec::new());
    while sent.len() < frames || answers.len() < frames {
        match next(bus) {
            Event::Sent(frame) => sent.push(frame),
            Event::Frame(frame) => answers.push(frame),
            Event::Fault(fault) => panic!("{fault}"),
        }
    }
    (sent, answers)
}

pub fn a_frame_is_confirmed_once_and_then_answered(mut bus: BusUnderTest) {
    let poll = frame(0x404, &[0x30]);
    bus.send(&poll).unwrap();
    assert_eq!(next(&mut bus), Event::Sent(poll));
    assert_eq!(next(&mut bus), Event::Frame(echo_of(&poll)));
    let until_ns = bus.now_ns() + WAIT_NS;
    assert_eq!(bus.receive_until(until_ns).unwrap(), None);
}

pub fn frames_of_every_length_and_id_arrive_unchanged(mut bus: BusUnderTest) {
    let payload = [0x80, 0, 0xff, 1, 0x55, 0xaa, 0x7f, 0xfe];
    for (length, id) in [
        0x000, 0x001, 0x0ff, 0x400, 0x401, 0x404, 0x41f, 0x01f, 0x00a,
    ]
    .into_iter()
    .enumerate()
    {
        let sent = frame(id, &payload[..length]);
        bus.send(&sent).unwrap();
        let (confirmed, answers) = collect(&mut bus, 1);
        assert_eq!(confirmed, [sent]);
        assert_eq!(answers[0].payload(), sent.payload());
        assert_eq!(answers[0].id(), CanId::standard(0x426).unwrap());
    }
}

/// A bus without CAN FD refuses to send the FD frames.
pub fn fd_frames_of_every_length_with_either_id_format_arrive_unchanged(mut bus: BusUnderTest) {
    let extended = CanId::extended(0x1234_5678).unwrap();
    let classic = CanFrame::new(extended, &[1, 2, 3]).unwrap();
    let payload: Vec<u8> = (0..64).collect();
    let lengths = [0, 1, 8, 12, 16, 20, 24, 32, 48, 64];
    let fd = lengths.into_iter().flat_map(|length| {
        let standard = CanId::standard(0x001).unwrap();
        [standard, extended].map(|id| CanFrame::fd(id, length > 8, &payload[..length]).unwrap())
    });
    for sent in core::iter::once(classic).chain(fd) {
        if sent.is_fd() && !bus.carries_fd() {
            assert!(matches!(bus.send(&sent), Err(BusError::ClassicOnly { .. })));
            continue;
        }
        bus.send(&sent).unwrap();
        let (confirmed, answers) = collect(&mut bus, 1);
        assert_eq!(confirmed, [sent]);
        assert_eq!(answers, [echo_of(&sent)]);
    }
}

pub fn frames_arrive_in_the_order_in_which_they_were_sent(mut bus: BusUnderTest) {
    let sent: Vec<_> = (0..5).map(|i| frame(0x401, &[i])).collect();
    for frame in &sent {
        bus.send(frame).unwrap();
    }
    let (confirmed, answers) = collect(&mut bus, sent.len());
    assert_eq!(confirmed, sent);
    let expected: Vec<_> = sent.iter().map(echo_of).collect();
    assert_eq!(answers, expected);
}

/// Each cycle sends eight frames, as for an arm of seven joints.
pub fn no_frame_of_repeated_cycles_is_lost(mut bus: BusUnderTest) {
    for cycle in 0..200u8 {
        let sent: Vec<_> = (0..8)
            .map(|i| frame(0x400 | u32::from(i), &[cycle, i]))
            .collect();
        for frame in &sent {
            bus.send(frame).unwrap();
        }
        let (confirmed, answers) = collect(&mut bus, sent.len());
        assert_eq!(confirmed, sent);
        assert_eq!(answers.len(), sent.len());
    }
}

pub fn lookahead_gives_the_same_events_in_the_same_order(mut bus: BusUnderTest) {
    let sent: Vec<_> = (0..4).map(|i| frame(0x404, &[i])).collect();
    for frame in &sent {
        bus.send(frame).unwrap();
    }
    let until_ns = bus.now_ns() + ANSWER_TIMEOUT_NS;
    let (mut confirmed, mut answers) = (Vec::new(), Vec::new());
    while answers.len() < sent.len() {
        let missing = (sent.len() - answers.len()) as u32;
        match bus.receive_with_lookahead(until_ns, missing).unwrap() {
            Some(Event::Sent(frame)) => confirmed.push(frame),
            Some(Event::Frame(frame)) => answers.push(frame),
            other => panic!("{other:?}"),
        }
    }
    // The bus time is the time of the last answer, not the end of the wait.
    assert!(bus.now_ns() < until_ns);
    assert_eq!(confirmed, sent);
    assert_eq!(answers, sent.iter().map(echo_of).collect::<Vec<_>>());
    let until_ns = bus.now_ns() + WAIT_NS;
    assert_eq!(bus.receive_with_lookahead(until_ns, 1).unwrap(), None);
    assert!(bus.now_ns() >= until_ns);
}

pub fn receive_without_events_returns_at_the_deadline(mut bus: BusUnderTest) {
    let until_ns = bus.now_ns() + WAIT_NS;
    // A signal may end the wait in the kernel early; the bus then continues to wait.
    assert_eq!(bus.receive_until(until_ns).unwrap(), None);
    assert!(bus.now_ns() >= until_ns);
}

pub fn receive_with_a_past_deadline_returns_without_waiting(mut bus: BusUnderTest) {
    assert_eq!(bus.receive_until(0).unwrap(), None);
    let poll = frame(0x404, &[0x30]);
    bus.send(&poll).unwrap();
    collect(&mut bus, 1);
    assert_eq!(bus.receive_until(0).unwrap(), None);
}

pub fn bus_time_never_decreases(mut bus: BusUnderTest) {
    let mut last_ns = bus.now_ns();
    for i in 0..20u8 {
        bus.send(&frame(0x404, &[i])).unwrap();
        for _ in 0..2 {
            next(&mut bus);
            assert!(bus.now_ns() >= last_ns);
            last_ns = bus.now_ns();
        }
    }
}
