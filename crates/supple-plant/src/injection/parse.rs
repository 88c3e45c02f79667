//! Injections as text: `KIND`, or `KIND:key=value,key=value`.

use super::kinds::{Injection, InjectionKind, Trigger};
use core::fmt;
use core::str::FromStr;
use supple_core::codes::MODES;
use supple_core::controller::Mode;

/// Every kind with its keys, for the help text of a program.
pub const HELP: &str = "\
A fault to inject into the simulated arm, KIND or KIND:key=value,key=value. May be repeated.

Kinds, joints and motors counted from 0 (no joint: all of them):
  encoder-stuck[:joint=I]                the encoder keeps its last angle
  motor-encoder-stuck:motor=I            the encoder of a motor keeps its last angle
  encoder-late:cycles=K[,joint=I]        the angles lag by K control cycles
  encoder-sign[:joint=I]                 the encoder counts backwards from its current angle
  encoder-offset:offset-rad=X[,joint=I]  the angle jumps once by X
  encoder-nan[:joint=I]                  the angle is not a number (not on a bus)
  reply-lost:every=K[,joint=I]           one reply in K is not sent
  motor-dead:motor=I                     no torque, and no braking
  torque-sign:joint=I                    the opposite of the commanded torque
  torque-late:cycles=K                   torques act K control cycles later
  gravity-reversed                       gravity is reversed: the arm is mounted upside down
  bump:joint=I,speed-rad-per-s=X         the joint's velocity changes by a step of X
  payload:mass-kg=X                      a ball of X kg at the tip
  drives-idle[:for-s=X]                  the drives go to idle and brake (not on a bus)

Additional keys for the start time; default: before the first cycle:
  at-s=X                  X s after the drives were first active
  when=MODE[,after-s=X]   X s after MODE first began with active drives (not on a bus)
Modes: idle, gravity_hold, move, track, probe, fault, excite, breakaway.

Example: encoder-stuck:joint=1,when=track,after-s=0.5";

/// Names of all kinds with their keys, without those of the trigger.
const KINDS: [(&str, &[&str]); 14] = [
    ("encoder-stuck", &["joint"]),
    ("motor-encoder-stuck", &["motor"]),
    ("encoder-late", &["joint", "cycles"]),
    ("encoder-sign", &["joint"]),
    ("encoder-offset", &["joint", "offset-rad"]),
    ("encoder-nan", &["joint"]),
    ("reply-lost", &["joint", "every"]),
    ("motor-dead", &["motor"]),
    ("torque-sign", &["joint"]),
    ("torque-late", &["cycles"]),
    ("gravity-reversed", &[]),
    ("bump", &["joint", "speed-rad-per-s"]),
    ("payload", &["mass-kg"]),
    ("drives-idle", &["for-s"]),
];
const TRIGGER_KEYS: [&str; 3] = ["at-s", "when", "after-s"];
/// Maximum number of cycles of a delay, and maximum reply interval.
const MAX_CYCLES: u32 = 1000;

/// Error of reading an injection or applying it to an arm.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InjectionError {
    /// Unknown kind.
    #[error("injection `{found}`: no such kind; give one of {}", kind_names())]
    Kind {
        /// Given kind.
        found: String,
    },
    /// A key that the kind does not have, that was given twice, or that has a form other than `key=value`.
    #[error("injection {kind}: key `{key}` {problem}; it takes {}", keys_of(kind))]
    Key {
        /// Kind.
        kind: &'static str,
        /// Key found.
        key: String,
        /// The problem.
        problem: &'static str,
    },
    /// A required key is missing.
    #[error("injection {kind}: key `{key}` is missing; give {key}={must}")]
    Missing {
        /// Kind.
        kind: &'static str,
        /// Key.
        key: &'static str,
        /// Requirement on its value.
        must: &'static str,
    },
    /// A value out of range.
    #[error("injection {kind}: {key} is `{value}`; give {must}")]
    Value {
        /// Kind.
        kind: &'static str,
        /// Key.
        key: &'static str,
        /// Value found.
        value: String,
        /// Requirement on the value.
        must: &'static str,
    },
    /// A joint or motor that the arm does not have.
    #[error("injection {kind}: {key} is {value}, the arm has {joints}; count from 0 to {}", joints - 1)]
    Index {
        /// Kind.
        kind: &'static str,
        /// `joint` or `motor`.
        key: &'static str,
        /// Value found.
        value: usize,
        /// Number of joints of the arm.
        joints: usize,
    },
    /// An arm on a bus does not support the injection.
    #[error("injection {kind} on an emulated bus: {remedy}")]
    NotOnBus {
        /// Kind.
        kind: &'static str,
        /// Alternative.
        remedy: &'static str,
    },
}

fn kind_names() -> String {
    KINDS.map(|(name, _)| name).join(", ")
}

fn keys_of(kind: &str) -> String {
    let own = KINDS.iter().find(|(name, _)| *name == kind);
    let own = own.map_or(&[] as &[&str], |(_, keys)| keys);
    let all: Vec<&str> = own.iter().chain(&TRIGGER_KEYS).copied().collect();
    all.join(", ")
}

/// The keys of one injection with their values.
struct InjectionKeys<'a> {
    kind: &'static str,
    given: Vec<(&'a str, &'a str)>,
}

impl<'a> InjectionKeys<'a> {
    fn read(
        kind: &'static str,
        allowed: &[&str],
        text: &'a str,
    ) -> Result<InjectionKeys<'a>, InjectionError> {
        let mut given: Vec<(&str, &str)> = Vec::new();
        for part in text.split(',').filter(|part| !part.is_empty()) {
            let wrong = |problem| {
                let key = part.split('=').next().unwrap_or(part).to_owned();
                Err(InjectionError::Key { kind, key, problem })
            };
            let Some((key, value)) = part.split_once('=') else {
                return wrong("has no value: write key=value");
            };
            if !allowed.contains(&key) && !TRIGGER_KEYS.contains(&key) {
                return wrong("is not known");
            }
            if given.iter().any(|(other, _)| *other == key) {
                return wrong("is given twice");
            }
            given.push((key, value));
        }
        Ok(InjectionKeys { kind, given })
    }

    fn text(&self, key: &str) -> Option<&'a str> {
        let found = self.given.iter().find(|(name, _)| *name == key);
        found.map(|(_, value)| *value)
    }

    fn value<T: FromStr>(
        &self,
        key: &'static str,
        must: &'static str,
        valid: impl Fn(&T) -> bool,
    ) -> Result<Option<T>, InjectionError> {
        let Some(text) = self.text(key) else {
            return Ok(None);
        };
        match text.parse() {
            Ok(value) if valid(&value) => Ok(Some(value)),
            _ => Err(InjectionError::Value {
                kind: self.kind,
                key,
                value: text.to_owned(),
                must,
            }),
        }
    }

    fn required<T: FromStr>(
        &self,
        key: &'static str,
        must: &'static str,
        valid: impl Fn(&T) -> bool,
    ) -> Result<T, InjectionError> {
        self.value(key, must, valid)?
            .ok_or(InjectionError::Missing {
                kind: self.kind,
                key,
                must,
            })
    }

    fn joint(&self) -> Result<Option<usize>, InjectionError> {
        self.value("joint", INDEX, |_| true)
    }

    fn count(&self, key: &'static str) -> Result<u32, InjectionError> {
        self.required(key, "a whole number from 1 to 1000", |k| {
            (1..=MAX_CYCLES).contains(k)
        })
    }

    fn change(&self, key: &'static str) -> Result<f64, InjectionError> {
        self.required(
            key,
            "a number from -1000 to 1000 other than 0",
            |x: &f64| x.abs() <= 1000.0 && *x != 0.0,
        )
    }

    fn seconds(&self, key: &'static str) -> Result<Option<f64>, InjectionError> {
        self.value(key, "a number of seconds from 0 to 1e6", |x: &f64| {
            (0.0..=1e6).contains(x)
        })
    }

    fn trigger(&self) -> Result<Trigger, InjectionError> {
        let wrong = |key: &str, problem| InjectionError::Key {
            kind: self.kind,
            key: key.to_owned(),
            problem,
        };
        let at_s = self.seconds("at-s")?;
        let after_s = self.seconds("after-s")?;
        match (self.text("when"), at_s, after_s) {
            (None, None, None) => Ok(Trigger::AtStart),
            (None, Some(at_s), None) => Ok(Trigger::Active { at_s }),
            (None, _, Some(_)) => Err(wrong("after-s", "needs when=MODE")),
            (Some(_), Some(_), _) => Err(wrong("at-s", "does not go with when: use after-s")),
            (Some(name), None, after_s) => Ok(Trigger::Mode {
                mode: mode(name).ok_or_else(|| InjectionError::Value {
                    kind: self.kind,
                    key: "when",
                    value: name.to_owned(),
                    must: "one of idle, gravity_hold, move, track, probe, fault, excite, breakaway",
                })?,
                after_s: after_s.unwrap_or(0.0),
            }),
        }
    }
}

const INDEX: &str = "an index, from 0";

fn mode(name: &str) -> Option<Mode> {
    MODES.into_iter().find(|mode| mode.name() == name)
}

impl FromStr for Injection {
    type Err = InjectionError;

    fn from_str(text: &str) -> Result<Injection, InjectionError> {
        let (name, keys) = text.split_once(':').unwrap_or((text, ""));
        let kind = KINDS.iter().find(|(known, _)| *known == name);
        let (kind, allowed) = *kind.ok_or_else(|| InjectionError::Kind {
            found: name.to_owned(),
        })?;
        let keys = InjectionKeys::read(kind, allowed, keys)?;
        let kind = match kind {
            "encoder-stuck" => InjectionKind::EncoderStuck {
                joint: keys.joint()?,
            },
            "motor-encoder-stuck" => InjectionKind::MotorEncoderStuck {
                motor: keys.required("motor", INDEX, |_| true)?,
            },
            "encoder-late" => InjectionKind::EncoderLate {
                joint: keys.joint()?,
                cycles: keys.count("cycles")?,
            },
            "encoder-sign" => InjectionKind::EncoderSign {
                joint: keys.joint()?,
            },
            "encoder-offset" => InjectionKind::EncoderOffset {
                joint: keys.joint()?,
                offset_rad: keys.change("offset-rad")?,
            },
            "encoder-nan" => InjectionKind::EncoderNan {
                joint: keys.joint()?,
            },
            "reply-lost" => InjectionKind::ReplyLost {
                joint: keys.joint()?,
                every: keys.count("every")?,
            },
            "motor-dead" => InjectionKind::MotorDead {
                motor: keys.required("motor", INDEX, |_| true)?,
            },
            "torque-sign" => InjectionKind::TorqueSign {
                joint: keys.required("joint", INDEX, |_| true)?,
            },
            "torque-late" => InjectionKind::TorqueLate {
                cycles: keys.count("cycles")?,
            },
            "gravity-reversed" => InjectionKind::GravityReversed,
            "bump" => InjectionKind::Bump {
                joint: keys.required("joint", INDEX, |_| true)?,
                speed_rad_per_s: keys.change("speed-rad-per-s")?,
            },
            "payload" => InjectionKind::Payload {
                mass_kg: keys.required("mass-kg", "a number from 0.001 to 1000", |x: &f64| {
                    (0.001..=1000.0).contains(x)
                })?,
            },
            _ => InjectionKind::DrivesIdle {
                for_s: keys.seconds("for-s")?,
            },
        };
        Ok(Injection {
            kind,
            trigger: keys.trigger()?,
        })
    }
}

/// Writes the text form, which [`Injection::from_str`] parses to the same injection.
impl fmt::Display for Injection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut keys: Vec<String> = Vec::new();
        if let Some((key, index)) = self.kind.index() {
            keys.push(format!("{key}={index}"));
        }
        match self.kind {
            InjectionKind::EncoderLate { cycles, .. } | InjectionKind::TorqueLate { cycles } => {
                keys.push(format!("cycles={cycles}"));
            }
            InjectionKind::EncoderOffset { offset_rad, .. } => {
                keys.push(format!("offset-rad={offset_rad}"));
            }
            InjectionKind::ReplyLost { every, .. } => keys.push(format!("every={every}")),
            InjectionKind::Bump {
                speed_rad_per_s, ..
            } => keys.push(format!("speed-rad-per-s={speed_rad_per_s}")),
            InjectionKind::Payload { mass_kg } => keys.push(format!("mass-kg={mass_kg}")),
            InjectionKind::DrivesIdle { for_s: Some(for_s) } => keys.push(format!("for-s={for_s}")),
            _ => {}
        }
        match self.trigger {
            Trigger::AtStart => {}
            Trigger::Active { at_s } => keys.push(format!("at-s={at_s}")),
            Trigger::Mode { mode, after_s } => {
                keys.push(format!("when={},after-s={after_s}", mode.name()));
            }
        }
        f.write_str(self.kind.name())?;
        match keys.is_empty() {
            true => Ok(()),
            false => write!(f, ":{}", keys.join(",")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Injection, String> {
        text.parse()
            .map_err(|error: InjectionError| error.to_string())
    }

    #[test]
    fn every_kind_is_written_as_the_text_that_it_was_parsed_from() {
        for text in [
            "encoder-stuck",
            "encoder-stuck:joint=1,when=track,after-s=0.5",
            "encoder-late:joint=2,cycles=20,at-s=1.5",
            "encoder-sign:joint=0",
            "encoder-offset:joint=3,offset-rad=-0.2,when=move,after-s=0",
            "encoder-nan:joint=3",
            "reply-lost:every=2",
            "motor-dead:motor=1,at-s=0",
            "motor-encoder-stuck:motor=1,at-s=0",
            "torque-sign:joint=2",
            "torque-late:cycles=3",
            "gravity-reversed:when=gravity_hold,after-s=1",
            "bump:joint=2,speed-rad-per-s=2.5,at-s=1",
            "payload:mass-kg=1",
            "drives-idle:for-s=0.5,when=track,after-s=1",
        ] {
            assert_eq!(read(text).expect(text).to_string(), text);
        }
    }

    #[test]
    fn help_names_every_kind_and_key_and_its_example_is_valid() {
        for (name, keys) in KINDS {
            assert!(HELP.contains(&format!("\n  {name}")), "{name}");
            assert!(keys.iter().all(|key| HELP.contains(key)), "{name}");
        }
        let example = HELP.rsplit_once("Example: ").expect("an example").1;
        assert!(read(example).is_ok(), "{example}");
    }

    #[test]
    fn errors_name_the_problem_and_a_remedy() {
        for (text, words) in [
            ("encoder-stick", "no such kind; give one of encoder-stuck"),
            (
                "encoder-stuck:joints=1",
                "key `joints` is not known; it takes joint, at-s, when",
            ),
            (
                "bump:joint=1",
                "key `speed-rad-per-s` is missing; give speed-rad-per-s=a number",
            ),
            ("bump:joint=1,joint=2", "key `joint` is given twice"),
            (
                "bump:joint=-1,speed-rad-per-s=1",
                "joint is `-1`; give an index",
            ),
            (
                "bump:joint=1,speed-rad-per-s=nan",
                "speed-rad-per-s is `nan`; give a number",
            ),
            (
                "encoder-late:cycles=0",
                "cycles is `0`; give a whole number from 1",
            ),
            (
                "payload:mass-kg=0",
                "mass-kg is `0`; give a number from 0.001",
            ),
            (
                "payload:mass-kg=1,when=trak",
                "when is `trak`; give one of idle",
            ),
            (
                "payload:mass-kg=1,after-s=1",
                "key `after-s` needs when=MODE",
            ),
            (
                "payload:mass-kg=1,when=move,at-s=1",
                "does not go with when: use after-s",
            ),
            (
                "payload:mass-kg",
                "key `mass-kg` has no value: write key=value",
            ),
            (
                "payload:mass-kg=1,at-s=-1",
                "at-s is `-1`; give a number of seconds",
            ),
        ] {
            let error = read(text).expect_err(text);
            assert!(error.contains(words), "{text}: {error}");
        }
    }

    #[test]
    fn injections_that_a_bus_does_not_support_are_rejected() {
        for text in ["encoder-nan", "drives-idle", "encoder-stuck:when=track"] {
            let injection = read(text).expect(text);
            assert!(injection.check_bus_support().is_err(), "{text}");
        }
        let injection = read("encoder-stuck:joint=1,at-s=2").expect("valid");
        assert_eq!(injection.check_bus_support(), Ok(()));
    }
}
