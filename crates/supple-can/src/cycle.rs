//! The cycle: positions in, torques out, once a period.
//!
//! ```text
//! 0  request positions -> collect replies -> motors to joints -> publish -> wait for the answer
//!    -> guard -> joints to motors -> torque frames -> a further poll, if it fits -> drain until the
//!    next period: every frame of the cycle has to have left by then
//! ```
//!
//! It computes no torques. A cycle allocates nothing, locks nothing and logs nothing.

use crate::bus_time::BusTime;
use crate::error::CanError;
use crate::guard::{Action, Guard, Loss, Seen, Torque};
use crate::link::{ArmReport, Command, Counters, Drives, Link};
use crate::outbox::Outbox;
use crate::sensor::Readings;
use crate::start_up::Ready;
use supple_bus::{Bus, BusError, BusFault, Event};
use supple_core::drive_guard::DriveGuard;
use supple_core::dynamics::tip_pose;
use supple_core::{Arm, Config, Vector};
use supple_puck::force_torque;
use supple_puck::property::{get, set};
use supple_puck::safety::{PenWord, Pendant, SafetyMode};
use supple_puck::timing::bits;
use supple_puck::{
    CanFrame, Counts, GroupId, Inbound, NodeId, PackedTorques, Property, PropertyId, PuckTorque,
    Value,
};

/// How often the further polls come round, in cycles of the bus's time \[ns\].
const FURTHER_NS: u64 = 10_000_000;

/// What the cycle is told before it begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rhythm {
    /// Period \[ns\].
    pub period_ns: u64,
    /// Time kept for the controller's answer when the period is checked \[ns\].
    pub answer_ns: u64,
}

/// Ids that the cycle uses.
#[derive(Clone, Copy, Debug)]
struct Ids {
    position: PropertyId,
    torque: PropertyId,
    motor_mode: PropertyId,
    module_mode: PropertyId,
    pendant: PropertyId,
}

/// A further poll.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Further {
    Mode,
    Pendant,
    Sensor,
}

/// The arm in service.
pub struct Cycle<const N: usize, B, L> {
    bus: B,
    link: L,
    ready: Ready<N>,
    arm: Arm<N>,
    ids: Ids,
    rhythm: Rhythm,
    time: BusTime,
    guard: Guard,
    drives: DriveGuard<N>,
    cycle: u64,
    next_ns: u64,
    counts: [Option<Counts>; N],
    /// Joint angles when all were known last.
    pose: Vector<N>,
    readings: Readings,
    module: Option<(SafetyMode, u64)>,
    pendant: Option<Pendant>,
    outbox: Outbox,
    further: Further,
    further_due_ns: u64,
    sent_request: bool,
    unsent: bool,
    bus_off: bool,
    bits: u64,
    fallback_nm: Vector<N>,
    counters: Counters,
    leaving: bool,
}

impl<const N: usize, B: Bus, L: Link<N>> Cycle<N, B, L> {
    /// Takes an arm that is ready into service.
    ///
    /// # Errors
    /// [`CanError::Overload`] for a period that the bus does not carry; a firmware that lacks a property.
    pub fn new(
        bus: B,
        link: L,
        ready: Ready<N>,
        config: &Config<N>,
        rhythm: Rhythm,
    ) -> Result<Cycle<N, B, L>, CanError> {
        let joint_encoders = ready.pucks.iter().filter(|p| p.joint_encoder).count();
        let time = BusTime::new(N, joint_encoders, ready.sensor, rhythm.answer_ns);
        time.check(rhythm.period_ns)?;
        let motor = ready.pucks[0];
        let listed = |table: supple_puck::PropertyTable, node: NodeId, property: Property| {
            table.id(property).ok_or(CanError::Property {
                node: node.number(),
                version: motor.version,
                property,
            })
        };
        let ids = Ids {
            position: motor.position,
            torque: motor.torque,
            motor_mode: listed(motor.table, motor.node, Property::MODE)?,
            module_mode: listed(ready.module, NodeId::SAFETY, Property::MODE)?,
            pendant: listed(ready.module, NodeId::SAFETY, Property::PEN)?,
        };
        let next_ns = bus.now_ns();
        Ok(Cycle {
            bus,
            link,
            ready,
            arm: config.arm,
            drives: DriveGuard::new(config),
            ids,
            rhythm,
            time,
            guard: Guard::new(),
            cycle: 0,
            next_ns,
            counts: [None; N],
            pose: Vector::zeros(),
            readings: Readings::default(),
            module: None,
            pendant: None,
            outbox: Outbox::default(),
            further: Further::Mode,
            further_due_ns: next_ns,
            sent_request: false,
            unsent: false,
            bus_off: false,
            bits: 0,
            fallback_nm: Vector::zeros(),
            counters: Counters::default(),
            leaving: false,
        })
    }

    /// From now on the motors are to be lowered: the program is about to end.
    pub fn leave(&mut self) {
        self.leaving = true;
    }

    /// How it fares.
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// The safe action and its reasons.
    pub fn guard(&self) -> &Guard {
        &self.guard
    }

    /// What the motors do, as far as the safety module has said.
    pub fn drives(&self) -> Drives {
        match self.module {
            Some((SafetyMode::Active, _)) => Drives::Active,
            Some((SafetyMode::EStop, _)) => Drives::Off,
            Some((SafetyMode::Idle, _)) | None => Drives::Idle,
        }
    }

    /// Some motor puck replied in the last cycle.
    pub fn hears_motors(&self) -> bool {
        self.counts.iter().any(Option::is_some)
    }

    /// The pendant as it was last read.
    pub fn pendant(&self) -> Option<&Pendant> {
        self.pendant.as_ref()
    }

    /// Number of the next cycle.
    pub fn cycle_number(&self) -> u64 {
        self.cycle
    }

    /// The bus.
    pub fn bus(&self) -> &B {
        &self.bus
    }

    /// The bus.
    pub fn bus_mut(&mut self) -> &mut B {
        &mut self.bus
    }

    /// The way to the controller.
    pub fn link_mut(&mut self) -> &mut L {
        &mut self.link
    }

    /// Bus, way to the controller and description of what is there, when service ends.
    pub fn into_parts(self) -> (B, L, Ready<N>) {
        (self.bus, self.link, self.ready)
    }

    /// One cycle, to the beginning of the next period.
    ///
    /// # Errors
    /// Where the bus or the way to the controller is gone; faults on the bus are dealt with.
    pub fn run(&mut self) -> Result<Action, CanError> {
        let start_ns = self.begin()?;
        let missing = self.collect(start_ns)?;
        let report = self.report(start_ns);
        let published_ns = self.bus.now_ns();
        self.link.publish(&report)?;
        let command = self.answer(start_ns, published_ns)?;
        self.drives.observe(&report.position_rad);
        let active = self.drives() == Drives::Active;
        let judged = self
            .drives
            .judge(command.as_ref().map(Command::drive).as_ref(), active);
        let seen = Seen {
            now_ns: self.bus.now_ns(),
            answer: command.map(|command| command.wants_torque),
            judged: judged.err().map(Loss::from),
            missing,
            unsent: self.unsent,
            bus_off: self.bus_off,
            module: self.module,
            leaving: self.leaving,
        };
        let action = self.guard.cycle(&seen);
        self.act(&action, command.as_ref())?;
        self.poll_further(&action)?;
        self.drain()?;
        Ok(action)
    }

    /// Takes up the period; one that is long past is passed over, its number with it, and so is one of which
    /// too little is left for replies, answer and torques: motors that are not heard in it are not silent.
    fn begin(&mut self) -> Result<u64, CanError> {
        let now_ns = self.bus.now_ns();
        let period_ns = self.rhythm.period_ns;
        let late_ns = now_ns.saturating_sub(self.next_ns);
        self.pass_over(late_ns / period_ns);
        if late_ns % period_ns > self.time.slack_ns(period_ns) {
            self.pass_over(1);
            self.listen()?;
        }
        self.counters.wake_ns = late_ns;
        self.counters.cycles += 1;
        self.counters.bus_load = self.bits as f64 * 1e3 / period_ns as f64;
        self.bits = 0;
        self.counters.stood_still_ns = self.bus.stood_still_ns();
        let start_ns = self.next_ns;
        self.next_ns += period_ns;
        Ok(start_ns)
    }

    fn pass_over(&mut self, periods: u64) {
        self.cycle += periods;
        self.next_ns += periods * self.rhythm.period_ns;
        self.counters.skipped += periods;
    }

    /// Asks for the positions and collects the replies; which motors did not reply to a request that left.
    fn collect(&mut self, start_ns: u64) -> Result<u8, CanError> {
        self.counts = [None; N];
        let request = get(GroupId::ARM, self.ids.position);
        self.send(&request)?;
        self.link.announce()?;
        // Later than this the answer and the torques would not fit any more.
        let reserved_ns = self.time.torques_ns + self.rhythm.answer_ns;
        let until_ns = start_ns + self.rhythm.period_ns - reserved_ns;
        loop {
            let waited_for = self.counts.iter().filter(|counts| counts.is_none()).count() as u32;
            if waited_for == 0 {
                break;
            }
            let Some(event) = self.bus.receive_ahead(until_ns, waited_for)? else {
                break;
            };
            self.hear(&event);
        }
        self.sent_request = !self.outbox.holds(&request);
        let mut missing = 0;
        for (index, counts) in self.counts.iter().enumerate() {
            if counts.is_none() {
                self.counters.replies_lost += 1;
                missing |= u8::from(self.sent_request) << index;
            }
        }
        Ok(missing)
    }

    fn report(&mut self, start_ns: u64) -> ArmReport<N> {
        let position_rad = self.ready.transmission.joint_rad(&self.counts);
        if position_rad.iter().all(Option::is_some) {
            self.pose = Vector::from(position_rad.map(Option::unwrap_or_default));
        }
        let now_ns = self.bus.now_ns();
        let base_from_tip = tip_pose(&self.arm, &self.pose).rotation;
        ArmReport {
            cycle: self.cycle,
            stamp_ns: self.bus.monotonic_ns(start_ns),
            position_rad,
            tip_force_n: self.readings.force_n(now_ns).map(|f| base_from_tip * f),
            drives: self.drives(),
            counters: self.counters,
        }
    }

    fn answer(&mut self, start_ns: u64, published_ns: u64) -> Result<Option<Command<N>>, CanError> {
        let until_ns = start_ns + self.rhythm.period_ns - self.time.torques_ns;
        let wait_ns = until_ns.saturating_sub(self.bus.now_ns());
        let answer = self.link.answer(self.cycle, wait_ns)?;
        self.cycle += 1;
        self.counters.late_answers += answer.late;
        // The last fallback acts instead of torques that are none.
        let command = answer.command.filter(Command::is_finite);
        self.counters.unusable += u64::from(answer.command.is_some() && command.is_none());
        match &command {
            Some(command) => {
                self.fallback_nm = command.fallback_torque_nm;
                self.counters.round_trip_ns = self.bus.now_ns().saturating_sub(published_ns);
            }
            None => {
                self.counters.missed += u64::from(self.drives() == Drives::Active);
                self.counters.round_trip_ns = 0;
            }
        }
        Ok(command)
    }

    /// Sends the torques, and lowers what is to be lowered.
    fn act(&mut self, action: &Action, command: Option<&Command<N>>) -> Result<(), CanError> {
        let (wanted_nm, stopping) = match (action.torque, command) {
            (Torque::Command, Some(command)) => (command.torque_nm, command.fault),
            (Torque::Fallback, _) => (self.fallback_nm, true),
            (Torque::Command | Torque::None, _) => (Vector::zeros(), true),
        };
        let torque_nm = if self.drives() == Drives::Active && action.torque != Torque::None {
            self.drives.limited_nm(&wanted_nm, stopping)
        } else {
            self.drives.rest(&wanted_nm);
            wanted_nm
        };
        // Finite joint torques may be too large for a puck's number: those are not sent.
        let torques = self.ready.transmission.puck_torques(&torque_nm);
        let torques = torques.unwrap_or([PuckTorque::ZERO; N]);
        for (motors, group) in torques
            .chunks(4)
            .zip([GroupId::LOWER_TORQUES, GroupId::UPPER_TORQUES])
        {
            let mut slots = [PuckTorque::ZERO; 4];
            slots[..motors.len()].copy_from_slice(motors);
            let packed = PackedTorques {
                property: self.ids.torque,
                slots,
            };
            self.send(&packed.emit(group))?;
        }
        if action.lower_module {
            let idle = Value::Wide(i32::from(SafetyMode::Idle.value()));
            self.send(&set(NodeId::SAFETY, self.ids.module_mode, idle))?;
        }
        if action.idle_motors {
            self.send(&set(GroupId::ARM, self.ids.motor_mode, Value::Wide(0)))?;
        }
        Ok(())
    }

    /// Asks for one thing more, by turns, if its replies fit before the next period. While the module is
    /// being lowered its mode is all that is asked for.
    fn poll_further(&mut self, action: &Action) -> Result<(), CanError> {
        let now_ns = self.bus.now_ns();
        let lowering = action.lower_module;
        let fits = now_ns + self.time.torques_ns + self.time.further_ns <= self.next_ns;
        // Replies that stay away leave no time in any cycle; then it comes all the same.
        let overdue = now_ns >= self.further_due_ns + FURTHER_NS;
        let due = fits && now_ns >= self.further_due_ns;
        if !due && !overdue && !lowering {
            return Ok(());
        }
        let further = if lowering {
            Further::Mode
        } else {
            self.further
        };
        let request = match further {
            Further::Mode => get(NodeId::SAFETY, self.ids.module_mode),
            Further::Pendant => get(NodeId::SAFETY, self.ids.pendant),
            Further::Sensor => force_torque::request(),
        };
        self.send(&request)?;
        if !lowering {
            self.further = match (self.further, self.ready.sensor) {
                (Further::Mode, true) => Further::Sensor,
                (Further::Mode, false) | (Further::Sensor, _) => Further::Pendant,
                (Further::Pendant, _) => Further::Mode,
            };
            let polls = if self.ready.sensor { 3 } else { 2 };
            self.further_due_ns = now_ns + FURTHER_NS / polls;
        }
        Ok(())
    }

    /// Hears what comes until the next period; what has not left by then is lost.
    fn drain(&mut self) -> Result<(), CanError> {
        self.listen()?;
        let lost = self.outbox.close();
        self.counters.tx_lost += lost;
        self.unsent = lost > 0;
        Ok(())
    }

    /// Hears what comes until the next period, and says nothing.
    fn listen(&mut self) -> Result<(), CanError> {
        while let Some(event) = self.bus.receive_ahead(self.next_ns, u32::MAX)? {
            self.hear(&event);
        }
        Ok(())
    }

    /// Hands a frame over. One that finds no room is lost, as one that does not leave.
    fn send(&mut self, frame: &CanFrame) -> Result<(), CanError> {
        self.outbox.put(frame);
        match self.bus.send(frame) {
            Ok(()) | Err(BusError::Full) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }

    fn hear(&mut self, event: &Event) {
        let now_ns = self.bus.now_ns();
        match event {
            Event::Sent(frame) => {
                self.outbox.confirm(frame);
                self.bits += u64::from(bits(frame));
            }
            Event::Fault(BusFault::BusOff) => self.bus_off = true,
            Event::Fault(BusFault::Restarted) => self.bus_off = false,
            Event::Fault(BusFault::Overrun) => self.counters.overruns += 1,
            Event::Fault(_) => {}
            Event::Frame(frame) => {
                self.bits += u64::from(bits(frame));
                // A frame that cannot be read is one that did not come.
                if let Ok((from, inbound)) = Inbound::parse(frame) {
                    self.take(from, &inbound, now_ns);
                }
            }
        }
    }

    fn take(&mut self, from: NodeId, inbound: &Inbound, now_ns: u64) {
        match inbound {
            Inbound::Position(reply) => {
                let index = usize::from(from.number()).wrapping_sub(1);
                if let Some(counts) = self.counts.get_mut(index) {
                    *counts = Some(reply.motor);
                }
            }
            Inbound::Reply(reply) if from == NodeId::SAFETY => {
                if reply.property == self.ids.module_mode
                    && let Ok(mode) = SafetyMode::from_value(reply.value.get())
                {
                    self.module = Some((mode, now_ns));
                } else if reply.property == self.ids.pendant {
                    let word = PenWord::from_value(reply.value.get());
                    self.pendant = Pendant::parse(word).ok();
                }
            }
            Inbound::Sensor(reading) if from == NodeId::FORCE_TORQUE => {
                self.readings.take(reading, now_ns);
            }
            // The module speaks to the motors: its mode is about to be other than it was.
            Inbound::Other if from == NodeId::SAFETY => {
                self.further = Further::Mode;
                self.further_due_ns = now_ns;
            }
            Inbound::Reply(_) | Inbound::Sensor(_) | Inbound::Other => {}
        }
    }
}
