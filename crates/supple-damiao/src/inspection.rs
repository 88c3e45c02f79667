//! Checks at start-up: compares the registers of a motor with the values that the arm's TOML expects.
//!
//! [`RegisterReadings`] collects the replies to [`TO_READ`]; [`Expectation::check`] returns the motor's ranges and the
//! registers to write, or the first [`Refusal`] with register, found value, expected value and remedy. Start-up sets mode
//! and watchdog in RAM every time; only the operator changes other registers.

use crate::firmware::Firmware;
use crate::ranges::Ranges;
use crate::refusal::{Problem, Refusal};
use crate::register::{Register, Value};

/// Registers that start-up reads, in this order.
pub const TO_READ: [Register; 14] = [
    Register::ID,
    Register::REPLY_ID,
    Register::FIRMWARE,
    Register::GEAR_RATIO,
    Register::POSITION_RANGE,
    Register::VELOCITY_RANGE,
    Register::TORQUE_RANGE,
    Register::MODE,
    Register::TIMEOUT,
    Register::TORQUE_CONSTANT,
    Register::POLE_PAIRS,
    Register::FLUX,
    Register::SERIAL,
    Register::SHAFT_POSITION,
];
/// Value of [`Register::MODE`] for impedance mode.
pub const MIT_MODE: u32 = 1;
/// Units of [`Register::TIMEOUT`] \[s\].
pub const TIMEOUT_UNIT_S: f64 = 50e-6;
/// Tolerance of the gear ratio for rounding and calibration: a calibrated motor of ratio 10 may report 10.01.
const GEAR_TOLERANCE: f64 = 0.02;
/// Tolerance of a range for rounding.
const RANGE_TOLERANCE: f64 = 1e-4;
/// Maximum difference between the position in a feedback and in [`Register::SHAFT_POSITION`] \[rad\].
const POSITION_TOLERANCE_RAD: f64 = 0.01;

/// Registers that determine the torque constant of a motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorqueRegisters {
    /// [`Register::TORQUE_CONSTANT`], zero if it follows from the others \[N m/A\].
    pub kt_nm_per_a: f64,
    /// [`Register::POLE_PAIRS`].
    pub pole_pairs: u32,
    /// [`Register::FLUX`] \[Wb\].
    pub flux_wb: f64,
    /// [`Register::GEAR_RATIO`].
    pub gear_ratio: f64,
}

impl TorqueRegisters {
    /// Returns the torque of the shaft over the current \[N m/A\]: [`Register::TORQUE_CONSTANT`], or `3/2 p flux ratio` if that
    /// register is zero.
    pub fn torque_constant_nm_per_a(&self) -> f64 {
        match self.kt_nm_per_a > 0.0 {
            true => self.kt_nm_per_a,
            false => 1.5 * f64::from(self.pole_pairs) * self.flux_wb * self.gear_ratio,
        }
    }
}

/// Replies to [`TO_READ`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RegisterReadings([Option<[u8; 4]>; TO_READ.len()]);

impl RegisterReadings {
    /// Creates the collection without replies.
    pub const fn new() -> RegisterReadings {
        RegisterReadings([None; TO_READ.len()])
    }

    /// Adds a reply; ignores registers that are not in [`TO_READ`].
    pub fn insert(&mut self, register: Register, bytes: [u8; 4]) {
        if let Some(at) = TO_READ.iter().position(|known| *known == register) {
            self.0[at] = Some(bytes);
        }
    }

    /// Returns the value of a register, if it was read.
    pub fn get(&self, register: Register) -> Option<Value> {
        let at = TO_READ.iter().position(|known| *known == register)?;
        let kind = register.info()?.kind;
        self.0[at].map(|bytes| Value::from_bytes(kind, bytes))
    }

    /// Returns the registers that determine the torque constant; `None` if they were not read.
    pub fn torque_registers(&self) -> Option<TorqueRegisters> {
        Some(TorqueRegisters {
            kt_nm_per_a: self.float(Register::TORQUE_CONSTANT).ok()?,
            pole_pairs: self.integer(Register::POLE_PAIRS).ok()?,
            flux_wb: self.float(Register::FLUX).ok()?,
            gear_ratio: self.float(Register::GEAR_RATIO).ok()?,
        })
    }

    fn integer(&self, register: Register) -> Result<u32, Problem> {
        match self.get(register) {
            Some(Value::Integer(value)) => Ok(value),
            _ => Err(Problem::RegisterNotRead(register)),
        }
    }

    fn float(&self, register: Register) -> Result<f64, Problem> {
        match self.get(register) {
            Some(Value::Float(value)) => Ok(f64::from(value)),
            _ => Err(Problem::RegisterNotRead(register)),
        }
    }
}

/// Values that the arm's TOML expects of one motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expectation<'a> {
    /// Id of the frames to the motor.
    pub id: u8,
    /// Id of the motor's replies.
    pub reply_id: u16,
    /// Gear ratio.
    pub gear_ratio: f64,
    /// PMAX \[rad\].
    pub position_range_rad: f64,
    /// VMAX \[rad/s\].
    pub velocity_range_rad_per_s: f64,
    /// TMAX \[N m\].
    pub torque_range_nm: f64,
    /// First digits of the firmware version; `None` accepts every known series.
    pub firmware_series: Option<&'a str>,
    /// Watchdog time: time without a command after which the motor disables itself \[s\].
    pub watchdog_s: f64,
    /// Whether the motor may lack a watchdog.
    pub without_watchdog: bool,
    /// Whether the bus carries FD frames.
    pub fd: bool,
}

/// A motor that matches the expectation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InspectedMotor {
    /// Ranges of position, velocity and torque.
    pub ranges: Ranges,
    /// Firmware version.
    pub firmware: Firmware,
    /// Whether start-up must write the mode.
    pub write_mode: bool,
    /// Value of [`Register::TIMEOUT`] that start-up must write; `None` if the register already has it.
    pub write_timeout: Option<u32>,
}

impl Expectation<'_> {
    /// Returns the value of [`Register::TIMEOUT`] for the watchdog time, at least 1.
    pub fn timeout(&self) -> u32 {
        ((self.watchdog_s / TIMEOUT_UNIT_S + 0.5) as u32).max(1)
    }

    /// Compares all readings with the expectation. `feedback_rad` is the position in the motor's last feedback \[rad\], decoded
    /// with the range that the motor reported; `None` skips the comparison of positions.
    ///
    /// # Errors
    /// The first [`Refusal`], in the order of [`TO_READ`].
    pub fn check(
        &self,
        readings: &RegisterReadings,
        feedback_rad: Option<f64>,
    ) -> Result<InspectedMotor, Refusal> {
        self.compare(readings, feedback_rad)
            .map_err(|problem| self.refuse(problem))
    }

    /// Creates a refusal of this motor.
    pub fn refuse(&self, problem: Problem) -> Refusal {
        Refusal {
            motor: self.id,
            problem,
        }
    }

    /// Checks the mode or the watchdog register after start-up has written it and read it back.
    ///
    /// # Errors
    /// [`Problem::WriteIgnored`] if the value differs, except for the watchdog of a motor that may lack one.
    pub fn check_written(
        &self,
        register: Register,
        expected: u32,
        found: u32,
    ) -> Result<(), Refusal> {
        let allowed = register == Register::TIMEOUT && self.without_watchdog;
        if found == expected || allowed {
            return Ok(());
        }
        Err(self.refuse(Problem::WriteIgnored {
            register,
            found,
            expected,
        }))
    }

    fn compare(
        &self,
        readings: &RegisterReadings,
        feedback_rad: Option<f64>,
    ) -> Result<InspectedMotor, Problem> {
        for (register, expected) in [
            (Register::ID, u32::from(self.id)),
            (Register::REPLY_ID, u32::from(self.reply_id)),
        ] {
            let found = readings.integer(register)?;
            if found != expected {
                return Err(Problem::IntegerMismatch {
                    register,
                    found,
                    expected,
                });
            }
        }
        let firmware = self.firmware(readings)?;
        for (register, expected, tolerance) in [
            (Register::GEAR_RATIO, self.gear_ratio, GEAR_TOLERANCE),
            (
                Register::POSITION_RANGE,
                self.position_range_rad,
                RANGE_TOLERANCE,
            ),
            (
                Register::VELOCITY_RANGE,
                self.velocity_range_rad_per_s,
                RANGE_TOLERANCE,
            ),
            (
                Register::TORQUE_RANGE,
                self.torque_range_nm,
                RANGE_TOLERANCE,
            ),
        ] {
            let found = readings.float(register)?;
            let close = (found - expected).abs() <= tolerance * expected;
            if !close {
                return Err(Problem::NumberMismatch {
                    register,
                    found,
                    expected,
                });
            }
        }
        let range = |register| readings.float(register);
        let ranges = Ranges::new(
            range(Register::POSITION_RANGE)?,
            range(Register::VELOCITY_RANGE)?,
            range(Register::TORQUE_RANGE)?,
        )
        .map_err(|error| Problem::NumberMismatch {
            register: Register::POSITION_RANGE,
            found: error.found,
            expected: self.position_range_rad,
        })?;
        let mode = readings.integer(Register::MODE)?;
        let timeout = readings.integer(Register::TIMEOUT)?;
        let register_rad = readings.float(Register::SHAFT_POSITION)?;
        if let Some(feedback_rad) = feedback_rad {
            let close = (feedback_rad - register_rad).abs() <= POSITION_TOLERANCE_RAD;
            if !close {
                return Err(Problem::PositionMismatch {
                    feedback_rad,
                    register_rad,
                });
            }
        }
        Ok(InspectedMotor {
            ranges,
            firmware,
            write_mode: mode != MIT_MODE,
            write_timeout: (timeout != self.timeout()).then(|| self.timeout()),
        })
    }

    fn firmware(&self, readings: &RegisterReadings) -> Result<Firmware, Problem> {
        let Some(Value::Text(text)) = readings.get(Register::FIRMWARE) else {
            return Err(Problem::RegisterNotRead(Register::FIRMWARE));
        };
        let firmware = Firmware::parse(text).map_err(Problem::UnsupportedFirmware)?;
        firmware
            .check(self.fd)
            .map_err(Problem::UnsupportedFirmware)?;
        if let Some(series) = self.firmware_series
            && !text.starts_with(series.as_bytes())
        {
            let mut expected = [b'?'; 2];
            for (to, from) in expected.iter_mut().zip(series.bytes()) {
                *to = from;
            }
            return Err(Problem::FirmwareSeriesMismatch {
                found: firmware,
                expected,
            });
        }
        Ok(firmware)
    }
}
