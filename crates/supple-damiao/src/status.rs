//! Status of a motor: four bits of every feedback, which report whether the motor applies torque, or the reason why not.

use core::fmt;

/// Status of a motor. A motor applies torque only in [`Status::Enabled`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// 0: disabled.
    Disabled,
    /// 1: enabled.
    Enabled,
    /// 8: supply above its limit.
    OverVoltage,
    /// 9: supply below its limit.
    UnderVoltage,
    /// A: too much current.
    OverCurrent,
    /// B: the amplifier is too hot.
    MosfetHot,
    /// C: the winding is too hot.
    WindingHot,
    /// D: no frame within the motor's watchdog.
    CommunicationLost,
    /// E: overload.
    Overload,
    /// Another code, 2 to 7 or 15.
    Unknown(u8),
}

impl Status {
    /// All known errors.
    pub const ERRORS: [Status; 7] = [
        Status::OverVoltage,
        Status::UnderVoltage,
        Status::OverCurrent,
        Status::MosfetHot,
        Status::WindingHot,
        Status::CommunicationLost,
        Status::Overload,
    ];

    /// Converts the low four bits of a code.
    pub const fn from_code(code: u8) -> Status {
        match code & 0xF {
            0 => Status::Disabled,
            1 => Status::Enabled,
            8 => Status::OverVoltage,
            9 => Status::UnderVoltage,
            0xA => Status::OverCurrent,
            0xB => Status::MosfetHot,
            0xC => Status::WindingHot,
            0xD => Status::CommunicationLost,
            0xE => Status::Overload,
            other => Status::Unknown(other),
        }
    }

    /// Code, 0 to 15.
    pub const fn code(self) -> u8 {
        match self {
            Status::Disabled => 0,
            Status::Enabled => 1,
            Status::OverVoltage => 8,
            Status::UnderVoltage => 9,
            Status::OverCurrent => 0xA,
            Status::MosfetHot => 0xB,
            Status::WindingHot => 0xC,
            Status::CommunicationLost => 0xD,
            Status::Overload => 0xE,
            Status::Unknown(code) => code & 0xF,
        }
    }

    /// Whether the status is an error: neither enabled nor disabled.
    pub const fn is_error(self) -> bool {
        !matches!(self, Status::Enabled | Status::Disabled)
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = match self {
            Status::Disabled => "disabled",
            Status::Enabled => "enabled",
            Status::OverVoltage => "supply voltage too high",
            Status::UnderVoltage => "supply voltage too low",
            Status::OverCurrent => "current too high",
            Status::MosfetHot => "amplifier too hot",
            Status::WindingHot => "winding too hot",
            Status::CommunicationLost => "no frame within the motor's watchdog",
            Status::Overload => "overload",
            Status::Unknown(code) => return write!(f, "unknown error code {code}"),
        };
        f.write_str(text)
    }
}
