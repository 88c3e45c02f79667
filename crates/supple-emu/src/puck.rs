//! One motor puck: its states, its properties, its motor.
//!
//! ```text
//! no power -> monitor (STAT 0) -> waking -> ready (STAT 2), MODE idle <-> torque
//!        emergency stop: no power, counts forgotten
//! ```
//!
//! In the monitor only the properties of its list are answered. Once ready, ids are those of the puck's
//! firmware. What a property means beyond these, such as the puck's own position loops, is left out: the
//! value is kept and given back. Source: libbarrett, btclient, the user's manual.

use crate::config::PuckConfig;
use crate::store::{PropertyStore, property_of};
use supple_puck::status::{MotorMode, Role, Stat};
use supple_puck::{
    CanFrame, Counts, Destination, GroupId, NodeId, PackedTorques, PositionReply, Property,
    PropertyId, PropertyMessage, PropertyTable, PuckKind, Value, Width,
};

/// How far a puck has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Power {
    /// No power: it is not on the bus.
    Off,
    /// The monitor runs.
    Monitor,
    /// Woken at this time \[ns\]; neither hears nor answers.
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
    /// Reported counts less the encoder's own.
    offset: i64,
    /// The encoder's own counts, from where the motor stood at the beginning.
    encoder: i64,
    store: PropertyStore,
}

impl Puck {
    /// Puck of joint `number`, from 1, in its monitor. `None` where its firmware has no list of ids.
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

    /// How far it has come.
    pub fn power(&self) -> Power {
        self.power
    }

    /// Its mode.
    pub fn mode(&self) -> MotorMode {
        self.mode
    }

    /// Torque that its motor gives \[N m\], braking apart; zero unless it is in torque mode.
    pub fn torque_nm(&self) -> f64 {
        match (self.power, self.mode) {
            (Power::Ready, MotorMode::Torque) => {
                f64::from(self.torque) / f64::from(self.config.units_per_nm)
            }
            _ => 0.0,
        }
    }

    /// Its motor is shorted and brakes: always but in torque mode.
    pub fn brakes(&self) -> bool {
        (self.power, self.mode) != (Power::Ready, MotorMode::Torque)
    }

    /// Turns the motor to an angle \[rad\], from where it stood at the beginning.
    pub fn turn(&mut self, angle_rad: f64) {
        let turns = angle_rad / core::f64::consts::TAU;
        self.encoder = (turns * f64::from(self.config.counts_per_revolution)).round() as i64;
    }

    /// Position as it is reported: the counter has 22 bits.
    pub fn counts(&self) -> i32 {
        ((self.encoder + self.offset) as i32) << 10 >> 10
    }

    /// The counter says `counts` where the motor stands now.
    pub fn define(&mut self, counts: i32) {
        self.offset = i64::from(counts) - self.encoder;
    }

    /// Power comes: the monitor runs, the counter begins at 0.
    pub fn power_up(&mut self) {
        if self.config.present && self.power == Power::Off {
            self.power = Power::Monitor;
            self.define(0);
        }
    }

    /// Power goes.
    pub fn power_down(&mut self) {
        self.power = Power::Off;
        self.rest();
    }

    /// Ready at once, without a wake-up.
    pub fn wake_at_once(&mut self) {
        if self.power != Power::Off {
            self.power = Power::Ready;
        }
    }

    /// Time passes.
    pub fn tick(&mut self, now_ns: u64, wake_ns: u64) {
        if let Power::Waking(since_ns) = self.power
            && now_ns >= since_ns + wake_ns
        {
            self.power = Power::Ready;
        }
    }

    fn rest(&mut self) {
        self.mode = MotorMode::Idle;
        self.torque = 0;
    }

    /// Takes a frame of another node; what it answers, if anything.
    pub fn hear(&mut self, now_ns: u64, frame: &CanFrame) -> Option<CanFrame> {
        let for_it = match frame.id().to() {
            Destination::Node(node) => node == self.node,
            Destination::Group(group) => self.listens_to(group),
        };
        if !for_it {
            return None;
        }
        match (self.power, frame.id().to()) {
            (Power::Off | Power::Waking(_), _) => None,
            (_, Destination::Group(GroupId::LOWER_TORQUES | GroupId::UPPER_TORQUES))
                if frame.dlc() == 8 =>
            {
                self.take_torque(frame);
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

    fn listens_to(&self, group: GroupId) -> bool {
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

    fn take_torque(&mut self, frame: &CanFrame) {
        let Ok(torques) = PackedTorques::parse(frame) else {
            return;
        };
        let slot = self.store.get(Property::PIDX).unwrap_or(0);
        let command = u8::try_from(slot).ok().and_then(|slot| torques.slot(slot));
        if let (Some(command), true) = (
            command,
            self.table.id(Property::T) == Some(torques.property),
        ) {
            let most = self.store.get(Property::MT).unwrap_or(0).max(0);
            self.torque = i32::from(command.units()).clamp(-most, most);
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
                    self.rest();
                    self.define(0);
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
            Some(Property::P) => self.define(value),
            Some(Property::T) => {
                let most = self.store.get(Property::MT).unwrap_or(0).max(0);
                self.torque = value.clamp(-most, most);
            }
            // Of the factory: a maintenance tool unlocks them first.
            Some(Property::VERS | Property::ROLE | Property::SN | Property::ID) | None => {}
            Some(property) => self.store.set(property, value),
        }
    }

    /// What the puck is for.
    pub fn role(&self) -> Role {
        self.config.role
    }
}
