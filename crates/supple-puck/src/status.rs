//! Values of the properties STAT, MODE and ROLE: the state, the mode and the type of a puck. Source: libbarrett,
//! btclient.

use crate::property::PuckKind;
use core::fmt;

/// Error: the value of an enumerated property is not allowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnknownValue {
    /// Property.
    pub property: &'static str,
    /// Value found.
    pub value: i32,
    /// Allowed values.
    pub expected: &'static str,
}

impl fmt::Display for UnknownValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let UnknownValue {
            property,
            value,
            expected,
        } = self;
        write!(f, "{property} is {value}, expected {expected}")
    }
}

impl core::error::Error for UnknownValue {}

/// State of a puck: [`Property::STAT`](crate::Property::STAT).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stat {
    /// Only the monitor (boot program) runs; the puck waits for a wake-up. Writing this value restarts the puck.
    Reset = 0,
    /// The puck has an error.
    Error = 1,
    /// The firmware runs. Writing this value wakes the puck.
    Ready = 2,
}

impl Stat {
    /// Converts the property's value.
    ///
    /// # Errors
    /// [`UnknownValue`] for a value other than 0, 1 or 2.
    pub const fn from_value(value: i32) -> Result<Stat, UnknownValue> {
        match value {
            0 => Ok(Stat::Reset),
            1 => Ok(Stat::Error),
            2 => Ok(Stat::Ready),
            _ => Err(UnknownValue {
                property: "STAT",
                value,
                expected: "0 (reset), 1 (error) or 2 (ready)",
            }),
        }
    }

    /// The property's value.
    pub const fn value(self) -> i16 {
        self as i16
    }
}

/// [`Property::MODE`](crate::Property::MODE) of a motor puck. The host sets `Idle`; the
/// safety module sets torque mode when the operator activates the arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MotorMode {
    /// The windings are shorted: the motor brakes and ignores torque commands; the encoder still works.
    Idle = 0,
    /// Control of the duty cycle.
    Duty = 1,
    /// Control of the torque.
    Torque = 2,
    /// Position control by the puck's PID.
    Pid = 3,
    /// Control of the velocity.
    Velocity = 4,
    /// Motion with a trapezoidal velocity profile.
    Trapezoidal = 5,
}

impl MotorMode {
    /// Converts the property's value.
    ///
    /// # Errors
    /// [`UnknownValue`] for a value other than 0 to 5.
    pub const fn from_value(value: i32) -> Result<MotorMode, UnknownValue> {
        match value {
            0 => Ok(MotorMode::Idle),
            1 => Ok(MotorMode::Duty),
            2 => Ok(MotorMode::Torque),
            3 => Ok(MotorMode::Pid),
            4 => Ok(MotorMode::Velocity),
            5 => Ok(MotorMode::Trapezoidal),
            _ => Err(UnknownValue {
                property: "MODE of a motor puck",
                value,
                expected: "0 to 5",
            }),
        }
    }

    /// The property's value.
    pub const fn value(self) -> i16 {
        self as i16
    }
}

/// Type and options of a puck: the low 16 bits of [`Property::ROLE`](crate::Property::ROLE).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Role(pub u16);

/// The low five bits of a [`Role`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RoleType {
    /// Motor of the arm; `Tater` is Barrett's name.
    Tater,
    /// Gimbals.
    Gimbals,
    /// Safety module.
    Safety,
    /// Wraptor.
    Wraptor,
    /// Trigger.
    Trigger,
    /// Motor of the hand.
    BarrettHand,
    /// Force/torque sensor.
    Force,
}

impl Role {
    const TYPE_MASK: u16 = 0x1f;
    /// A WAM's motor puck: magnetic encoder on the serial port.
    pub const ARM_MOTOR: Role = Role(0x0100);
    /// Motor of the arm with a joint encoder.
    pub const ARM_MOTOR_WITH_JOINT_ENCODER: Role = Role(0x4100);
    /// Safety module.
    pub const SAFETY: Role = Role(0x0002);
    /// Force/torque sensor.
    pub const FORCE: Role = Role(0x0006);

    /// Converts the property's value, whose sign is ignored.
    pub const fn from_value(value: i32) -> Role {
        Role(value as u16)
    }

    /// Type.
    ///
    /// # Errors
    /// [`UnknownValue`] for a type above 6.
    pub const fn role_type(self) -> Result<RoleType, UnknownValue> {
        match self.0 & Role::TYPE_MASK {
            0 => Ok(RoleType::Tater),
            1 => Ok(RoleType::Gimbals),
            2 => Ok(RoleType::Safety),
            3 => Ok(RoleType::Wraptor),
            4 => Ok(RoleType::Trigger),
            5 => Ok(RoleType::BarrettHand),
            6 => Ok(RoleType::Force),
            other => Err(UnknownValue {
                property: "type in ROLE",
                value: other as i32,
                expected: "0 to 6",
            }),
        }
    }

    /// Returns the family of property lists that the puck uses; `None` if it is unknown. libbarrett uses the motor's lists for
    /// taters, wraptors and hands.
    pub const fn kind(self) -> Option<PuckKind> {
        match self.role_type() {
            Ok(RoleType::Tater | RoleType::Wraptor | RoleType::BarrettHand) => {
                Some(PuckKind::Motor)
            }
            Ok(RoleType::Safety) => Some(PuckKind::Safety),
            Ok(RoleType::Force) => Some(PuckKind::ForceTorque),
            Ok(RoleType::Gimbals | RoleType::Trigger) | Err(_) => None,
        }
    }

    const fn has(self, bit: u16) -> bool {
        self.0 & bit != 0
    }

    /// Temperature sensor select bit.
    pub const fn temperature_select(self) -> bool {
        self.has(0x0040)
    }

    /// Whether the processor runs at 20 MHz instead of 32 MHz.
    pub const fn clock_20_mhz(self) -> bool {
        self.has(0x0080)
    }

    /// Absolute magnetic encoder on the serial port.
    pub const fn magnetic_encoder_serial(self) -> bool {
        self.has(0x0100)
    }

    /// Magnetic encoder on the hall port.
    pub const fn magnetic_encoder_hall(self) -> bool {
        self.has(0x0200)
    }

    /// Magnetic encoder on the encoder port.
    pub const fn magnetic_encoder(self) -> bool {
        self.has(0x0400)
    }

    /// Strain gauge.
    pub const fn strain(self) -> bool {
        self.has(0x0800)
    }

    /// Tactile sensor.
    pub const fn tactile(self) -> bool {
        self.has(0x1000)
    }

    /// Inertial sensor.
    pub const fn imu(self) -> bool {
        self.has(0x2000)
    }

    /// Optical joint encoder: position replies have six bytes.
    pub const fn joint_encoder(self) -> bool {
        self.has(0x4000)
    }
}
