//! Faults put into a simulated arm on purpose, at its boundary: encoder angles out, torques in, and the load.
//!
//! An [`Injection`] is data, read from a text such as `encoder-stuck:joint=1,when=track,after-s=0.5`
//! ([`HELP`]); an [`Injector`] carries a list of them out on a [`Plant`](crate::Plant). It counts the plant's
//! own cycles, so that a run in virtual time is the same to the bit each time.
//!
//! Joints and motors are counted from 0, as in the names of faults and in logs.

mod injector;
mod parse;

pub use injector::{Injector, Sight};
pub use parse::{HELP, InjectionError};

use supple_core::controller::Mode;

/// What is done to the arm, and when.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Injection {
    /// What.
    pub kind: InjectionKind,
    /// When it begins. It lasts from then on, unless its kind says otherwise.
    pub trigger: Trigger,
}

/// When an injection begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Trigger {
    /// Before the first cycle.
    AtOnce,
    /// This long after the drives were first active \[s\], zero or more.
    Active {
        /// After the first cycle with active drives \[s\].
        at_s: f64,
    },
    /// This long after a mode first began with active drives \[s\], zero or more. The mode is that which each
    /// torque command carries; an arm on a bus is not told.
    Mode {
        /// Which.
        mode: Mode,
        /// After its first cycle \[s\].
        after_s: f64,
    },
}

/// What is done. `joint: None` means every joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InjectionKind {
    /// The encoder keeps the angle that it reported last.
    EncoderStuck {
        /// Which.
        joint: Option<usize>,
    },
    /// The encoder reports angles of so many control cycles ago. The reading stands still until the delay is
    /// reached: it does not jump.
    EncoderLate {
        /// Which.
        joint: Option<usize>,
        /// Control cycles, 1 to 1000.
        cycles: u32,
    },
    /// The encoder counts backwards from where it is.
    EncoderSign {
        /// Which.
        joint: Option<usize>,
    },
    /// The encoder's angle jumps once and stays beside the true one.
    EncoderOffset {
        /// Which.
        joint: Option<usize>,
        /// By how much \[rad\], not zero.
        offset_rad: f64,
    },
    /// The reported angle is not a number.
    EncoderNan {
        /// Which.
        joint: Option<usize>,
    },
    /// One reply in `every` is not sent.
    ReplyLost {
        /// Which; on a bus, which motor's.
        joint: Option<usize>,
        /// 1 for all of them, 2 for every second one, up to 1000.
        every: u32,
    },
    /// A motor makes no torque and does not brake: its circuit is open.
    MotorDead {
        /// Which.
        motor: usize,
    },
    /// The torque on a joint is the opposite of the commanded one.
    TorqueSign {
        /// Which.
        joint: usize,
    },
    /// Torques act so many control cycles later than they do by themselves.
    TorqueLate {
        /// Control cycles, 1 to 1000.
        cycles: u32,
    },
    /// Gravity turns round: an arm that is mounted upside down.
    GravityReversed,
    /// A joint's velocity changes at once.
    Bump {
        /// Which.
        joint: usize,
        /// By how much \[rad/s\], not zero.
        speed_rad_per_s: f64,
    },
    /// A ball is fixed to the tip.
    Payload {
        /// Its mass \[kg\], positive.
        mass_kg: f64,
    },
    /// The drives go to idle and brake by themselves, as when an operator lowers them; afterwards they are
    /// ready again. Only where there is no pendant: not on a bus.
    DrivesIdle {
        /// For how long \[s\]; for good if not given.
        for_s: Option<f64>,
    },
}

impl Injection {
    /// Refuses what an arm on a bus cannot do.
    ///
    /// # Errors
    /// [`InjectionError::NotOnBus`] with what to do in its place.
    pub fn on_bus(&self) -> Result<(), InjectionError> {
        let remedy = match (self.kind, self.trigger) {
            (_, Trigger::Mode { .. }) => {
                "the arm on a bus is not told the mode: give at-s=SECONDS, counted from active drives"
            }
            (InjectionKind::EncoderNan { .. }, _) => {
                "encoder counts are always numbers: use reply-lost:every=1"
            }
            (InjectionKind::DrivesIdle { .. }, _) => "lower the drives at the pendant",
            _ => return Ok(()),
        };
        Err(InjectionError::NotOnBus {
            kind: self.kind.name(),
            remedy,
        })
    }
}

impl InjectionKind {
    /// Its name in texts.
    pub fn name(&self) -> &'static str {
        match self {
            InjectionKind::EncoderStuck { .. } => "encoder-stuck",
            InjectionKind::EncoderLate { .. } => "encoder-late",
            InjectionKind::EncoderSign { .. } => "encoder-sign",
            InjectionKind::EncoderOffset { .. } => "encoder-offset",
            InjectionKind::EncoderNan { .. } => "encoder-nan",
            InjectionKind::ReplyLost { .. } => "reply-lost",
            InjectionKind::MotorDead { .. } => "motor-dead",
            InjectionKind::TorqueSign { .. } => "torque-sign",
            InjectionKind::TorqueLate { .. } => "torque-late",
            InjectionKind::GravityReversed => "gravity-reversed",
            InjectionKind::Bump { .. } => "bump",
            InjectionKind::Payload { .. } => "payload",
            InjectionKind::DrivesIdle { .. } => "drives-idle",
        }
    }

    /// The joint or motor that it names, with the key that names it.
    fn index(&self) -> Option<(&'static str, usize)> {
        match *self {
            InjectionKind::EncoderStuck { joint }
            | InjectionKind::EncoderLate { joint, .. }
            | InjectionKind::EncoderSign { joint }
            | InjectionKind::EncoderOffset { joint, .. }
            | InjectionKind::EncoderNan { joint }
            | InjectionKind::ReplyLost { joint, .. } => joint.map(|joint| ("joint", joint)),
            InjectionKind::TorqueSign { joint } | InjectionKind::Bump { joint, .. } => {
                Some(("joint", joint))
            }
            InjectionKind::MotorDead { motor } => Some(("motor", motor)),
            InjectionKind::TorqueLate { .. }
            | InjectionKind::GravityReversed
            | InjectionKind::Payload { .. }
            | InjectionKind::DrivesIdle { .. } => None,
        }
    }
}
