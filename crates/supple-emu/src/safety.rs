//! Emulated safety module with its pendant.
//!
//! ```text
//! e-stop --Shift-Idle--> idle --Shift-Activate--> active
//!        <-- button -----      <-- fault, host --
//! ```
//!
//! The module receives torque commands and position replies. In active mode, it switches to idle if a torque or a speed is
//! above its fault limit, the bus voltage is outside its limits, or positions are missing. It switches to the emergency stop
//! if the arm has not slowed down half a second after a velocity fault. The pendant shows a fault until Shift-Idle. The
//! module sends the motors their mode in a frame to all actuators (0x540), whose payload is not published; the emulated
//! frame sets MODE. Source: libbarrett, btclient, OWD.

use crate::config::SafetyConfig;
use crate::elbow::monitored_points_m;
use crate::store::{PropertyStore, property_of};
use supple_can_frame::CanFrame;
use supple_core::nalgebra::{Matrix4, Vector3, Vector4};
use supple_puck::safety::{Button, Level, Pendant, SafetyLimits, SafetyMode, SevenSegment};
use supple_puck::status::{MotorMode, Role, Stat};
use supple_puck::{
    Destination, GroupId, MessageId, NodeId, PackedTorques, PositionReply, Property,
    PropertyMessage, PropertyTable, PuckKind, Value, Width,
};

/// Time for which the pendant word shows a pressed button \[ns\].
const PRESS_NS: u64 = 200_000_000;
/// Number of position sets (one reply of each of motors 1 to 4) from which the speed is computed.
const HISTORY: usize = 5;
/// Limits of the bus voltage \[V\]: VOLTL1, VOLTL2, VOLTH1, VOLTH2.
const VOLTAGE_V: [i32; 4] = [36, 30, 54, 57];

/// Action of an operator on the pendant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ButtonPress {
    /// Shift-Idle: clears the faults; the motors have power and brake.
    Idle,
    /// Shift-Activate: the motors apply torques, unless a fault is shown.
    Activate,
    /// The emergency stop is pressed and latches.
    EStop,
    /// The emergency stop is released; the power stays off until Shift-Idle.
    Release,
}

/// Cause of the module's last change of mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// The operator, on the pendant.
    Operator,
    /// A request of the host.
    Host,
    /// The arm was too fast.
    Velocity,
    /// A commanded torque was too large.
    Torque,
    /// The bus voltage was outside its limits.
    Voltage,
    /// Positions were missing.
    Heartbeat,
}

/// The safety module.
#[derive(Clone, Debug)]
pub struct SafetyModule {
    config: SafetyConfig,
    table: PropertyTable,
    store: PropertyStore,
    mode: SafetyMode,
    cause: Cause,
    latched: bool,
    button: Button,
    pressed_ns: u64,
    velocity: Level,
    torque: Level,
    voltage: Level,
    heartbeat: Level,
    joint_from_motor: Matrix4<f64>,
    rad_per_count: [f64; 4],
    last_seen_ns: Vec<u64>,
    /// Positions of the current set that have arrived.
    counts: [Option<i32>; 4],
    history: Vec<(u64, [Vector3<f64>; 2])>,
    velocity_fault_ns: Option<u64>,
    too_fast: bool,
}

impl SafetyModule {
    /// Creates a module in emergency stop for an arm with `joints` pucks and the transmission of joints 1 to 4; `None` if the
    /// property ids of its firmware are not known.
    pub fn new(
        config: SafetyConfig,
        joints: usize,
        joint_from_motor: Matrix4<f64>,
        rad_per_count: [f64; 4],
    ) -> Option<SafetyModule> {
        let table = PropertyTable::of_firmware(PuckKind::Safety, config.version).ok()?;
        let mut store = PropertyStore::default();
        for (property, value) in [
            (Property::VERS, config.version),
            (Property::ROLE, i32::from(Role::SAFETY.0)),
            (Property::SN, 1010),
            (Property::ID, i32::from(NodeId::SAFETY.number())),
            (Property::GRPA, 1),
            (Property::GRPB, 2),
            (Property::GRPC, 3),
            (Property::VOLTL1, VOLTAGE_V[0]),
            (Property::VOLTL2, VOLTAGE_V[1]),
            (Property::VOLTH1, VOLTAGE_V[2]),
            (Property::VOLTH2, VOLTAGE_V[3]),
            (Property::VNOM, 48),
        ] {
            store.set(property, value);
        }
        for (property, value) in SafetyLimits::default().settings() {
            store.set(property, value.get());
        }
        Some(SafetyModule {
            config,
            table,
            store,
            mode: SafetyMode::EStop,
            cause: Cause::Operator,
            latched: false,
            button: Button::None,
            pressed_ns: 0,
            velocity: Level::Safe,
            torque: Level::Safe,
            voltage: Level::Safe,
            heartbeat: Level::Safe,
            joint_from_motor,
            rad_per_count,
            last_seen_ns: vec![0; joints],
            counts: [None; 4],
            history: Vec::with_capacity(HISTORY + 1),
            velocity_fault_ns: None,
            too_fast: false,
        })
    }

    /// Current mode.
    pub fn mode(&self) -> SafetyMode {
        self.mode
    }

    /// Cause of the current mode.
    pub fn cause(&self) -> Cause {
        self.cause
    }

    /// Sets the bus voltage \[V\].
    pub fn set_voltage(&mut self, voltage: i32) {
        self.config.voltage = voltage;
    }

    /// Sets whether the arm's positions are known.
    pub fn set_zeroed(&mut self, zeroed: bool) {
        self.store.set(Property::ZERO, i32::from(zeroed));
        self.history.clear();
    }

    /// State of the pendant.
    pub fn pendant(&self) -> Pendant {
        let digit = match self.mode {
            SafetyMode::EStop => 'E',
            SafetyMode::Idle => '0',
            SafetyMode::Active => 'A',
        };
        Pendant {
            button: self.button,
            activate_light: self.mode == SafetyMode::Active,
            idle_light: self.mode == SafetyMode::Idle,
            segments: SevenSegment::of(digit).unwrap_or(SevenSegment(0)),
            velocity: self.velocity,
            torque: self.torque,
            voltage: self.voltage,
            heartbeat: self.heartbeat,
            other: if self.mode == SafetyMode::EStop {
                Level::Fault
            } else {
                Level::Safe
            },
        }
    }

    /// Handles a button press; returns the mode frame to the motors, if the mode changes.
    pub fn press(&mut self, now_ns: u64, press: ButtonPress) -> Option<CanFrame> {
        self.pressed_ns = now_ns;
        match press {
            ButtonPress::Idle if !self.latched => {
                self.button = Button::Idle;
                for level in [
                    &mut self.velocity,
                    &mut self.torque,
                    &mut self.voltage,
                    &mut self.heartbeat,
                ] {
                    *level = Level::Safe;
                }
                self.velocity_fault_ns = None;
                self.enter(SafetyMode::Idle, Cause::Operator)
            }
            ButtonPress::Activate if !self.latched => {
                self.button = Button::Activate;
                if self.mode != SafetyMode::Idle || self.pendant().worst() == Level::Fault {
                    return None;
                }
                self.last_seen_ns.fill(now_ns);
                self.enter(SafetyMode::Active, Cause::Operator)
            }
            ButtonPress::EStop => {
                self.latched = true;
                self.button = Button::EStop;
                self.enter(SafetyMode::EStop, Cause::Operator)
            }
            ButtonPress::Release => {
                self.latched = false;
                self.button = Button::None;
                None
            }
            ButtonPress::Idle | ButtonPress::Activate => None,
        }
    }

    /// Advances time; returns the mode frame to the motors, if the mode changes.
    pub fn tick(&mut self, now_ns: u64) -> Option<CanFrame> {
        if !self.latched && now_ns >= self.pressed_ns + PRESS_NS {
            self.button = Button::None;
        }
        let volts = self.config.voltage;
        let [low_warning, low_fault, high_warning, high_fault] = VOLTAGE_V;
        if volts < low_fault || volts > high_fault {
            self.voltage = Level::Fault;
        } else if self.voltage != Level::Fault {
            let warn = volts < low_warning || volts > high_warning;
            self.voltage = if warn { Level::Warning } else { Level::Safe };
        }
        if self.mode == SafetyMode::Active {
            let silent = |last_ns: &u64| now_ns > last_ns + self.config.heartbeat_ns;
            if self.last_seen_ns.iter().any(silent) {
                self.heartbeat = Level::Fault;
                return self.enter(SafetyMode::Idle, Cause::Heartbeat);
            }
            if self.voltage == Level::Fault {
                return self.enter(SafetyMode::Idle, Cause::Voltage);
            }
        }
        match self.velocity_fault_ns {
            Some(since_ns) if now_ns >= since_ns + self.config.slow_down_ns => {
                self.velocity_fault_ns = None;
                if self.too_fast {
                    return self.enter(SafetyMode::EStop, Cause::Velocity);
                }
                None
            }
            _ => None,
        }
    }

    /// Handles a frame of another node; returns its reply or its mode frame to the motors.
    pub fn handle_frame(&mut self, now_ns: u64, frame: &CanFrame) -> Option<CanFrame> {
        if !self.config.present {
            return None;
        }
        match MessageId::of(frame)?.to() {
            Destination::Group(GroupId::LOWER_TORQUES | GroupId::UPPER_TORQUES) => {
                self.check_torques(frame)
            }
            Destination::Group(GroupId::POSITION) => self.update_position(now_ns, frame),
            Destination::Node(NodeId::SAFETY) => match PropertyMessage::parse(frame).ok()? {
                PropertyMessage::Get(id) => {
                    let property = property_of(&self.table, id)?;
                    let value = self.value(property);
                    let width = self.table.width(property).unwrap_or(Width::Narrow);
                    let value = Value::of_width(value, width).unwrap_or(Value::Wide(value));
                    let reply = PropertyMessage::Set(id, value);
                    Some(reply.emit(NodeId::SAFETY, Destination::Group(GroupId::REPLY)))
                }
                PropertyMessage::Set(id, value) => {
                    let property = property_of(&self.table, id)?;
                    self.assign(property, value.get())
                }
            },
            _ => None,
        }
    }

    fn value(&self, property: Property) -> i32 {
        match property {
            Property::STAT => i32::from(Stat::Ready.value()),
            Property::MODE => i32::from(self.mode.value()),
            Property::PEN => self.pendant().emit().value(),
            Property::VBUS => self.config.voltage,
            other => self.store.get(other).unwrap_or(0),
        }
    }

    fn assign(&mut self, property: Property, value: i32) -> Option<CanFrame> {
        match property {
            Property::MODE => {
                let mode = self.mode.after_request(SafetyMode::from_value(value).ok()?);
                self.enter(mode, Cause::Host)
            }
            Property::VERS | Property::ROLE | Property::SN | Property::ID | Property::STAT => None,
            Property::ZERO => {
                self.set_zeroed(value != 0);
                None
            }
            other => {
                self.store.set(other, value);
                None
            }
        }
    }

    fn enter(&mut self, mode: SafetyMode, cause: Cause) -> Option<CanFrame> {
        if mode == self.mode {
            return None;
        }
        self.mode = mode;
        self.cause = cause;
        if mode == SafetyMode::EStop {
            self.set_zeroed(false);
        }
        let motors = match mode {
            SafetyMode::EStop | SafetyMode::Idle => MotorMode::Idle,
            SafetyMode::Active => MotorMode::Torque,
        };
        let id = self.table.id(Property::MODE)?;
        let message = PropertyMessage::Set(id, Value::Narrow(motors.value()));
        Some(message.emit(NodeId::SAFETY, Destination::Group(GroupId::ACTUATORS)))
    }

    fn limit(&self, property: Property) -> i32 {
        self.store.get(property).unwrap_or(0)
    }

    fn check_torques(&mut self, frame: &CanFrame) -> Option<CanFrame> {
        let torques = PackedTorques::parse(frame).ok()?;
        let max_torque = torques.slots.iter().map(|t| i32::from(t.units()).abs());
        let max_torque = max_torque.max().unwrap_or(0);
        if self.mode != SafetyMode::Active || self.torque == Level::Fault {
            return None;
        }
        if max_torque > self.limit(Property::TL2) {
            self.torque = Level::Fault;
            return self.enter(SafetyMode::Idle, Cause::Torque);
        }
        self.torque = if max_torque > self.limit(Property::TL1) {
            Level::Warning
        } else {
            Level::Safe
        };
        None
    }

    fn update_position(&mut self, now_ns: u64, frame: &CanFrame) -> Option<CanFrame> {
        let index = usize::from(MessageId::of(frame)?.from().number()).checked_sub(1)?;
        *self.last_seen_ns.get_mut(index)? = now_ns;
        let reply = PositionReply::parse(frame).ok()?;
        *self.counts.get_mut(index)? = Some(reply.motor.get());
        let [Some(a), Some(b), Some(c), Some(d)] = self.counts else {
            return None;
        };
        self.counts = [None; 4];
        let counts = [a, b, c, d];
        let motors = Vector4::from_fn(|i, _| f64::from(counts[i]) * self.rad_per_count[i]);
        let points = monitored_points_m(&(self.joint_from_motor * motors).into());
        self.history.push((now_ns, points));
        if self.history.len() <= HISTORY {
            return None;
        }
        let (then_ns, before) = self.history.remove(0);
        let elapsed_s = (now_ns - then_ns) as f64 * 1e-9;
        let moved = points.iter().zip(&before).map(|(a, b)| (a - b).norm());
        let speed = 4096.0 * moved.fold(0.0, f64::max) / elapsed_s;
        self.watch_speed(now_ns, speed)
    }

    /// Checks a speed, in the units of VL1 and VL2.
    fn watch_speed(&mut self, now_ns: u64, speed: f64) -> Option<CanFrame> {
        if self.limit(Property::ZERO) == 0 {
            return None;
        }
        let above = |limit: i32| limit != 0 && speed > f64::from(limit);
        self.too_fast = above(self.limit(Property::VL2));
        if self.too_fast {
            let ignored = self.limit(Property::IFAULT);
            if ignored > 0 {
                self.store.set(Property::IFAULT, ignored - 1);
                return None;
            }
            if self.mode == SafetyMode::Active {
                self.velocity = Level::Fault;
                self.velocity_fault_ns = Some(now_ns);
                return self.enter(SafetyMode::Idle, Cause::Velocity);
            }
        } else if self.velocity != Level::Fault {
            self.velocity = if above(self.limit(Property::VL1)) {
                Level::Warning
            } else {
                Level::Safe
            };
        }
        None
    }
}
