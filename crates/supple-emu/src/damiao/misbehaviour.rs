//! What a motor or the bus does wrong, on request.

use core::fmt;
use core::str::FromStr;
use supple_damiao::{Register, Status, Value};

/// Syntax, for help texts.
pub const HELP: &str = "\
KIND or KIND:key=value,...; motor=K counts from 1, at-s=T is the time after the first motor was enabled; without it the
arm has the fault from the start.

  error:code=C         error code C: 8, 9, A to E, others unknown
  silent               no reply, no reaction; its last torque stays until the watchdog ends it
  reappears            its supply fails for a moment: disabled, registers as in flash
  register:number=N,value=V   a register has another value, as of another type or set-up
  hot:celsius=T        temperature
  zero:offset-rad=X    its zero is elsewhere; 6.2832 is a whole turn
  swapped:with=J       ids exchanged with motor J
  same-id:with=J       the ids of motor J
  first-write-ignored  the first write of a register has no effect
  no-watchdog          TIMEOUT keeps its value
  torque-sign          the torque that it is sent acts the wrong way, as of a wrong sign in the set-up; its damping is right
  reply-lost:every=N   one of N replies is missing
  late:delay-us=D      replies come later
  enabled              already enabled at the start
  classic              answers FD frames with classic ones
  bus-off              the host's CAN controller leaves the bus for a while (no motor=)
  wedged               the adapter accepts frames and sends none (no motor=)";

/// A misbehaviour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Misbehaviour {
    /// Motor, counted from 0; `None` for the bus.
    pub motor: Option<usize>,
    /// Time after the first motor was enabled \[s\]; `None` from the start.
    pub at_s: Option<f64>,
    /// What.
    pub kind: MisbehaviourKind,
}

/// What a motor or the bus does wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MisbehaviourKind {
    /// An error: no torque.
    Error {
        /// The error.
        status: Status,
    },
    /// No replies, no reaction.
    Silent,
    /// Disabled, with the registers of its flash.
    Reappears,
    /// Another value in a register.
    Register {
        /// Register.
        register: Register,
        /// Its bytes.
        bytes: [u8; 4],
    },
    /// A temperature \[degrees Celsius\].
    Hot {
        /// Temperature.
        celsius: f64,
    },
    /// The zero is elsewhere \[rad\].
    Zero {
        /// Added to its position.
        offset_rad: f64,
    },
    /// Ids exchanged with another motor, or taken from it.
    SwappedWith {
        /// The other, counted from 0.
        other: usize,
        /// Whether the other one keeps its ids: two motors then have the same.
        same: bool,
    },
    /// The first register write has no effect.
    FirstWriteIgnored,
    /// TIMEOUT cannot be set.
    NoWatchdog,
    /// The torque that it is sent acts the wrong way.
    TorqueSign,
    /// One of so many replies is missing.
    ReplyLost {
        /// Period.
        every: u32,
    },
    /// Replies are late \[ns\].
    Late {
        /// Delay.
        delay_ns: u64,
    },
    /// Enabled before the host enables it.
    Enabled,
    /// Answers with classic frames.
    Classic,
    /// The host's controller is bus-off for a while.
    BusOff,
    /// Frames of the host are accepted and not sent.
    Wedged,
}

impl fmt::Display for Misbehaviour {
    /// What begins, without its time.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(motor) = self.motor {
            write!(f, "motor {} ", motor + 1)?;
        }
        match self.kind {
            MisbehaviourKind::Error { status } => write!(f, "has an error: {status}"),
            MisbehaviourKind::Silent => f.write_str("is silent"),
            MisbehaviourKind::Reappears => f.write_str("loses its supply for a moment"),
            MisbehaviourKind::Register { register, .. } => {
                write!(f, "has another value in {register}")
            }
            MisbehaviourKind::Hot { celsius } => write!(f, "is at {celsius} degrees Celsius"),
            MisbehaviourKind::Zero { offset_rad } => {
                write!(f, "has its zero {offset_rad} rad elsewhere")
            }
            MisbehaviourKind::SwappedWith { other, same: false } => {
                write!(f, "has exchanged its ids with motor {}", other + 1)
            }
            MisbehaviourKind::SwappedWith { other, same: true } => {
                write!(f, "has the ids of motor {}", other + 1)
            }
            MisbehaviourKind::FirstWriteIgnored => f.write_str("ignores the next write"),
            MisbehaviourKind::NoWatchdog => f.write_str("keeps its watchdog setting"),
            MisbehaviourKind::TorqueSign => f.write_str("turns its torque the wrong way"),
            MisbehaviourKind::ReplyLost { every } => write!(f, "loses one of {every} replies"),
            MisbehaviourKind::Late { delay_ns } => {
                write!(f, "replies {} us later", delay_ns / 1000)
            }
            MisbehaviourKind::Enabled => f.write_str("is enabled"),
            MisbehaviourKind::Classic => f.write_str("answers with classic frames"),
            MisbehaviourKind::BusOff => f.write_str("the host's controller is bus-off"),
            MisbehaviourKind::Wedged => f.write_str("the adapter sends nothing any more"),
        }
    }
}

/// A specification that is not valid.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MisbehaviourError {
    text: String,
    reason: String,
}

impl fmt::Display for MisbehaviourError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let MisbehaviourError { text, reason } = self;
        write!(
            f,
            "`{text}`: {reason}; see `supple-emu --help` for all kinds"
        )
    }
}

impl core::error::Error for MisbehaviourError {}

/// The keys of a specification, each to be used once.
struct Keys<'a>(Vec<(&'a str, &'a str)>);

impl Keys<'_> {
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
    let mut keys = Keys(pairs);
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
        other => return Err(format!("there is no kind `{other}`")),
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
