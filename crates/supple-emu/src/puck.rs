//! Emulated motor puck: power states, properties and motor.
//!
//! ```text
//! no power -> monitor (STAT 0) -> waking -> ready (STAT 2), MODE idle <-> torque
//!        emergency stop: no power, counts lost
//! ```
//!
//! In the monitor, the puck answers only requests for the monitor's properties. Once ready, it uses the property ids of its
//! firmware. Properties that the emulation does not model, such as the gains of the puck's position loops, have no effect:
//! their values are stored and returned. Source: libbarrett, btclient, the user's manual.

use crate::config::PuckConfig;
use crate::store::{PropertyStore, property_of};
use supple_can_frame::CanFrame;
use supple_puck::status::{MotorMode, Role, Stat};
use supple_puck::{
    Counts, Destination, GroupId, MessageId, NodeId, PackedTorques, PositionReply, Property,
    PropertyId, PropertyMessage, PropertyTable, PuckKind, Value, Width,
};

/// Power state of a puck.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Power {
    /// No power: the puck is not on the bus.
    Off,
    /// The monitor runs.
    Monitor,
    /// The puck has been waking up since this time \[ns\]; it neither receives nor answers.
    Waking(u64),
    /// The firmware runs.
    Ready,
}

/// A motor puck.
#[derive(Clone, Debug)]
pub struct Puck {
    node: NodeId,
    config: PuckConfig,
    table: PropertyTable,
    power: Power,
    mode: MotorMode,
    /// Commanded torque \[puck units\], within the puck's limit.
    torque: i32,
    /// Offset from encoder counts to reported counts.
    offset: i64,
    /// Encoder counts relative to the initial motor angle.
    encoder: i64,
    store: PropertyStore,
}

impl Puck {
    /// Creates the puck of joint `number`, from 1, in its monitor; `None` if the property ids of its firmware are not known.
    pub fn new(number: usize, config: PuckConfig) -> Option<Puck> {
        let node = NodeId::new(number as u8).ok()?;
        let table = PropertyTable::of_firmware(PuckKind::Motor, config.version).ok()?;
        let mut store = PropertyStore::default();
        let [a, b, c] = config.groups.map(i32::from);
        for (property, value) in [
            (Property::VERS, config.version),
            (Property::ROLE, i32::from(config.role.0)),
            (Property::SN, 1000 + number as i32),
            (Property::ID, number as i32),
            (Property::GRPA, a),
            (Property::GRPB, b),
            (Property::GRPC, c),
            (Property::MT, config.max_torque),
            (Property::CTS, config.counts_per_revolution),
            (Property::PIDX, config.slot),
            (Property::JIDX, number as i32),
            (Property::IPNM, config.units_per_nm),
            (Property::POLES, config.poles),
            (Property::TEMP, config.temperature),
            (Property::PTEMP, config.temperature),
            (Property::THERM, config.temperature),
            (Property::OTEMP, 60),
            (Property::VBUS, 48),
            (Property::KP, 2000),
            (Property::KD, 8000),
            (Property::ACCEL, 100),
            (Property::MV, 100),
            (Property::DS, -256),
        ] {
            store.set(property, value);
        }
        Some(Puck {
            node,
            config,
            table,
            power: if config.present {
                Power::Monitor
            } else {
                Power::Off
            },
            mode: MotorMode::Idle,
            torque: 0,
            offset: 0,
            encoder: 0,
            store,
        })
    }

    /// Power state.
    pub fn power(&self) -> Power {
        self.power
    }

    /// Motor mode.
    pub fn mode(&self) -> MotorMode {
        self.mode
    }

    /// Motor torque without braking \[N m\]; zero unless the puck is in torque mode.
    pub fn torque_nm(&self) -> f64 {
        match (self.power, self.mode) {
            (Power::Ready, MotorMode::Torque) => {
                f64::from(self.torque) / f64::from(self.config.units_per_nm)
            }
            _ => 0.0,
        }
    }

    /// Whether the motor is shorted and brakes: always except in torque mode.
    pub fn brakes(&self) -> bool {
        (self.power, self.mode) != (Power::Ready, MotorMode::Torque)
    }

    /// Sets the motor angle relative to the initial one \[rad\].
    pub fn set_motor_angle(&mut self, angle_rad: f64) {
        let revolutions = angle_rad / core::f64::consts::TAU;
        self.encoder = (revolutions * f64::from(self.config.counts_per_revolution)).round() as i64;
    }

    /// Reported position, a counter of 22 bits.
    pub fn counts(&self) -> i32 {
        ((self.encoder + self.offset) as i32) << 10 >> 10
    }

    /// Sets the reported counts of the current motor angle.
    pub fn set_counts(&mut self, counts: i32) {
        self.offset = i64::from(counts) - self.encoder;
    }

    /// Switches the power on: the monitor runs, the counter starts at 0.
    pub fn power_up(&mut self) {
        if self.config.present && self.power == Power::Off {
            self.power = Power::Monitor;
            self.set_counts(0);
        }
    }

    /// Switches the power off.
    pub fn power_down(&mut self) {
        self.power = Power::Off;
        self.set_idle();
    }

    /// Makes the puck ready at once, without a wake-up.
    pub fn wake_at_once(&mut self) {
        if self.power != Power::Off {
            self.power = Power::Ready;
        }
    }

    /// Advances time.
    pub fn tick(&mut self, now_ns: u64, wake_ns: u64) {
        if let Power::Waking(since_ns) = self.power
            && now_ns >= since_ns + wake_ns
        {
            self.power = Power::Ready;
        }
    }

    fn set_idle(&mut self) {
        self.mode = MotorMode::Idle;
        self.torque = 0;
    }

    /// Handles a frame of another node; returns the reply, if any.
    pub fn handle_frame(&mut self, now_ns: u64, frame: &CanFrame) -> Option<CanFrame> {
        let to = MessageId::of(frame)?.to();
        let addressed = match to {
            Destination::Node(node) => node == self.node,
            Destination::Group(group) => self.belongs_to(group),
        };
        if !addressed {
            return None;
        }
        match (self.power, to) {
            (Power::Off | Power::Waking(_), _) => None,
            (_, Destination::Group(GroupId::LOWER_TORQUES | GroupId::UPPER_TORQUES))
                if frame.dlc() == 8 =>
            {
                self.apply_torque_frame(frame);
                None
            }
            _ => match PropertyMessage::parse(frame).ok()? {
                PropertyMessage::Get(id) => self.answer(id),
                PropertyMessage::Set(id, value) => {
                    self.assign(now_ns, id, value.get());
                    None
                }
            },
        }
    }

    fn belongs_to(&self, group: GroupId) -> bool {
        let groups = [Property::GRPA, Property::GRPB, Property::GRPC];
        let mut groups = groups.into_iter().map(|p| self.store.get(p));
        self.power == Power::Ready && groups.any(|g| g == Some(i32::from(group.number())))
    }

    fn table(&self) -> PropertyTable {
        if self.power == Power::Ready {
            self.table
        } else {
            PropertyTable::MONITOR
        }
    }

    fn apply_torque_frame(&mut self, frame: &CanFrame) {
        let Ok(torques) = PackedTorques::parse(frame) else {
            return;
        };
        let slot = self.store.get(Property::PIDX).unwrap_or(0);
        let command = u8::try_from(slot).ok().and_then(|slot| torques.slot(slot));
        if let (Some(command), true) = (
            command,
            self.table.id(Property::T) == Some(torques.property),
        ) {
            let limit = self.store.get(Property::MT).unwrap_or(0).max(0);
            self.torque = i32::from(command.units()).clamp(-limit, limit);
        }
    }

    fn answer(&self, id: PropertyId) -> Option<CanFrame> {
        let table = self.table();
        let property = property_of(&table, id)?;
        let value = match property {
            Property::P => {
                let reply = PositionReply {
                    motor: Counts::new(self.counts()).ok()?,
                    joint: None,
                };
                return Some(reply.emit(self.node));
            }
            Property::STAT => i32::from(match self.power {
                Power::Ready => Stat::Ready.value(),
                _ => Stat::Reset.value(),
            }),
            Property::MODE => i32::from(self.mode.value()),
            Property::T => self.torque,
            Property::MECH => {
                let counts = i64::from(self.config.counts_per_revolution);
                self.encoder.rem_euclid(counts) as i32
            }
            other => self.store.get(other).unwrap_or(0),
        };
        let width = table.width(property).unwrap_or(Width::Narrow);
        let value = Value::of_width(value, width).unwrap_or(Value::Wide(value));
        let reply = PropertyMessage::Set(id, value);
        Some(reply.emit(self.node, Destination::Group(GroupId::REPLY)))
    }

    fn assign(&mut self, now_ns: u64, id: PropertyId, value: i32) {
        match property_of(&self.table(), id) {
            Some(Property::STAT) => match (Stat::from_value(value), self.power) {
                (Ok(Stat::Ready), Power::Monitor) => self.power = Power::Waking(now_ns),
                (Ok(Stat::Reset), _) => {
                    self.power = Power::Monitor;
                    self.set_idle();
                    self.set_counts(0);
                }
                _ => {}
            },
            Some(Property::MODE) => {
                if let Ok(mode) = MotorMode::from_value(value) {
                    self.mode = mode;
                    if mode == MotorMode::Idle {
                        self.torque = 0;
                    }
                }
            }
            Some(Property::P) => self.set_counts(value),
            Some(Property::T) => {
                let limit = self.store.get(Property::MT).unwrap_or(0).max(0);
                self.torque = value.clamp(-limit, limit);
            }
            // Factory settings have no effect: a maintenance tool must unlock them first.
            Some(Property::VERS | Property::ROLE | Property::SN | Property::ID) | None => {}
            Some(property) => self.store.set(property, value),
        }
    }

    /// Role of the puck.
    pub fn role(&self) -> Role {
        self.config.role
    }
}
