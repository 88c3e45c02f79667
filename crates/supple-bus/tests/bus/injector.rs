//! Effect of each injected fault on frames, in virtual time.

use std::collections::VecDeque;
use supple_bus::virtual_time::{DirectBus, EmulatedNodes};
use supple_bus::{Bus, BusFault, Event, FaultInjector, FaultKind, FaultRule, TrafficDirection};
use supple_can_frame::{CanFrame, CanId};

/// Records the frames that the host sends, and gives the host its scripted events.
#[derive(Default)]
struct ScriptedNodes {
    now_ns: u64,
    received: Vec<(u64, CanFrame)>,
    events: VecDeque<(u64, Event)>,
}

impl EmulatedNodes for ScriptedNodes {
    fn now_ns(&self) -> u64 {
        self.now_ns
    }

    fn receive_from_host(&mut self, frame: &CanFrame) {
        self.received.push((self.now_ns, *frame));
        self.events.push_front((self.now_ns, Event::Sent(*frame)));
    }

    fn run_until(&mut self, until_ns: u64) -> Option<Event> {
        match self.events.front().copied() {
            Some((due, event)) if due <= until_ns.max(self.now_ns) => {
                self.events.pop_front();
                self.now_ns = self.now_ns.max(due);
                Some(event)
            }
            _ => {
                self.now_ns = self.now_ns.max(until_ns);
                None
            }
        }
    }
}

fn frame(id: u32, payload: &[u8]) -> CanFrame {
    CanFrame::from_raw(id, payload).unwrap()
}

/// Returns a bus with this rule, on which the host receives frames 1 to 4 at 10, 20, 30 and 40 ns.
fn bus_with_four_frames(rule: FaultRule) -> FaultInjector<DirectBus<ScriptedNodes>> {
    let events = (1..=4u8).map(|i| (u64::from(i) * 10, Event::Frame(frame(0x423, &[0, 0, i]))));
    let script = ScriptedNodes {
        events: events.collect(),
        ..ScriptedNodes::default()
    };
    let mut bus = FaultInjector::new(DirectBus(script), 7);
    bus.add(rule);
    bus
}

/// Receives until 100 ns; returns the last payload byte and the time of every received frame.
fn received(bus: &mut impl Bus) -> Vec<(u8, u64)> {
    let mut frames = Vec::new();
    while let Some(event) = bus.receive_until(100).unwrap() {
        if let Event::Frame(frame) = event {
            frames.push((frame.payload()[2], bus.now_ns()));
        }
    }
    assert_eq!(bus.now_ns(), 100);
    frames
}

fn on_third_frame(kind: FaultKind) -> FaultRule {
    FaultRule::always(TrafficDirection::Received, kind).within(30, 31)
}

#[test]
fn received_frames_are_lost_delayed_duplicated_or_reordered() {
    let cases = [
        (FaultKind::Loss, vec![(1, 10), (2, 20), (4, 40)]),
        (FaultKind::SilentLoss, vec![(1, 10), (2, 20), (4, 40)]),
        (
            FaultKind::Delay(25),
            vec![(1, 10), (2, 20), (4, 40), (3, 55)],
        ),
        (
            FaultKind::Duplicate,
            vec![(1, 10), (2, 20), (3, 30), (3, 30), (4, 40)],
        ),
        (
            FaultKind::Reorder(50),
            vec![(1, 10), (2, 20), (4, 40), (3, 40)],
        ),
        // No frame follows within 5 ns: the frame is delayed, not lost.
        (
            FaultKind::Reorder(5),
            vec![(1, 10), (2, 20), (3, 35), (4, 40)],
        ),
    ];
    for (kind, expected) in cases {
        assert_eq!(
            received(&mut bus_with_four_frames(on_third_frame(kind))),
            expected,
            "{kind:?}"
        );
    }
}

#[test]
fn corruption_inverts_one_bit() {
    let mut bus = bus_with_four_frames(on_third_frame(FaultKind::Corrupt));
    let mut frames = Vec::new();
    while let Some(Event::Frame(frame)) = bus.receive_until(100).unwrap() {
        frames.push(frame);
    }
    let word = |frame: &CanFrame| {
        frame
            .payload()
            .iter()
            .fold(0, |w, b| w << 8 | u32::from(*b))
    };
    assert_eq!(frames.len(), 4);
    assert_eq!((word(&frames[2]) ^ 3).count_ones(), 1);
}

#[test]
fn a_lost_frame_is_confirmed_and_a_silently_lost_one_is_not() {
    for (kind, confirmed) in [(FaultKind::Loss, true), (FaultKind::SilentLoss, false)] {
        let mut bus = FaultInjector::new(DirectBus(ScriptedNodes::default()), 1);
        bus.add(FaultRule::always(TrafficDirection::Sent, kind));
        let sent = frame(0x401, &[0xaa; 8]);
        bus.send(&sent).unwrap();
        let event = bus.receive_until(50).unwrap();
        assert_eq!(event, confirmed.then_some(Event::Sent(sent)));
        assert_eq!(bus.inner().0.received, []);
    }
}

#[test]
fn a_delayed_frame_is_confirmed_when_it_is_sent() {
    let mut bus = FaultInjector::new(DirectBus(ScriptedNodes::default()), 1);
    bus.add(FaultRule::always(
        TrafficDirection::Sent,
        FaultKind::Delay(30),
    ));
    let sent = frame(0x401, &[0xaa; 8]);
    bus.send(&sent).unwrap();
    assert_eq!(bus.receive_until(29).unwrap(), None);
    assert_eq!(bus.receive_until(100).unwrap(), Some(Event::Sent(sent)));
    assert_eq!(bus.inner().0.received, [(30, sent)]);
}

#[test]
fn bus_off_blocks_all_frames_and_reports_start_and_end() {
    let mut bus = bus_with_four_frames(
        FaultRule::always(TrafficDirection::Sent, FaultKind::BusOff).within(15, 35),
    );
    let mut events = Vec::new();
    while let Some(event) = bus.receive_until(100).unwrap() {
        events.push((bus.now_ns(), event));
        if event == Event::Fault(BusFault::BusOff) {
            bus.send(&frame(0x401, &[0xaa; 8])).unwrap();
        }
    }
    let arrived = |i: u8| Event::Frame(frame(0x423, &[0, 0, i]));
    assert_eq!(
        events,
        [
            (10, arrived(1)),
            (15, Event::Fault(BusFault::BusOff)),
            (35, Event::Fault(BusFault::Restarted)),
            (40, arrived(4)),
        ]
    );
    assert_eq!(bus.inner().0.received, []);
}

#[test]
fn rules_affect_only_their_frames() {
    let mut bus = FaultInjector::new(DirectBus(ScriptedNodes::default()), 1);
    let torques = |id: CanId| id.raw() == 0x401;
    bus.add(FaultRule::always(TrafficDirection::Sent, FaultKind::SilentLoss).only(torques));
    bus.send(&frame(0x401, &[0xaa; 8])).unwrap();
    bus.send(&frame(0x404, &[0x30])).unwrap();
    let received: Vec<_> = bus
        .inner()
        .0
        .received
        .iter()
        .map(|(_, f)| f.id().raw())
        .collect();
    assert_eq!(received, [0x404]);
}

#[test]
fn losses_follow_the_probability_and_repeat_with_the_seed() {
    let received_with_seed = |seed| {
        let mut bus = FaultInjector::new(DirectBus(ScriptedNodes::default()), seed);
        let rule = FaultRule::always(TrafficDirection::Sent, FaultKind::SilentLoss);
        bus.add(rule.with_probability(0.25));
        for i in 0..4000u32 {
            bus.send(&frame(0x401, &i.to_le_bytes())).unwrap();
        }
        let received: Vec<_> = bus.inner().0.received.iter().map(|(_, f)| *f).collect();
        received
    };
    let received = received_with_seed(3);
    // Four standard deviations of the binomial: 4 sqrt(4000 0.25 0.75) = 110.
    assert!(
        (2890..=3110).contains(&received.len()),
        "{}",
        received.len()
    );
    assert_eq!(received, received_with_seed(3));
    assert_ne!(received, received_with_seed(4));
}
