//! One emulated motor: status, registers, replies and torque.
//!
//! Positions are positions of the output shaft. Codes are truncated, because the motors are assumed to truncate them. The
//! torque follows the last command, even if the command arrived before the motor was enabled, until the watchdog ends it.

use super::config::MotorConfig;
use super::misbehaviour::MisbehaviourKind;
use super::registers::Registers;
use core::f64::consts::TAU;
use supple_can_frame::{CanFrame, FrameFormat};
use supple_damiao::code::LinearCode;
use supple_damiao::inspection::MIT_MODE;
use supple_damiao::register::{Access, Operation};
use supple_damiao::{
    Feedback, Frame, MitCodes, Register, RegisterReply, Request, SpecialCommand, Status, Value,
};

/// Units of TIMEOUT \[ns\].
const TIMEOUT_UNIT_NS: u64 = 50_000;
/// Bandwidth of the reported torque \[Hz\], an assumption.
const TORQUE_BANDWIDTH_HZ: f64 = 200.0;
/// Heating \[degrees Celsius/s\] per squared fraction of the peak torque, and time constant of cooling \[s\]. With these
/// assumed values, a motor at a third of its peak torque warms from 30 to about 60 degrees.
const HEATING_PER_S: f64 = 0.9;
const COOLING_S: f64 = 300.0;
const AMBIENT_CELSIUS: f64 = 25.0;

/// Reaction of the motor to a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Reaction {
    /// Reply, if any.
    pub reply: Option<CanFrame>,
    /// Request of the frame, if it writes flash.
    pub flash: Option<Request>,
}

/// An emulated motor.
#[derive(Clone, Debug)]
pub struct Motor {
    config: MotorConfig,
    ram: Registers,
    flash: Registers,
    status: Status,
    command: Option<MitCodes>,
    /// Time of the last command while enabled \[ns\].
    commanded_ns: u64,
    /// Position of the shaft, including whole turns \[rad\].
    position_rad: f64,
    velocity_rad_per_s: f64,
    /// Offset that the motor adds to the position, from whole turns and a shifted zero position \[rad\].
    shift_rad: f64,
    reported_velocity_rad_per_s: f64,
    reported_torque_nm: f64,
    celsius: f64,
    /// Whether the motor has replied; it reports temperatures from the second reply on.
    replied: bool,
    silent: bool,
    /// Number of writes that are still ignored.
    ignored_writes: u32,
    watchdog_stuck: bool,
    /// Sign of the commanded torque: -1 if the host uses the wrong sign.
    torque_sign: f64,
    /// One of this number of replies is dropped; 0 for none.
    drop_every: u32,
    replies: u32,
    late_ns: u64,
}

impl Motor {
    pub(super) fn new(config: MotorConfig) -> Motor {
        let registers = Registers::new(&config);
        Motor {
            ram: registers.clone(),
            flash: registers,
            status: Status::Disabled,
            command: None,
            commanded_ns: 0,
            position_rad: 0.0,
            velocity_rad_per_s: 0.0,
            shift_rad: 0.0,
            reported_velocity_rad_per_s: 0.0,
            reported_torque_nm: 0.0,
            celsius: config.celsius,
            replied: false,
            silent: false,
            ignored_writes: 0,
            watchdog_stuck: false,
            torque_sign: 1.0,
            drop_every: 0,
            replies: 0,
            late_ns: 0,
            config,
        }
    }

    /// State.
    pub fn status(&self) -> Status {
        self.status
    }

    /// Time of the last command while the motor was enabled \[ns\].
    pub fn commanded_ns(&self) -> u64 {
        self.commanded_ns
    }

    /// Bytes of a register, as a host reads them.
    pub fn register(&self, register: Register) -> [u8; 4] {
        match register {
            Register::SHAFT_POSITION | Register::MOTOR_POSITION => {
                (self.reported_position_rad() as f32).to_le_bytes()
            }
            other => self.ram.bytes(other),
        }
    }

    /// Temperature \[degrees Celsius\].
    pub fn celsius(&self) -> f64 {
        self.celsius
    }

    /// Whether the phases are shorted.
    pub(super) fn brakes(&self) -> bool {
        self.status != Status::Enabled && self.config.brakes_when_disabled
    }

    /// Additional delay of replies \[ns\].
    pub(super) fn late_ns(&self) -> u64 {
        self.late_ns
    }

    /// Position as the motor measures it \[rad\].
    fn reported_position_rad(&self) -> f64 {
        self.position_rad + self.shift_rad
    }

    /// Torque of the motor at the joint, as its current controller estimates it \[N m\].
    pub fn joint_torque_nm(&self) -> f64 {
        self.config.direction * self.shaft_torque_nm()
    }

    fn shaft_torque_nm(&self) -> f64 {
        let Some(codes) = self.command else {
            return 0.0;
        };
        if self.status != Status::Enabled || self.ram.integer(Register::MODE) != MIT_MODE {
            return 0.0;
        }
        let ranges = self.ram.ranges();
        let command = codes.command(&ranges);
        let torque_nm = command.kp_nm_per_rad
            * (command.position_rad - self.reported_position_rad())
            + command.kd_nm_s_per_rad * (command.velocity_rad_per_s - self.velocity_rad_per_s)
            + self.torque_sign * command.torque_nm;
        let limit_nm = ranges.torque().max().min(self.config.peak_torque_nm);
        torque_nm.clamp(-limit_nm, limit_nm)
    }

    /// Updates the motion of the joint, and advances watchdog, filters and temperature by `step_s`.
    pub(super) fn tick(&mut self, now_ns: u64, joint_rad: f64, joint_rad_per_s: f64, step_s: f64) {
        let direction = self.config.direction;
        self.position_rad = direction * (joint_rad - self.config.zero_offset_rad);
        self.velocity_rad_per_s = direction * joint_rad_per_s;
        let follow = |value: &mut f64, target: f64, bandwidth_hz: f64| {
            let share = 1.0 - (-TAU * bandwidth_hz * step_s).exp();
            *value += share * (target - *value);
        };
        let torque_nm = self.shaft_torque_nm();
        let bandwidth_hz = self.ram.float(Register::VELOCITY_BANDWIDTH).max(1.0);
        follow(
            &mut self.reported_velocity_rad_per_s,
            self.velocity_rad_per_s,
            bandwidth_hz,
        );
        follow(&mut self.reported_torque_nm, torque_nm, TORQUE_BANDWIDTH_HZ);
        let share = torque_nm / self.config.peak_torque_nm;
        let cooling = (self.celsius - AMBIENT_CELSIUS) / COOLING_S;
        self.celsius += step_s * (HEATING_PER_S * share * share - cooling);
        if self.status == Status::Enabled {
            if self.celsius > self.ram.float(Register::OVER_TEMPERATURE) {
                self.status = Status::WindingHot;
            }
            let timeout = u64::from(self.ram.integer(Register::TIMEOUT));
            if timeout > 0 && now_ns.saturating_sub(self.commanded_ns) > timeout * TIMEOUT_UNIT_NS {
                self.status = Status::CommunicationLost;
            }
        }
    }

    /// Processes a frame of the host. With `allow_flash`, the motor also executes requests that write flash.
    pub(super) fn handle_frame(
        &mut self,
        now_ns: u64,
        frame: &CanFrame,
        allow_flash: bool,
    ) -> Reaction {
        let id = self.ram.integer(Register::ID) as u8;
        let Some(request) = Frame::of_bus(frame)
            .ok()
            .and_then(|frame| Request::parse(&frame, id))
        else {
            return Reaction::default();
        };
        if self.silent {
            return Reaction::default();
        }
        let flash = request.writes_flash().then_some(request);
        if flash.is_some() && !allow_flash {
            return Reaction { reply: None, flash };
        }
        let reply = self.execute(now_ns, request, id);
        self.replies = self.replies.wrapping_add(1);
        let dropped = self.drop_every > 0 && self.replies.is_multiple_of(self.drop_every);
        let format = match self.ram.is_fd() {
            true => FrameFormat::Fd {
                bit_rate_switch: true,
            },
            false => FrameFormat::Classic,
        };
        let reply = reply.filter(|_| !dropped).map(|reply| reply.on_bus(format));
        Reaction { reply, flash }
    }

    fn execute(&mut self, now_ns: u64, request: Request, id: u8) -> Option<Frame> {
        let reply_id = self.ram.integer(Register::REPLY_ID) as u16;
        match request {
            Request::Mit(codes) => {
                self.command = Some(codes);
                if self.status == Status::Enabled {
                    self.commanded_ns = now_ns;
                }
            }
            Request::SpecialCommand(SpecialCommand::Enable) => {
                if self.status == Status::Disabled {
                    self.status = Status::Enabled;
                }
                self.commanded_ns = now_ns;
            }
            Request::SpecialCommand(SpecialCommand::Disable) => {
                if self.status == Status::Enabled {
                    self.status = Status::Disabled;
                }
            }
            Request::SpecialCommand(SpecialCommand::ClearError) => {
                if self.status.is_error() {
                    self.status = Status::Disabled;
                }
            }
            Request::SetZero => self.shift_rad = -self.position_rad,
            Request::StoreAll => self.flash = self.ram.clone(),
            Request::Read(register) => {
                return Registers::has(register).then(|| {
                    let bytes = self.register(register);
                    RegisterReply { register, bytes }.emit(id, reply_id, Operation::Read)
                });
            }
            Request::Write(register, bytes) => {
                if !Registers::has(register) {
                    return None;
                }
                self.write(register, bytes);
                let bytes = self.register(register);
                return Some(RegisterReply { register, bytes }.emit(
                    id,
                    reply_id,
                    Operation::Write,
                ));
            }
            // No program of this project uses the other modes: the motor answers and applies no torque.
            Request::PositionVelocity(..)
            | Request::Velocity(_)
            | Request::ForcePosition(..)
            | Request::Feedback => {}
        }
        Some(self.feedback(id).emit(reply_id))
    }

    fn write(&mut self, register: Register, bytes: [u8; 4]) {
        if self.ignored_writes > 0 {
            self.ignored_writes -= 1;
            return;
        }
        let read_only = register
            .info()
            .is_none_or(|info| info.access == Access::ReadOnly);
        if read_only || (register == Register::TIMEOUT && self.watchdog_stuck) {
            return;
        }
        self.ram.set_bytes(register, bytes);
        if register == Register::MODE {
            self.command = None;
        }
    }

    fn feedback(&mut self, id: u8) -> Feedback {
        let ranges = self.ram.ranges();
        let celsius = match self.replied {
            true => self.celsius.clamp(0.0, 255.0) as u8,
            false => 0,
        };
        self.replied = true;
        Feedback {
            status: self.status,
            motor: id & 0xF,
            position: truncated(ranges.position(), self.reported_position_rad()),
            velocity: truncated(ranges.velocity(), self.reported_velocity_rad_per_s),
            torque: truncated(ranges.torque(), self.reported_torque_nm),
            mosfet_celsius: celsius,
            winding_celsius: celsius,
        }
    }

    /// Begins a misbehaviour.
    pub(super) fn misbehave(&mut self, kind: MisbehaviourKind) {
        match kind {
            MisbehaviourKind::Error { status } => self.status = status,
            MisbehaviourKind::Silent => self.silent = true,
            MisbehaviourKind::Reappears => {
                // The supply was interrupted: values that were not stored in flash are lost.
                self.ram = self.flash.clone();
                self.status = Status::Disabled;
                self.command = None;
                self.replied = false;
            }
            MisbehaviourKind::Register { register, bytes } => {
                self.ram.set_bytes(register, bytes);
            }
            MisbehaviourKind::Hot { celsius } => self.celsius = celsius,
            MisbehaviourKind::Zero { offset_rad } => self.shift_rad += offset_rad,
            MisbehaviourKind::FirstWriteIgnored => self.ignored_writes = 1,
            MisbehaviourKind::NoWatchdog => self.watchdog_stuck = true,
            MisbehaviourKind::TorqueSign => self.torque_sign = -1.0,
            MisbehaviourKind::ReplyLost { every } => self.drop_every = every,
            MisbehaviourKind::Late { delay_ns } => self.late_ns = delay_ns,
            MisbehaviourKind::Enabled => self.status = Status::Enabled,
            MisbehaviourKind::Classic => {
                self.ram.set(Register::BIT_RATE, Value::Integer(4));
            }
            MisbehaviourKind::SwappedWith { .. }
            | MisbehaviourKind::BusOff
            | MisbehaviourKind::Wedged => {}
        }
    }

    /// Ids of frames to the motor and of its replies.
    pub(super) fn ids(&self) -> [u32; 2] {
        [Register::ID, Register::REPLY_ID].map(|register| self.ram.integer(register))
    }

    pub(super) fn set_ids(&mut self, ids: [u32; 2]) {
        for (register, id) in [Register::ID, Register::REPLY_ID].into_iter().zip(ids) {
            self.ram.set(register, Value::Integer(id));
            self.flash.set(register, Value::Integer(id));
        }
    }
}

/// Returns the next code below a value, as the motors and the public drivers compute it.
fn truncated(code: &LinearCode, value: f64) -> u16 {
    let range = code.max();
    let value = value.clamp(-range, range);
    ((value + range) / code.step()) as u16
}
