//! Firmware versions: register 14, two digits of series and two of version.

use core::fmt;

/// A firmware version, as in "5017".
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Firmware {
    /// Series: type of motor and board.
    pub series: u8,
    /// Version within the series.
    pub version: u8,
}

/// Series with documented behaviour, of the motor types 4310, 4340, 6006, 8006, 8009 and 3507, and of the boards of 2025.
pub const KNOWN_SERIES: [u8; 16] = [
    31, 32, 33, 34, 50, 51, 57, 60, 61, 62, 63, 64, 65, 70, 71, 73,
];
/// First version with registers, the 8-bit id filter and a watchdog that runs only while the motor is enabled. Start-up
/// reads the version from register 14 and refuses an older one.
pub const MIN_VERSION: u8 = 13;
/// First version with CAN FD.
pub const FD_VERSION: u8 = 15;
/// First version that answers register reads between the cyclic commands with unambiguous replies.
pub const REGISTERS_IN_OPERATION_VERSION: u8 = 17;
/// Version for four motors on one board, in which a write to register 80 saves the present position as the zero.
pub const FOUR_MOTORS_VERSION: u8 = 41;

/// Reason why a firmware is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FirmwareError {
    /// The version does not consist of four digits.
    NotDigits([u8; 4]),
    /// The series is not known.
    Series(u8),
    /// The firmware is older than version 13.
    TooOld(Firmware),
    /// The firmware is for four motors on one board.
    FourMotors(Firmware),
    /// The firmware is too old for CAN FD.
    NoFd(Firmware),
}

impl fmt::Display for Firmware {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:02}{:02}", self.series, self.version)
    }
}

impl fmt::Display for FirmwareError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FirmwareError::NotDigits(found) => {
                write!(f, "{found:02x?} is not four digits")
            }
            FirmwareError::Series(found) => write!(f, "series {found} is not known"),
            FirmwareError::TooOld(found) => {
                write!(f, "{found} is older than version {MIN_VERSION}")
            }
            FirmwareError::FourMotors(found) => write!(
                f,
                "{found} is for four motors on one board, on which a register write can move the zero position"
            ),
            FirmwareError::NoFd(found) => {
                write!(
                    f,
                    "{found} has no CAN FD, which requires version {FD_VERSION} or later"
                )
            }
        }
    }
}

impl core::error::Error for FirmwareError {}

impl Firmware {
    /// Parses a version of four ASCII digits.
    ///
    /// # Errors
    /// [`FirmwareError::NotDigits`] if the text is not four digits.
    pub fn parse(text: [u8; 4]) -> Result<Firmware, FirmwareError> {
        if !text.iter().all(u8::is_ascii_digit) {
            return Err(FirmwareError::NotDigits(text));
        }
        let [a, b, c, d] = text.map(|digit| digit - b'0');
        Ok(Firmware {
            series: a * 10 + b,
            version: c * 10 + d,
        })
    }

    /// Checks that this firmware is supported for the motors of an arm, on CAN FD if `fd`.
    ///
    /// # Errors
    /// [`FirmwareError`] with the reason.
    pub fn check(self, fd: bool) -> Result<(), FirmwareError> {
        if !KNOWN_SERIES.contains(&self.series) {
            return Err(FirmwareError::Series(self.series));
        }
        if self.version == FOUR_MOTORS_VERSION {
            return Err(FirmwareError::FourMotors(self));
        }
        if self.version < MIN_VERSION {
            return Err(FirmwareError::TooOld(self));
        }
        if fd && self.version < FD_VERSION {
            return Err(FirmwareError::NoFd(self));
        }
        Ok(())
    }

    /// Whether a host may read registers between the cyclic commands.
    pub fn reads_registers_in_operation(self) -> bool {
        self.version >= REGISTERS_IN_OPERATION_VERSION
    }
}
