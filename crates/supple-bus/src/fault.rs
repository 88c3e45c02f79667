//! Fault injection: [`FaultInjector`] wraps any bus.
//!
//! A [`FaultRule`] specifies the fault, the frames, the time window, and the probability. Time is bus time; the
//! random numbers come from a seed, so that runs are reproducible. Delayed frames and events are released in the
//! order of their due times.

use crate::bus::{Bus, BusFault, Event};
use crate::error::BusError;
use std::collections::VecDeque;
use supple_can_frame::{CanFrame, CanId, MAX_FD_BYTES};
use supple_random::Random;

/// Direction of the frames that a rule affects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrafficDirection {
    /// Frames that this node sends.
    Sent,
    /// Frames that this node receives.
    Received,
}

/// Kind of fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultKind {
    /// The frame is lost. A sent frame is still confirmed, as if it were lost after the CAN controller sent it.
    Loss,
    /// A sent frame is neither transmitted nor confirmed, and no error is reported: a silent failure of the
    /// transmit buffer. Received frames are lost.
    SilentLoss,
    /// The frame is delayed by this many nanoseconds; later frames may overtake it.
    Delay(u64),
    /// The frame arrives twice.
    Duplicate,
    /// The frame is swapped with the next frame, or delayed by this many nanoseconds if none follows.
    Reorder(u64),
    /// One bit of the payload is inverted, without a checksum error.
    Corrupt,
    /// The CAN controller goes bus-off: the fault is reported once, and nothing is sent, received or confirmed
    /// until the rule ends; then the CAN controller restarts.
    BusOff,
}

/// A fault with its time window.
#[derive(Clone, Copy, Debug)]
pub struct FaultRule {
    /// Direction. Ignored for [`FaultKind::BusOff`].
    pub traffic: TrafficDirection,
    /// Frames that the rule affects; `None` for all.
    pub only: Option<fn(CanId) -> bool>,
    /// Start of the window in bus time \[ns\].
    pub from_ns: u64,
    /// End of the window in bus time \[ns\].
    pub until_ns: u64,
    /// Probability for each frame, 0 to 1.
    pub probability: f64,
    /// Kind of fault.
    pub kind: FaultKind,
}

impl FaultRule {
    /// Returns a rule that affects every frame of a direction, at all times.
    pub fn always(traffic: TrafficDirection, kind: FaultKind) -> FaultRule {
        FaultRule {
            traffic,
            only: None,
            from_ns: 0,
            until_ns: u64::MAX,
            probability: 1.0,
            kind,
        }
    }

    /// Limits the rule to a time window \[ns\].
    pub fn within(self, from_ns: u64, until_ns: u64) -> FaultRule {
        FaultRule {
            from_ns,
            until_ns,
            ..self
        }
    }

    /// Limits the rule to frames whose id satisfies `ids`.
    pub fn only(self, ids: fn(CanId) -> bool) -> FaultRule {
        FaultRule {
            only: Some(ids),
            ..self
        }
    }

    /// Sets the probability with which the rule affects each frame, 0 to 1.
    pub fn with_probability(self, probability: f64) -> FaultRule {
        FaultRule {
            probability,
            ..self
        }
    }

    fn covers(&self, now_ns: u64) -> bool {
        (self.from_ns..self.until_ns).contains(&now_ns)
    }
}

/// A bus with injected faults.
#[derive(Debug)]
pub struct FaultInjector<B> {
    bus: B,
    rules: Vec<FaultRule>,
    random: Random,
    /// Delayed events for the host, each with its due time \[ns\]; sorted by due time.
    events: VecDeque<(u64, Event)>,
    /// Delayed frames of the host, each with its due time \[ns\]; sorted by due time.
    frames: VecDeque<(u64, CanFrame)>,
    /// A received frame that is held back until the next one has been delivered, at the latest until this time \[ns\].
    held_back: Option<(u64, Event)>,
    bus_off: bool,
}

impl<B: Bus> FaultInjector<B> {
    /// Wraps a bus, without faults at first.
    pub fn new(bus: B, seed: u64) -> FaultInjector<B> {
        FaultInjector {
            bus,
            rules: Vec::new(),
            random: Random::new(seed),
            events: VecDeque::with_capacity(256),
            frames: VecDeque::with_capacity(256),
            held_back: None,
            bus_off: false,
        }
    }

    /// Adds a rule. If several rules match a frame, the first one added applies.
    pub fn add(&mut self, rule: FaultRule) {
        self.rules.push(rule);
    }

    /// Removes all rules; delayed frames are still delivered.
    pub fn clear(&mut self) {
        self.rules.clear();
    }

    /// The wrapped bus.
    pub fn inner(&self) -> &B {
        &self.bus
    }

    /// The wrapped bus.
    pub fn inner_mut(&mut self) -> &mut B {
        &mut self.bus
    }

    fn happens(&mut self, probability: f64) -> bool {
        let unit = self.random.uniform();
        unit < probability
    }

    fn fault_for(&mut self, traffic: TrafficDirection, id: CanId) -> Option<FaultKind> {
        let now = self.bus.now_ns();
        for i in 0..self.rules.len() {
            let rule = self.rules[i];
            let matches = rule.kind != FaultKind::BusOff
                && rule.traffic == traffic
                && rule.covers(now)
                && rule.only.is_none_or(|ids| ids(id));
            if matches && self.happens(rule.probability) {
                return Some(rule.kind);
            }
        }
        None
    }

    fn corrupted(&mut self, frame: &CanFrame) -> CanFrame {
        let bits = 8 * frame.payload().len() as u64;
        if bits == 0 {
            return *frame;
        }
        let bit = self.random.below(bits) as usize;
        let mut payload = [0; MAX_FD_BYTES];
        let length = frame.payload().len();
        payload[..length].copy_from_slice(frame.payload());
        payload[bit / 8] ^= 1 << (bit % 8);
        CanFrame::of_format(frame.id(), frame.format(), &payload[..length]).unwrap_or(*frame)
    }

    fn delay_event(&mut self, due_ns: u64, event: Event) {
        let at = self.events.partition_point(|(due, _)| *due <= due_ns);
        self.events.insert(at, (due_ns, event));
    }

    fn delay_frame(&mut self, due_ns: u64, frame: CanFrame) {
        let at = self.frames.partition_point(|(due, _)| *due <= due_ns);
        self.frames.insert(at, (due_ns, frame));
    }

    /// Updates the bus-off state from the rules; returns the event if the state has changed.
    fn update_bus_off(&mut self) -> Option<Event> {
        let now = self.bus.now_ns();
        let mut rules = self.rules.iter();
        let bus_off = rules.any(|rule| rule.kind == FaultKind::BusOff && rule.covers(now));
        let changed = bus_off != self.bus_off;
        self.bus_off = bus_off;
        changed.then_some(Event::Fault(if bus_off {
            BusFault::BusOff
        } else {
            BusFault::Restarted
        }))
    }

    /// Time of the next delayed event or frame, or of the next start or end of a bus-off window \[ns\].
    fn next_due_ns(&self) -> u64 {
        let now = self.bus.now_ns();
        let windows = self.rules.iter().filter(|r| r.kind == FaultKind::BusOff);
        let window_bounds = windows.flat_map(|rule| [rule.from_ns, rule.until_ns]);
        let events = self.events.front().map(|(due, _)| *due);
        let frames = self.frames.front().map(|(due, _)| *due);
        let held_back = self.held_back.map(|(due, _)| due);
        let delayed = [events, frames, held_back].into_iter().flatten();
        let window_bound = window_bounds.filter(|bound| *bound > now).min();
        delayed.chain(window_bound).min().unwrap_or(u64::MAX)
    }

    /// Sends the delayed frames that are due. Returns a change of the bus-off state, or else a delayed event that is
    /// due.
    fn release_due(&mut self) -> Result<Option<Event>, BusError> {
        if let Some(event) = self.update_bus_off() {
            return Ok(Some(event));
        }
        let now = self.bus.now_ns();
        while let Some((due, frame)) = self.frames.front().copied() {
            if due > now {
                break;
            }
            self.frames.pop_front();
            self.bus.send(&frame)?;
        }
        if let Some((due, event)) = self.held_back
            && due <= now
        {
            self.held_back = None;
            return Ok(Some(event));
        }
        match self.events.front().copied() {
            Some((due, event)) if due <= now => {
                self.events.pop_front();
                Ok(Some(event))
            }
            _ => Ok(None),
        }
    }

    /// Applies the rules to a received frame.
    fn apply_to_received(&mut self, frame: CanFrame) -> Option<Event> {
        let now = self.bus.now_ns();
        let event = Event::Frame(frame);
        let kind = self.fault_for(TrafficDirection::Received, frame.id());
        if let (Some((_, earlier)), None) = (self.held_back, kind) {
            self.held_back = None;
            self.delay_event(now, earlier);
            return Some(event);
        }
        match kind {
            None | Some(FaultKind::BusOff) => Some(event),
            Some(FaultKind::Loss | FaultKind::SilentLoss) => None,
            Some(FaultKind::Delay(delay_ns)) => {
                self.delay_event(now + delay_ns, event);
                None
            }
            Some(FaultKind::Duplicate) => {
                self.delay_event(now, event);
                Some(event)
            }
            Some(FaultKind::Reorder(delay_ns)) => match self.held_back.take() {
                Some((_, earlier)) => {
                    self.delay_event(now, earlier);
                    Some(event)
                }
                None => {
                    self.held_back = Some((now + delay_ns, event));
                    None
                }
            },
            Some(FaultKind::Corrupt) => Some(Event::Frame(self.corrupted(&frame))),
        }
    }
}

impl<B: Bus> Bus for FaultInjector<B> {
    fn carries_fd(&self) -> bool {
        self.bus.carries_fd()
    }

    fn clock_stall_ns(&self) -> u64 {
        self.bus.clock_stall_ns()
    }

    fn monotonic_ns(&self, time_ns: u64) -> u64 {
        self.bus.monotonic_ns(time_ns)
    }

    fn now_ns(&self) -> u64 {
        self.bus.now_ns()
    }

    fn send(&mut self, frame: &CanFrame) -> Result<(), BusError> {
        let now = self.bus.now_ns();
        if let Some(event) = self.update_bus_off() {
            self.delay_event(now, event);
        }
        if self.bus_off {
            return Ok(());
        }
        match self.fault_for(TrafficDirection::Sent, frame.id()) {
            None | Some(FaultKind::BusOff) => self.bus.send(frame),
            Some(FaultKind::Loss) => {
                self.delay_event(now, Event::Sent(*frame));
                Ok(())
            }
            Some(FaultKind::SilentLoss) => Ok(()),
            Some(FaultKind::Delay(delay_ns) | FaultKind::Reorder(delay_ns)) => {
                self.delay_frame(now + delay_ns, *frame);
                Ok(())
            }
            Some(FaultKind::Duplicate) => {
                self.bus.send(frame)?;
                self.bus.send(frame)
            }
            Some(FaultKind::Corrupt) => {
                let corrupted = self.corrupted(frame);
                self.bus.send(&corrupted)
            }
        }
    }

    fn receive_until(&mut self, until_ns: u64) -> Result<Option<Event>, BusError> {
        loop {
            if let Some(event) = self.release_due()? {
                return Ok(Some(event));
            }
            let target = until_ns.min(self.next_due_ns());
            match self.bus.receive_until(target)? {
                Some(_) if self.bus_off => {}
                Some(Event::Frame(frame)) => {
                    if let Some(event) = self.apply_to_received(frame) {
                        return Ok(Some(event));
                    }
                }
                Some(event) => return Ok(Some(event)),
                None if self.bus.now_ns() >= until_ns && self.next_due_ns() > until_ns => {
                    return self.release_due();
                }
                None => {}
            }
        }
    }
}
