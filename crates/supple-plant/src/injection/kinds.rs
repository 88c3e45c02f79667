//! An injected fault: its kind and its trigger.

use supple_core::controller::Mode;

/// A fault and its trigger.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Injection {
    /// Kind of the fault.
    pub kind: InjectionKind,
    /// Start of the fault. It lasts until the end, unless its kind states otherwise.
    pub trigger: Trigger,
}

/// Start of an injection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Trigger {
    /// Before the first cycle.
    AtStart,
    /// A time after the drives were first active.
    Active {
        /// Time after the first cycle with active drives \[s\], zero or more.
        at_s: f64,
    },
    /// A time after a mode first began with active drives. The mode comes from the torque commands; an arm on a bus
    /// does not receive it.
    Mode {
        /// Mode of the controller.
        mode: Mode,
        /// Time after its first cycle \[s\], zero or more.
        after_s: f64,
    },
}

/// Kind of an injected fault. `joint: None` means every joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InjectionKind {
    /// The encoder repeats its last angle.
    EncoderStuck {
        /// Index of the joint.
        joint: Option<usize>,
    },
    /// The encoder of a motor repeats its last angle: with a coupled transmission the angles of several joints are wrong.
    MotorEncoderStuck {
        /// Index of the motor.
        motor: usize,
    },
    /// The encoder readings lag by this many control cycles. The reading is frozen until the delay has built up, so
    /// it does not jump.
    EncoderLate {
        /// Index of the joint.
        joint: Option<usize>,
        /// Control cycles, 1 to 1000.
        cycles: u32,
    },
    /// The encoder counts backwards from its current angle.
    EncoderSign {
        /// Index of the joint.
        joint: Option<usize>,
    },
    /// The encoder reading jumps once and keeps this offset.
    EncoderOffset {
        /// Index of the joint.
        joint: Option<usize>,
        /// Offset \[rad\], not zero.
        offset_rad: f64,
    },
    /// The reported angle is not a number.
    EncoderNan {
        /// Index of the joint.
        joint: Option<usize>,
    },
    /// One reply in `every` is not sent.
    ReplyLost {
        /// Index of the joint; on a bus, of the motor.
        joint: Option<usize>,
        /// 1 for every reply, 2 for every second one, up to 1000.
        every: u32,
    },
    /// A motor produces no torque and does not brake: its circuit is open.
    MotorDead {
        /// Index of the motor.
        motor: usize,
    },
    /// The torque on a joint is the opposite of the commanded one.
    TorqueSign {
        /// Index of the joint.
        joint: usize,
    },
    /// Torques are delayed by this many additional control cycles.
    TorqueLate {
        /// Control cycles, 1 to 1000.
        cycles: u32,
    },
    /// Gravity is reversed, as for an arm that is mounted upside down.
    GravityReversed,
    /// The velocity of a joint changes by a step.
    Bump {
        /// Index of the joint.
        joint: usize,
        /// Change \[rad/s\], not zero.
        speed_rad_per_s: f64,
    },
    /// A ball is fixed to the tip.
    Payload {
        /// Its mass \[kg\], positive.
        mass_kg: f64,
    },
    /// The drives go to idle (braking) as if an operator had disabled them, and can be enabled again afterwards. Not
    /// available on a bus, which has a pendant.
    DrivesIdle {
        /// Duration \[s\]; permanent if not given.
        for_s: Option<f64>,
    },
}

impl InjectionKind {
    /// Returns the name of the kind in text form.
    pub fn name(&self) -> &'static str {
        match self {
            InjectionKind::EncoderStuck { .. } => "encoder-stuck",
            InjectionKind::MotorEncoderStuck { .. } => "motor-encoder-stuck",
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

    /// Returns the joint or motor that the fault affects, with its key in text form.
    pub(super) fn index(&self) -> Option<(&'static str, usize)> {
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
            InjectionKind::MotorDead { motor } | InjectionKind::MotorEncoderStuck { motor } => {
                Some(("motor", motor))
            }
            InjectionKind::TorqueLate { .. }
            | InjectionKind::GravityReversed
            | InjectionKind::Payload { .. }
            | InjectionKind::DrivesIdle { .. } => None,
        }
    }
}
