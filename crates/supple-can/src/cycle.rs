//! The polling cycle: positions in, torques out, once per period.
//!
//! ```text
//! 0  request positions -> collect replies -> motors to joints -> publish -> wait for the answer
//!    -> safe action -> joints to motors -> torque frames -> an auxiliary poll, if it fits -> drain until the
//!    next period: every frame of the cycle must be sent by then
//! ```
//!
//! `supple-can` computes no torques. A cycle allocates no memory, takes no lock and writes no log.

use crate::bus_time::BusTime;
use crate::error::CanError;
use crate::guard::{Action, GuardInput, LossReason, SafeActionMachine, Stage, Torque};
use crate::link::{ArmReport, Command, Counters, Drives, Link};
use crate::sensor::Readings;
use crate::start_up::Ready;
use crate::unconfirmed::UnconfirmedFrames;
use supple_bus::{Bus, BusError, BusFault, Event};
use supple_can_frame::CanFrame;
use supple_can_frame::timing::bits;
use supple_core::controller::Mode;
use supple_core::drive_guard::DriveGuard;
use supple_core::dynamics::tip_pose;
use supple_core::{Arm, Config, Vector};
use supple_puck::force_torque;
use supple_puck::property::{get, set};
use supple_puck::safety::{PenWord, Pendant, SafetyMode};
use supple_puck::{
    Counts, GroupId, Inbound, NodeId, PackedTorques, Property, PropertyId, PuckTorque, Value,
};

/// Period of each auxiliary poll, in bus time \[ns\].
const AUXILIARY_POLL_PERIOD_NS: u64 = 10_000_000;

/// Configuration of the cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CycleConfig {
    /// Period \[ns\].
    pub period_ns: u64,
    /// Time reserved for the controller's answer \[ns\].
    pub answer_ns: u64,
}

/// Property ids that the cycle uses.
#[derive(Clone, Copy, Debug)]
struct Ids {
    position: PropertyId,
    torque: PropertyId,
    motor_mode: PropertyId,
    module_mode: PropertyId,
    pendant: PropertyId,
}

/// What an auxiliary poll requests: the mode of the safety module, the pendant or the force/torque sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum AuxiliaryPoll {
    Mode,
    Pendant,
    Sensor,
}

/// The polling cycle of a running arm.
pub struct Cycle<const N: usize, B, L> {
    bus: B,
    link: L,
    ready: Ready<N>,
    arm: Arm<N>,
    ids: Ids,
    cycle_config: CycleConfig,
    bus_time: BusTime,
    guard: SafeActionMachine,
    drive_guard: DriveGuard<N>,
    cycle: u64,
    /// Cycle of the last angles that the drive guard observed.
    observed_cycle: Option<u64>,
    next_period_ns: u64,
    /// Position replies of this cycle.
    counts: [Option<Counts>; N],
    /// Last joint angles for which all encoders replied \[rad\].
    last_pose_rad: Vector<N>,
    readings: Readings,
    /// Last known mode of the safety module, and when it was received \[ns\].
    module: Option<(SafetyMode, u64)>,
    pendant: Option<Pendant>,
    unconfirmed: UnconfirmedFrames,
    /// The next auxiliary poll, and the time from which it may be sent \[ns\].
    auxiliary_poll: AuxiliaryPoll,
    auxiliary_due_ns: u64,
    /// The interface has confirmed that this cycle's position request was sent.
    request_confirmed: bool,
    /// Some frames of the previous cycle were not sent.
    frames_lost: bool,
    bus_off: bool,
    /// Bits on the bus in this period.
    bus_bits: u64,
    fallback_nm: Vector<N>,
    counters: Counters,
    shutting_down: bool,
}

impl<const N: usize, B: Bus, L: Link<N>> Cycle<N, B, L> {
    /// Starts the cycle of an arm that has completed start-up.
    ///
    /// # Errors
    /// [`CanError::Overload`] if the period exceeds the bus bandwidth; an error if a puck's firmware lacks a property.
    pub fn new(
        bus: B,
        link: L,
        ready: Ready<N>,
        config: &Config<N>,
        cycle_config: CycleConfig,
    ) -> Result<Cycle<N, B, L>, CanError> {
        let joint_encoders = ready.pucks.iter().filter(|p| p.joint_encoder).count();
        let bus_time = BusTime::new(N, joint_encoders, ready.sensor, cycle_config.answer_ns);
        bus_time.check(cycle_config.period_ns)?;
        let motor = ready.pucks[0];
        let property_id = |table: supple_puck::PropertyTable, node: NodeId, property: Property| {
            table.id(property).ok_or(CanError::Property {
                node: node.number(),
                version: motor.version,
                property,
            })
        };
        let ids = Ids {
            position: motor.position,
            torque: motor.torque,
            motor_mode: property_id(motor.table, motor.node, Property::MODE)?,
            module_mode: property_id(ready.module, NodeId::SAFETY, Property::MODE)?,
            pendant: property_id(ready.module, NodeId::SAFETY, Property::PEN)?,
        };
        let next_period_ns = bus.now_ns();
        Ok(Cycle {
            bus,
            link,
            ready,
            arm: config.arm,
            drive_guard: DriveGuard::new(config),
            ids,
            cycle_config,
            bus_time,
            guard: SafeActionMachine::new(),
            cycle: 0,
            observed_cycle: None,
            next_period_ns,
            counts: [None; N],
            last_pose_rad: Vector::zeros(),
            readings: Readings::default(),
            module: None,
            pendant: None,
            unconfirmed: UnconfirmedFrames::default(),
            auxiliary_poll: AuxiliaryPoll::Mode,
            auxiliary_due_ns: next_period_ns,
            request_confirmed: false,
            frames_lost: false,
            bus_off: false,
            bus_bits: 0,
            fallback_nm: Vector::zeros(),
            counters: Counters::default(),
            shutting_down: false,
        })
    }

    /// Sets the motors to idle from the next cycle on, because the program is about to end.
    pub fn begin_shutdown(&mut self) {
        self.shutting_down = true;
    }

    /// Counters of the cycle.
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// State machine of the safe action.
    pub fn guard(&self) -> &SafeActionMachine {
        &self.guard
    }

    /// State of the drives, from the last known mode of the safety module.
    pub fn drives(&self) -> Drives {
        match self.module {
            Some((SafetyMode::Active, _)) => Drives::Active,
            Some((SafetyMode::EStop, _)) => Drives::Off,
            Some((SafetyMode::Idle, _)) | None => Drives::Idle,
        }
    }

    /// Whether any motor puck replied in the last cycle.
    pub fn motors_replied(&self) -> bool {
        self.counts.iter().any(Option::is_some)
    }

    /// Last known state of the pendant.
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

    /// Link to the controller.
    pub fn link_mut(&mut self) -> &mut L {
        &mut self.link
    }

    /// Returns the bus, the link to the controller and the start-up results after the last cycle.
    pub fn into_parts(self) -> (B, L, Ready<N>) {
        (self.bus, self.link, self.ready)
    }

    /// Runs one cycle, up to the start of the next period.
    ///
    /// # Errors
    /// If the bus or the link to the controller fails. Faults on the bus are handled.
    pub fn run(&mut self) -> Result<Action, CanError> {
        let start_ns = self.start_period()?;
        let missing_motors = self.collect_positions(start_ns)?;
        let report = self.arm_report(start_ns);
        let published_ns = self.bus.now_ns();
        self.link.publish(&report)?;
        let command = self.wait_for_answer(start_ns, published_ns)?;
        let periods = report.cycle - self.observed_cycle.unwrap_or(report.cycle);
        self.observed_cycle = Some(report.cycle);
        self.drive_guard.observe(&report.position_rad, periods);
        let active = self.drives() == Drives::Active;
        let drive_guard_check = self
            .drive_guard
            .check_command(command.as_ref().map(Command::drive).as_ref(), active);
        let input = GuardInput {
            now_ns: self.bus.now_ns(),
            answer: command.map(|command| command.wants_torque),
            drive_guard_loss: drive_guard_check.err().map(LossReason::from),
            missing: missing_motors,
            unsent: self.frames_lost,
            bus_off: self.bus_off,
            module: self.module,
            leaving: self.shutting_down,
        };
        let action = self.guard.cycle(&input);
        self.send_torques(&action, command.as_ref())?;
        self.poll_auxiliary(&action)?;
        self.drain()?;
        Ok(action)
    }

    /// Starts the next period; returns its start \[ns\]. Skips periods that are over, and one whose remaining time is
    /// too short for replies, answer and torques; the replies of a skipped period do not count as missing.
    fn start_period(&mut self) -> Result<u64, CanError> {
        let now_ns = self.bus.now_ns();
        let period_ns = self.cycle_config.period_ns;
        let late_ns = now_ns.saturating_sub(self.next_period_ns);
        self.skip_periods(late_ns / period_ns);
        if late_ns % period_ns > self.bus_time.slack_ns(period_ns) {
            self.skip_periods(1);
            self.receive_until_next_period()?;
        }
        self.counters.wake_ns = late_ns;
        self.counters.cycles += 1;
        self.counters.bus_load = self.bus_bits as f64 * 1e3 / period_ns as f64;
        self.bus_bits = 0;
        self.counters.clock_stall_ns = self.bus.clock_stall_ns();
        let start_ns = self.next_period_ns;
        self.next_period_ns += period_ns;
        Ok(start_ns)
    }

    fn skip_periods(&mut self, periods: u64) {
        self.cycle += periods;
        self.next_period_ns += periods * self.cycle_config.period_ns;
        self.counters.skipped += periods;
    }

    /// Requests the positions and collects the replies. Returns a bit mask of the motors that did not reply; zero if
    /// the request itself was not sent.
    fn collect_positions(&mut self, start_ns: u64) -> Result<u8, CanError> {
        self.counts = [None; N];
        let request = get(GroupId::ARM, self.ids.position);
        self.send(&request)?;
        self.link.announce()?;
        // Replies after this time would leave too little of the period for the answer and the torques.
        let reserved_ns = self.bus_time.torques_ns + self.cycle_config.answer_ns;
        let until_ns = start_ns + self.cycle_config.period_ns - reserved_ns;
        loop {
            let missing_replies =
                self.counts.iter().filter(|counts| counts.is_none()).count() as u32;
            if missing_replies == 0 {
                break;
            }
            let Some(event) = self.bus.receive_with_lookahead(until_ns, missing_replies)? else {
                break;
            };
            self.handle_event(&event);
        }
        self.request_confirmed = !self.unconfirmed.contains(&request);
        let mut missing = 0;
        for (index, counts) in self.counts.iter().enumerate() {
            if counts.is_none() {
                self.counters.replies_lost += 1;
                missing |= u8::from(self.request_confirmed) << index;
            }
        }
        Ok(missing)
    }

    fn arm_report(&mut self, start_ns: u64) -> ArmReport<N> {
        let position_rad = self.ready.transmission.joint_rad(&self.counts);
        if position_rad.iter().all(Option::is_some) {
            self.last_pose_rad = Vector::from(position_rad.map(Option::unwrap_or_default));
        }
        let now_ns = self.bus.now_ns();
        let base_from_tip = tip_pose(&self.arm, &self.last_pose_rad).rotation;
        ArmReport {
            cycle: self.cycle,
            stamp_ns: self.bus.monotonic_ns(start_ns),
            position_rad,
            tip_force_n: self.readings.force_n(now_ns).map(|f| base_from_tip * f),
            drives: self.drives(),
            counters: self.counters,
        }
    }

    fn wait_for_answer(
        &mut self,
        start_ns: u64,
        published_ns: u64,
    ) -> Result<Option<Command<N>>, CanError> {
        let until_ns = start_ns + self.cycle_config.period_ns - self.bus_time.torques_ns;
        let wait_ns = until_ns.saturating_sub(self.bus.now_ns());
        let answer = self.link.answer(self.cycle, wait_ns)?;
        self.cycle += 1;
        self.counters.late_answers += answer.late;
        // A command that is not finite counts as missing: the last fallback torque is applied.
        let command = answer.command.filter(Command::is_finite);
        self.counters.unusable += u64::from(answer.command.is_some() && command.is_none());
        match &command {
            Some(command) => {
                self.fallback_nm = command.fallback_torque_nm;
                self.counters.round_trip_ns = self.bus.now_ns().saturating_sub(published_ns);
            }
            None => {
                self.counters.missed += u64::from(self.drives() == Drives::Active);
                if self.guard.stage() == Stage::Resting {
                    // The arm may move before the motors are activated, so the old fallback torque is not valid.
                    self.fallback_nm = Vector::zeros();
                }
                self.counters.round_trip_ns = 0;
            }
        }
        Ok(command)
    }

    /// Sends the torques, and sets the safety module or the motors to idle if the action requires it.
    fn send_torques(
        &mut self,
        action: &Action,
        command: Option<&Command<N>>,
    ) -> Result<(), CanError> {
        let (wanted_nm, stopping) = match (action.torque, command) {
            (Torque::Command, Some(command)) => (command.torque_nm, command.fault),
            (Torque::Fallback, _) => (self.fallback_nm, true),
            (Torque::Command | Torque::None, _) => (Vector::zeros(), true),
        };
        let torque_nm = if self.drives() == Drives::Active && action.torque != Torque::None {
            self.drive_guard.limited_nm(&wanted_nm, stopping)
        } else {
            // The motors become active some cycles before this program learns of it. Until then it sends gravity
            // compensation only, within the limits, and zero in all other modes.
            let in_gravity_hold =
                command.is_some_and(|command| command.mode == Some(Mode::GravityHold));
            let activation_nm = if in_gravity_hold {
                wanted_nm
            } else {
                Vector::zeros()
            };
            self.drive_guard.reset_rate_limit(&activation_nm)
        };
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

    /// Sends one auxiliary poll in rotation, if its replies fit before the next period. While the safety module
    /// is being switched to idle, polls only its mode.
    fn poll_auxiliary(&mut self, action: &Action) -> Result<(), CanError> {
        let now_ns = self.bus.now_ns();
        let setting_idle = action.lower_module;
        let fits = now_ns + self.bus_time.torques_ns + self.bus_time.auxiliary_poll_ns
            <= self.next_period_ns;
        // While replies are missing, waiting for them takes the time of the polls; an overdue poll is sent anyway.
        let overdue = now_ns >= self.auxiliary_due_ns + AUXILIARY_POLL_PERIOD_NS;
        let due = fits && now_ns >= self.auxiliary_due_ns;
        if !due && !overdue && !setting_idle {
            return Ok(());
        }
        let poll = if setting_idle {
            AuxiliaryPoll::Mode
        } else {
            self.auxiliary_poll
        };
        let request = match poll {
            AuxiliaryPoll::Mode => get(NodeId::SAFETY, self.ids.module_mode),
            AuxiliaryPoll::Pendant => get(NodeId::SAFETY, self.ids.pendant),
            AuxiliaryPoll::Sensor => force_torque::request(),
        };
        self.send(&request)?;
        if !setting_idle {
            self.auxiliary_poll = match (self.auxiliary_poll, self.ready.sensor) {
                (AuxiliaryPoll::Mode, true) => AuxiliaryPoll::Sensor,
                (AuxiliaryPoll::Mode, false) | (AuxiliaryPoll::Sensor, _) => AuxiliaryPoll::Pendant,
                (AuxiliaryPoll::Pendant, _) => AuxiliaryPoll::Mode,
            };
            let polls = if self.ready.sensor { 3 } else { 2 };
            self.auxiliary_due_ns = now_ns + AUXILIARY_POLL_PERIOD_NS / polls;
        }
        Ok(())
    }

    /// Receives events until the next period; frames that are not confirmed as sent by then count as lost.
    fn drain(&mut self) -> Result<(), CanError> {
        self.receive_until_next_period()?;
        let lost = self.unconfirmed.take_count();
        self.counters.tx_lost += lost;
        self.frames_lost = lost > 0;
        Ok(())
    }

    /// Receives events until the next period without sending.
    fn receive_until_next_period(&mut self) -> Result<(), CanError> {
        while let Some(event) = self
            .bus
            .receive_with_lookahead(self.next_period_ns, u32::MAX)?
        {
            self.handle_event(&event);
        }
        Ok(())
    }

    /// Queues a frame for sending. If the transmit queue is full, the frame counts as lost.
    fn send(&mut self, frame: &CanFrame) -> Result<(), CanError> {
        self.unconfirmed.add(frame);
        match self.bus.send(frame) {
            Ok(()) | Err(BusError::Full) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }

    fn handle_event(&mut self, event: &Event) {
        let now_ns = self.bus.now_ns();
        match event {
            Event::Sent(frame) => {
                self.unconfirmed.confirm(frame);
                self.bus_bits += u64::from(bits(frame));
            }
            Event::Fault(BusFault::BusOff) => self.bus_off = true,
            Event::Fault(BusFault::Restarted) => self.bus_off = false,
            Event::Fault(BusFault::Overrun) => self.counters.overruns += 1,
            Event::Fault(_) => {}
            Event::Frame(frame) => {
                self.bus_bits += u64::from(bits(frame));
                // A malformed frame counts as missing.
                if let Ok((from, inbound)) = Inbound::parse(frame) {
                    self.handle_frame(from, &inbound, now_ns);
                }
            }
        }
    }

    fn handle_frame(&mut self, from: NodeId, inbound: &Inbound, now_ns: u64) {
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
                self.readings.update(reading, now_ns);
            }
            // A frame of the safety module to the motors announces a change of mode: its mode is polled next.
            Inbound::Other if from == NodeId::SAFETY => {
                self.auxiliary_poll = AuxiliaryPoll::Mode;
                self.auxiliary_due_ns = now_ns;
            }
            Inbound::Reply(_) | Inbound::Sensor(_) | Inbound::Other => {}
        }
    }
}
