//! Registers: their numbers, kinds and access, the frames that read and write them, and the replies.
//!
//! Read and write requests have the id 0x7FF and the motor's id in the payload. The reply has the motor's reply id and
//! repeats the request. A reply cannot be distinguished from feedback of a disabled motor without the request, therefore
//! [`RegisterReply::parse`] needs the request. A write acts at once and is lost when the supply is switched off; this module
//! cannot store it.

use crate::frame::Frame;
use core::fmt;

/// Id of all register frames.
pub const BROADCAST: u16 = 0x7FF;

const READ: u8 = 0x33;
const WRITE: u8 = 0x55;
const FEEDBACK: u8 = 0xCC;

/// Number of a register.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Register(pub u8);

/// Type of a register's four bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Unsigned integer.
    Integer,
    /// Single precision.
    Float,
    /// Four ASCII characters.
    Text,
}

/// Access to a register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Only the motor changes the register.
    ReadOnly,
    /// The operator may write the register; start-up writes it only as documented there.
    Writable,
    /// The motor accepts a write, but this program never sends one: ranges of the frames and bit rate, which must be equal in
    /// host and motor, and registers whose write stores a zero position in some firmware.
    Forbidden,
}

/// Properties of a register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RegisterInfo {
    /// Number.
    pub register: Register,
    /// Name in the maker's manuals.
    pub name: &'static str,
    /// Unit; empty for none.
    pub unit: &'static str,
    /// Kind.
    pub kind: Kind,
    /// Access.
    pub access: Access,
}

macro_rules! registers {
    ($($constant:ident = $number:literal, $name:literal, $unit:literal, $kind:ident, $access:ident;)*) => {
        impl Register {
            $(
                #[doc = concat!("`", $name, "`")]
                pub const $constant: Register = Register($number);
            )*
        }

        /// All registers that every firmware from version 13 on has, by number.
        pub const REGISTERS: &[RegisterInfo] = &[$(RegisterInfo {
            register: Register::$constant,
            name: $name,
            unit: $unit,
            kind: Kind::$kind,
            access: Access::$access,
        }),*];
    };
}

registers! {
    UNDER_VOLTAGE = 0, "UV_Value", "V", Float, Writable;
    TORQUE_CONSTANT = 1, "KT_Value", "N m/A", Float, ReadOnly;
    OVER_TEMPERATURE = 2, "OT_Value", "degrees C", Float, Writable;
    OVER_CURRENT = 3, "OC_Value", "of Imax", Float, Writable;
    ACCELERATION = 4, "ACC", "rad/s^2", Float, Writable;
    DECELERATION = 5, "DEC", "rad/s^2", Float, Writable;
    MAX_SPEED = 6, "MAX_SPD", "rad/s", Float, Writable;
    REPLY_ID = 7, "MST_ID", "", Integer, Writable;
    ID = 8, "ESC_ID", "", Integer, Writable;
    TIMEOUT = 9, "TIMEOUT", "of 50 us", Integer, Writable;
    MODE = 10, "CTRL_MODE", "", Integer, Writable;
    DAMPING = 11, "Damp", "N m s/rad", Float, ReadOnly;
    ROTOR_INERTIA = 12, "Inertia", "kg m^2", Float, ReadOnly;
    HARDWARE = 13, "hw_ver", "", Text, ReadOnly;
    FIRMWARE = 14, "sw_ver", "", Text, ReadOnly;
    SERIAL = 15, "SN", "", Text, ReadOnly;
    POLE_PAIRS = 16, "NPP", "", Integer, ReadOnly;
    RESISTANCE = 17, "Rs", "ohm", Float, ReadOnly;
    INDUCTANCE = 18, "Ls", "H", Float, ReadOnly;
    FLUX = 19, "Flux", "Wb", Float, ReadOnly;
    GEAR_RATIO = 20, "Gr", "", Float, ReadOnly;
    POSITION_RANGE = 21, "PMAX", "rad", Float, Forbidden;
    VELOCITY_RANGE = 22, "VMAX", "rad/s", Float, Forbidden;
    TORQUE_RANGE = 23, "TMAX", "N m", Float, Forbidden;
    CURRENT_BANDWIDTH = 24, "I_BW", "rad/s", Float, ReadOnly;
    SPEED_KP = 25, "KP_ASR", "", Float, ReadOnly;
    SPEED_KI = 26, "KI_ASR", "", Float, ReadOnly;
    POSITION_KP = 27, "KP_APR", "", Float, ReadOnly;
    POSITION_KI = 28, "KI_APR", "", Float, ReadOnly;
    OVER_VOLTAGE = 29, "OV_Value", "V", Float, Writable;
    GEAR_EFFICIENCY = 30, "GREF", "", Float, ReadOnly;
    SPEED_DAMPING = 31, "Deta", "", Float, ReadOnly;
    VELOCITY_BANDWIDTH = 32, "V_BW", "Hz", Float, Writable;
    BIT_RATE = 35, "can_br", "", Integer, Forbidden;
    SUB_VERSION = 36, "sub_ver", "", Integer, ReadOnly;
    MOTOR_POSITION = 80, "p_m", "rad", Float, Forbidden;
    SHAFT_POSITION = 81, "xout", "rad", Float, Forbidden;
}

impl Register {
    /// Returns the properties of the register, if it is known.
    pub fn info(self) -> Option<&'static RegisterInfo> {
        REGISTERS.iter().find(|info| info.register == self)
    }

    /// Finds the register with this name in the maker's manuals; ignores case.
    pub fn by_name(name: &str) -> Option<&'static RegisterInfo> {
        REGISTERS
            .iter()
            .find(|info| info.name.eq_ignore_ascii_case(name))
    }
}

impl fmt::Display for Register {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.info() {
            Some(info) => write!(f, "register {} ({})", self.0, info.name),
            None => write!(f, "register {}", self.0),
        }
    }
}

/// Value of a register.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// Unsigned integer.
    Integer(u32),
    /// Single precision.
    Float(f32),
    /// Four characters.
    Text([u8; 4]),
}

impl Value {
    /// Decodes four bytes.
    pub const fn from_bytes(kind: Kind, bytes: [u8; 4]) -> Value {
        match kind {
            Kind::Integer => Value::Integer(u32::from_le_bytes(bytes)),
            Kind::Float => Value::Float(f32::from_le_bytes(bytes)),
            Kind::Text => Value::Text(bytes),
        }
    }

    /// Encodes the value as four bytes.
    pub const fn to_bytes(self) -> [u8; 4] {
        match self {
            Value::Integer(value) => value.to_le_bytes(),
            Value::Float(value) => value.to_le_bytes(),
            Value::Text(bytes) => bytes,
        }
    }

    /// Returns the kind of the value.
    pub const fn kind(self) -> Kind {
        match self {
            Value::Integer(_) => Kind::Integer,
            Value::Float(_) => Kind::Float,
            Value::Text(_) => Kind::Text,
        }
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Integer(value) => write!(f, "{value}"),
            Value::Float(value) => write!(f, "{value}"),
            Value::Text(bytes) => bytes.iter().try_for_each(|byte| {
                let printable = (0x20..0x7F).contains(byte);
                write!(f, "{}", if printable { char::from(*byte) } else { '?' })
            }),
        }
    }
}

/// Reason why this crate does not encode a write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WriteError {
    /// The register is not known.
    Unknown(Register),
    /// The register is read-only, or this program never writes it.
    NotWritable(Register),
    /// The value is of another kind than the register.
    Kind(Register),
    /// The value is not finite.
    NotFinite(Register),
}

impl fmt::Display for WriteError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            WriteError::Unknown(register) => write!(f, "{register} is not known"),
            WriteError::NotWritable(register) => write!(f, "{register} is not written"),
            WriteError::Kind(register) => write!(f, "{register} holds another kind of value"),
            WriteError::NotFinite(register) => write!(f, "{register} needs a finite value"),
        }
    }
}

impl core::error::Error for WriteError {}

/// Creates the frame that reads a register of the motor with `id`.
pub const fn read(id: u8, register: Register) -> Frame {
    Frame::of(BROADCAST, [id, 0, READ, register.0, 0, 0, 0, 0])
}

/// Creates the frame that writes a register of the motor with `id`. The motor keeps the value until its supply is switched
/// off.
///
/// # Errors
/// [`WriteError`] with the reason.
pub fn write(id: u8, register: Register, value: Value) -> Result<Frame, WriteError> {
    let info = register.info().ok_or(WriteError::Unknown(register))?;
    if info.access != Access::Writable {
        return Err(WriteError::NotWritable(register));
    }
    if info.kind != value.kind() {
        return Err(WriteError::Kind(register));
    }
    if matches!(value, Value::Float(x) if !x.is_finite()) {
        return Err(WriteError::NotFinite(register));
    }
    let [a, b, c, d] = value.to_bytes();
    Ok(Frame::of(BROADCAST, [id, 0, WRITE, register.0, a, b, c, d]))
}

/// Creates the frame that requests the feedback of the motor with `id` without a command; firmware version 13 or later.
pub const fn request_feedback(id: u8) -> Frame {
    Frame::of(BROADCAST, [id, 0, FEEDBACK, 0, 0, 0, 0, 0])
}

/// Operation that a register reply answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation {
    /// A read.
    Read,
    /// A write.
    Write,
}

/// Reply to a read or write of a register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RegisterReply {
    /// Register.
    pub register: Register,
    /// Four bytes of the register.
    pub bytes: [u8; 4],
}

impl RegisterReply {
    /// Parses the reply of the motor with `id` to an operation on `register`; `None` for any other frame.
    pub fn parse(
        frame: &Frame,
        id: u8,
        operation: Operation,
        register: Register,
    ) -> Option<RegisterReply> {
        let code = match operation {
            Operation::Read => READ,
            Operation::Write => WRITE,
        };
        let [low, high, found, number, a, b, c, d] = *frame.eight()?;
        let answers = (low, high, found, number) == (id, 0, code, register.0);
        answers.then_some(RegisterReply {
            register,
            bytes: [a, b, c, d],
        })
    }

    /// Encodes the reply frame of the motor with `id`, which replies with `reply_id`.
    pub fn emit(&self, id: u8, reply_id: u16, operation: Operation) -> Frame {
        let code = match operation {
            Operation::Read => READ,
            Operation::Write => WRITE,
        };
        let [a, b, c, d] = self.bytes;
        Frame::of(reply_id, [id, 0, code, self.register.0, a, b, c, d])
    }

    /// Decodes the value according to the register's kind; an unknown register is an integer.
    pub fn value(&self) -> Value {
        let kind = self.register.info().map_or(Kind::Integer, |info| info.kind);
        Value::from_bytes(kind, self.bytes)
    }
}
