//! Drives of Barrett's arms: one request reads the positions of all pucks, each torque frame carries up to four torques,
//! and the operator activates the motors on the pendant of the safety module.

use super::bus_time::BusTime;
use super::error::CanError;
use super::sensor::ForceReceiver;
use super::start_up::Ready;
use supple_bus::Bus;
use supple_can_frame::timing::FrameLayout;
use supple_can_frame::{BitRates, FrameFormat};
use supple_core::Vector;
use supple_drive::{
    Budget, BusPort, CycleConfig, Drive, DriveCounters, DriveState, Drives, LoopError, LossReason,
    LoweringMode, Reading, Received, ReservedTimes, TipForce, TorqueOffBehaviour,
};
use supple_puck::force_torque;
use supple_puck::property::{get, set};
use supple_puck::safety::{PenWord, Pendant, SafetyMode};
use supple_puck::{
    Counts, GroupId, Inbound, NodeId, PackedTorques, Property, PropertyId, PuckTorque, Value,
};

/// Period of each auxiliary poll, in bus time \[ns\].
const AUXILIARY_POLL_PERIOD_NS: u64 = 10_000_000;
/// Time without a reply of the safety module after which it counts as lost \[ns\].
const MODULE_SILENCE_NS: u64 = 100_000_000;

/// Property ids that the cycle uses.
#[derive(Clone, Copy, Debug)]
struct Ids {
    position: PropertyId,
    torque: PropertyId,
    motor_mode: PropertyId,
    module_mode: PropertyId,
    pendant: PropertyId,
}

/// Content of an auxiliary poll: the mode of the safety module, the state of the pendant, or the force/torque sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum AuxiliaryPoll {
    Mode,
    Pendant,
    Sensor,
}

/// The drives of a WAM, with their bus, after start-up.
pub struct Barrett<const N: usize, B> {
    port: BusPort<B>,
    ready: Ready<N>,
    ids: Ids,
    bus_time: BusTime,
    /// Position replies of this cycle.
    counts: [Option<Counts>; N],
    readings: ForceReceiver,
    /// Last known mode of the safety module, and when it was received \[ns\].
    module: Option<(SafetyMode, u64)>,
    pendant: Option<Pendant>,
    /// The next auxiliary poll, and the time from which it may be sent \[ns\].
    auxiliary_poll: AuxiliaryPoll,
    auxiliary_due_ns: u64,
}

impl<const N: usize, B: Bus> Barrett<N, B> {
    /// Creates the drives of an arm that has completed start-up.
    ///
    /// # Errors
    /// [`CanError::Overload`] if the period exceeds the bus bandwidth; an error if a puck's firmware lacks a property.
    pub fn new(
        bus: B,
        ready: Ready<N>,
        cycle_config: CycleConfig,
    ) -> Result<Barrett<N, B>, CanError> {
        let joint_encoders = ready.pucks.iter().filter(|p| p.joint_encoder).count();
        let bus_time = BusTime::new(N, joint_encoders, ready.sensor, cycle_config.answer_ns);
        bus_time.check(cycle_config.period_ns)?;
        let motor = ready.pucks[0];
        let property_id = |table: supple_puck::PropertyTable, node: NodeId, property: Property| {
            table.id(property).ok_or(CanError::UnsupportedProperty {
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
        Ok(Barrett {
            auxiliary_due_ns: bus.now_ns(),
            port: BusPort::new(bus, BitRates::CLASSIC_1M),
            ready,
            ids,
            bus_time,
            counts: [None; N],
            readings: ForceReceiver::default(),
            module: None,
            pendant: None,
            auxiliary_poll: AuxiliaryPoll::Mode,
        })
    }

    /// The bus.
    pub fn bus(&self) -> &B {
        self.port.bus()
    }

    /// The bus.
    pub fn bus_mut(&mut self) -> &mut B {
        self.port.bus_mut()
    }

    /// Returns the bus.
    pub fn into_bus(self) -> B {
        self.port.into_bus()
    }

    /// Last known state of the pendant.
    pub fn pendant(&self) -> Option<&Pendant> {
        self.pendant.as_ref()
    }

    fn receive_until(&mut self, until_ns: u64) -> Result<(), LoopError> {
        while self.receive(until_ns, u32::MAX)? {}
        Ok(())
    }

    /// Receives one event; returns `false` if none arrived until `until_ns`.
    fn receive(&mut self, until_ns: u64, frames: u32) -> Result<bool, LoopError> {
        match self.port.receive(until_ns, frames)? {
            Received::Nothing => return Ok(false),
            Received::Other => {}
            Received::Frame(frame) => {
                // A malformed reply counts as a missing reply.
                if let Ok((from, inbound)) = Inbound::parse(&frame) {
                    let now_ns = self.port.bus().now_ns();
                    self.handle_frame(from, &inbound, now_ns);
                }
            }
        }
        Ok(true)
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
            // The safety module sends a frame to the motors when it changes its mode: the next poll reads its mode.
            Inbound::Other if from == NodeId::SAFETY => {
                self.auxiliary_poll = AuxiliaryPoll::Mode;
                self.auxiliary_due_ns = now_ns;
            }
            Inbound::Reply(_) | Inbound::Sensor(_) | Inbound::Other => {}
        }
    }

    fn missing_replies(&self) -> u32 {
        self.counts.iter().filter(|counts| counts.is_none()).count() as u32
    }
}

impl<const N: usize, B: Bus> Drive<N> for Barrett<N, B> {
    fn now_ns(&self) -> u64 {
        self.port.bus().now_ns()
    }

    fn monotonic_ns(&self, time_ns: u64) -> u64 {
        self.port.bus().monotonic_ns(time_ns)
    }

    fn clock_stall_ns(&self) -> u64 {
        self.port.bus().clock_stall_ns()
    }

    fn torque_off_behaviour(&self) -> TorqueOffBehaviour {
        TorqueOffBehaviour::Brakes
    }

    fn reserved(&self) -> ReservedTimes {
        ReservedTimes {
            states_ns: self.bus_time.positions_ns,
            torques_ns: self.bus_time.torques_ns,
        }
    }

    fn budget(&self) -> Budget {
        budget(&self.bus_time)
    }

    fn request(&mut self) -> Result<(), LoopError> {
        self.counts = [None; N];
        self.port.send(&get(GroupId::ARM, self.ids.position))
    }

    fn collect(&mut self, until_ns: u64) -> Result<u8, LoopError> {
        loop {
            let missing_replies = self.missing_replies();
            if missing_replies == 0 || !self.receive(until_ns, missing_replies)? {
                break;
            }
        }
        let request = get(GroupId::ARM, self.ids.position);
        let confirmed = !self.port.is_unconfirmed(&request);
        let mut missing = 0;
        for (index, counts) in self.counts.iter().enumerate() {
            if counts.is_none() {
                self.port.count_lost_replies(1);
                missing |= u8::from(confirmed) << index;
            }
        }
        Ok(missing)
    }

    fn reading(&self) -> Reading<N> {
        let now_ns = self.port.bus().now_ns();
        Reading {
            position_rad: self.ready.transmission.joint_rad(&self.counts),
            tip_force: self.readings.force_n(now_ns).map(TipForce::Tip),
        }
    }

    fn state(&self) -> DriveState {
        let now_ns = self.port.bus().now_ns();
        let drives = match self.module {
            Some((SafetyMode::Active, _)) => Drives::Active,
            Some((SafetyMode::EStop, _)) => Drives::Off,
            Some((SafetyMode::Idle, _)) | None => Drives::Idle,
        };
        let loss = match self.module {
            Some((SafetyMode::Active, last_reply_ns))
                if now_ns > last_reply_ns + MODULE_SILENCE_NS =>
            {
                Some(LossReason::SafetyModuleSilent)
            }
            _ => None,
        };
        DriveState {
            drives,
            unsent: self.port.frames_lost(),
            bus_off: self.port.bus_off(),
            loss,
        }
    }

    /// Ignores the damping: pucks add none themselves.
    fn send_torques(&mut self, torque_nm: &Vector<N>, _: &Vector<N>) -> Result<(), LoopError> {
        let torques = self.ready.transmission.puck_torques(torque_nm);
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
            self.port.send(&packed.emit(group))?;
        }
        Ok(())
    }

    fn lower(&mut self, how: LoweringMode, _: LossReason) -> Result<(), LoopError> {
        let idle = Value::Wide(i32::from(SafetyMode::Idle.value()));
        self.port
            .send(&set(NodeId::SAFETY, self.ids.module_mode, idle))?;
        if how == LoweringMode::Forced {
            self.port
                .send(&set(GroupId::ARM, self.ids.motor_mode, Value::Wide(0)))?;
        }
        Ok(())
    }

    /// Sends one auxiliary poll in rotation, if its replies fit before the next period. While the safety module
    /// is being switched to idle, polls only its mode.
    fn poll(&mut self, next_period_ns: u64, lowering: bool) -> Result<(), LoopError> {
        let now_ns = self.port.bus().now_ns();
        let fits =
            now_ns + self.bus_time.torques_ns + self.bus_time.auxiliary_poll_ns <= next_period_ns;
        // While replies are missing, the time of the polls is spent waiting for them; a poll that is overdue is sent anyway.
        let overdue = now_ns >= self.auxiliary_due_ns + AUXILIARY_POLL_PERIOD_NS;
        let due = fits && now_ns >= self.auxiliary_due_ns;
        if !due && !overdue && !lowering {
            return Ok(());
        }
        let poll = if lowering {
            AuxiliaryPoll::Mode
        } else {
            self.auxiliary_poll
        };
        let request = match poll {
            AuxiliaryPoll::Mode => get(NodeId::SAFETY, self.ids.module_mode),
            AuxiliaryPoll::Pendant => get(NodeId::SAFETY, self.ids.pendant),
            AuxiliaryPoll::Sensor => force_torque::request(),
        };
        self.port.send(&request)?;
        if !lowering {
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

    fn drain(&mut self, next_period_ns: u64) -> Result<(), LoopError> {
        self.receive_until(next_period_ns)?;
        self.port.end_cycle();
        Ok(())
    }

    fn skip(&mut self, _: u64, next_period_ns: u64) -> Result<(), LoopError> {
        self.receive_until(next_period_ns)
    }

    fn motors_replied(&self) -> bool {
        self.counts.iter().any(Option::is_some)
    }

    fn counters(&self) -> DriveCounters {
        self.port.counters()
    }
}

/// Lists the frames of a period.
fn budget(time: &BusTime) -> Budget {
    let layout = |dlc| FrameLayout::standard(FrameFormat::Classic, dlc);
    let motor_only = time.joints - time.joint_encoders;
    let budget = Budget::new(BitRates::CLASSIC_1M, time.joints)
        .frames("request for the positions", 1, layout(1))
        .frames("replies", motor_only, layout(3))
        .frames(
            "replies with a joint encoder",
            time.joint_encoders,
            layout(6),
        )
        .frames("torques", time.joints.div_ceil(4), layout(8));
    budget.bus_busy_time("one auxiliary poll", time.auxiliary_poll_ns)
}
