//! Faults of motors and bus that the emulator injects on request.

use core::fmt;
use core::str::FromStr;
use supple_damiao::{Register, Status, Value};

/// Syntax of a specification, for help texts.
pub const HELP: &str = "\
KIND or KIND:key=value,...; motor=K counts from 1, at-s=T is the time after the first motor was enabled; without at-s,
the fault exists from the start.

  error:code=C         the motor reports error code C: 8, 9, A to E; other codes are unknown errors
  silent               the motor neither replies nor reacts; its watchdog ends its last torque
  reappears            the motor's supply fails briefly: it is disabled, with the registers of its flash
  register:number=N,value=V   a register has another value, as in a motor of another type or with other settings
  hot:celsius=T        the motor has this temperature
  zero:offset-rad=X    the motor's zero position is shifted; 6.2832 is a whole turn
  swapped:with=J       the motor has exchanged its ids with motor J
  same-id:with=J       the motor has the ids of motor J
  first-write-ignored  the first write of a register has no effect
  no-watchdog          TIMEOUT keeps its value
  torque-sign          the commanded torque acts in the wrong direction, as with a wrong sign in the TOML; the damping is right
  reply-lost:every=N   one of N replies is missing
  late:delay-us=D      replies are delayed
  enabled              the motor is already enabled at the start
  classic              the motor answers FD frames with classic frames
  bus-off              the host's CAN controller is bus-off until it restarts (no motor=)
  wedged               the adapter accepts frames and sends none (no motor=)";

/// A fault of a motor or of the bus, with its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Misbehaviour {
    /// Motor, counted from 0; `None` for the bus.
    pub motor: Option<usize>,
    /// Time after the first motor was enabled \[s\]; `None` from the start.
    pub at_s: Option<f64>,
    /// Kind of fault.
    pub kind: MisbehaviourKind,
}

/// Kind of fault of a motor or of the bus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MisbehaviourKind {
    /// The motor reports an error and applies no torque.
    Error {
        /// The error.
        status: Status,
    },
    /// The motor neither replies nor reacts.
    Silent,
    /// The motor loses its supply briefly: it is disabled, with the registers of its flash.
    Reappears,
    /// A register has another value.
    Register {
        /// Register.
        register: Register,
        /// Bytes of the register.
        bytes: [u8; 4],
    },
    /// The motor has this temperature.
    Hot {
        /// Temperature \[degrees Celsius\].
        celsius: f64,
    },
    /// The zero position is shifted.
    Zero {
        /// Offset that is added to the position \[rad\].
        offset_rad: f64,
    },
    /// The motor has exchanged its ids with another motor, or has the same ids.
    SwappedWith {
        /// The other motor, counted from 0.
        other: usize,
        /// Whether the other motor keeps its ids, so that two motors have the same ids.
        same: bool,
    },
    /// The first register write has no effect.
    FirstWriteIgnored,
    /// The register TIMEOUT cannot be set.
    NoWatchdog,
    /// The commanded torque acts in the wrong direction.
    TorqueSign,
    /// One of every `every` replies is missing.
    ReplyLost {
        /// Number of replies of which one is missing.
        every: u32,
    },
    /// Replies are delayed.
    Late {
        /// Delay \[ns\].
        delay_ns: u64,
    },
    /// The motor is enabled before the host enables it.
    Enabled,
    /// The motor answers with classic frames.
    Classic,
    /// The host's CAN controller is bus-off until it restarts.
    BusOff,
    /// The host's adapter accepts frames but does not send them.
    Wedged,
}

impl fmt::Display for Misbehaviour {
    /// Writes the fault without its time.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(motor) = self.motor {
            write!(f, "motor {} ", motor + 1)?;
        }
        match self.kind {
            MisbehaviourKind::Error { status } => write!(f, "has an error: {status}"),
            MisbehaviourKind::Silent => f.write_str("is silent"),
            MisbehaviourKind::Reappears => f.write_str("loses its supply briefly"),
            MisbehaviourKind::Register { register, .. } => {
                write!(f, "has another value in {register}")
            }
            MisbehaviourKind::Hot { celsius } => write!(f, "is at {celsius} degrees Celsius"),
            MisbehaviourKind::Zero { offset_rad } => {
                write!(f, "has its zero position shifted by {offset_rad} rad")
            }
            MisbehaviourKind::SwappedWith { other, same: false } => {
                write!(f, "has exchanged its ids with motor {}", other + 1)
            }
            MisbehaviourKind::SwappedWith { other, same: true } => {
                write!(f, "has the ids of motor {}", other + 1)
            }
            MisbehaviourKind::FirstWriteIgnored => f.write_str("ignores the next write"),
            MisbehaviourKind::NoWatchdog => f.write_str("keeps its watchdog setting"),
            MisbehaviourKind::TorqueSign => {
                f.write_str("applies its torque in the wrong direction")
            }
            MisbehaviourKind::ReplyLost { every } => write!(f, "loses one of {every} replies"),
            MisbehaviourKind::Late { delay_ns } => {
                write!(f, "replies {} us later", delay_ns / 1000)
            }
            MisbehaviourKind::Enabled => f.write_str("is enabled"),
            MisbehaviourKind::Classic => f.write_str("answers with classic frames"),
            MisbehaviourKind::BusOff => f.write_str("the host's CAN controller is bus-off"),
            MisbehaviourKind::Wedged => f.write_str("the host's adapter does not send its frames"),
        }
    }
}

/// Error: the specification is not valid.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MisbehaviourError {
    text: String,
    reason: String,
}

impl fmt::Display for MisbehaviourError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let MisbehaviourError { text, reason } = self;
        write!(f, "`{text}`: {reason}; `supple-emu --help` lists all kinds")
    }
}

impl core::error::Error for MisbehaviourError {}

/// Keys of a specification that have not been read; reading a key removes it.
struct UnreadKeys<'a>(Vec<(&'a str, &'a str)>);

impl UnreadKeys<'_> {
    fn take(&mut self, key: &str) -> Option<String> {
        let at = self.0.iter().position(|(name, _)| *name == key)?;
        Some(self.0.remove(at).1.to_owned())
    }

    fn number<T: FromStr>(&mut self, key: &str) -> Result<T, String> {
        let text = self.take(key).ok_or(format!("{key} is missing"))?;
        text.parse()
            .map_err(|_| format!("{key}={text} is not valid"))
    }

    fn motor(&mut self, key: &str) -> Result<usize, String> {
        let number: usize = self.number(key)?;
        number
            .checked_sub(1)
            .ok_or(format!("{key}=0: motors count from 1"))
    }
}

impl FromStr for Misbehaviour {
    type Err = MisbehaviourError;

    fn from_str(text: &str) -> Result<Misbehaviour, MisbehaviourError> {
        parse(text).map_err(|reason| MisbehaviourError {
            text: text.to_owned(),
            reason,
        })
    }
}

fn parse(text: &str) -> Result<Misbehaviour, String> {
    let (name, rest) = text.split_once(':').unwrap_or((text, ""));
    let mut pairs = Vec::new();
    for pair in rest.split(',').filter(|pair| !pair.is_empty()) {
        pairs.push(
            pair.split_once('=')
                .ok_or(format!("`{pair}` is not key=value"))?,
        );
    }
    let mut keys = UnreadKeys(pairs);
    let kind = match name {
        "error" => {
            let code = keys.take("code").ok_or("code is missing")?;
            let code = u8::from_str_radix(&code, 16)
                .ok()
                .filter(|code| (2..16).contains(code));
            let code = code.ok_or("code must be a hexadecimal digit from 2 to F")?;
            MisbehaviourKind::Error {
                status: Status::from_code(code),
            }
        }
        "silent" => MisbehaviourKind::Silent,
        "reappears" => MisbehaviourKind::Reappears,
        "register" => {
            let register = Register(keys.number("number")?);
            let info = register.info().ok_or(format!("{register} is not known"))?;
            let value: f64 = keys.number("value")?;
            let value = match info.kind {
                supple_damiao::register::Kind::Integer => Value::Integer(value as u32),
                supple_damiao::register::Kind::Float => Value::Float(value as f32),
                supple_damiao::register::Kind::Text => {
                    let digits = format!("{:04}", (value as u32).min(9999));
                    let mut bytes = [b'0'; 4];
                    bytes.copy_from_slice(digits.as_bytes());
                    Value::Text(bytes)
                }
            };
            let bytes = value.to_bytes();
            MisbehaviourKind::Register { register, bytes }
        }
        "hot" => MisbehaviourKind::Hot {
            celsius: keys.number("celsius")?,
        },
        "zero" => MisbehaviourKind::Zero {
            offset_rad: keys.number("offset-rad")?,
        },
        "swapped" | "same-id" => MisbehaviourKind::SwappedWith {
            other: keys.motor("with")?,
            same: name == "same-id",
        },
        "first-write-ignored" => MisbehaviourKind::FirstWriteIgnored,
        "no-watchdog" => MisbehaviourKind::NoWatchdog,
        "torque-sign" => MisbehaviourKind::TorqueSign,
        "reply-lost" => MisbehaviourKind::ReplyLost {
            every: keys.number::<u32>("every")?.max(1),
        },
        "late" => MisbehaviourKind::Late {
            delay_ns: keys.number::<u32>("delay-us").map(u64::from)? * 1000,
        },
        "enabled" => MisbehaviourKind::Enabled,
        "classic" => MisbehaviourKind::Classic,
        "bus-off" => MisbehaviourKind::BusOff,
        "wedged" => MisbehaviourKind::Wedged,
        other => return Err(format!("the kind `{other}` does not exist")),
    };
    let of_the_bus = matches!(kind, MisbehaviourKind::BusOff | MisbehaviourKind::Wedged);
    let motor = match of_the_bus {
        true => None,
        false => Some(keys.motor("motor")?),
    };
    let at_s = match keys.take("at-s") {
        None => None,
        Some(text) => {
            let at_s: Option<f64> = text.parse().ok();
            let at_s = at_s.filter(|at_s| (0.0..=1e6).contains(at_s));
            Some(at_s.ok_or(format!("at-s={text} must be from 0 to 1000000 s"))?)
        }
    };
    match keys.0.first() {
        None => Ok(Misbehaviour { motor, at_s, kind }),
        Some((key, _)) => Err(format!("{name} has no key `{key}`")),
    }
}
