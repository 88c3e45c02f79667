//! What a start-up compares: registers of a motor against what the arm's file expects.
//!
//! [`Readings`] collects the replies to [`TO_READ`]; [`Expectation::check`] gives the motor's ranges and the registers
//! to write, or the first [`Refusal`] with register, found, expected and remedy. Mode and watchdog are set at every
//! start, in RAM; all else is the operator's to change.

use crate::firmware::Firmware;
use crate::ranges::Ranges;
use crate::refusal::{Problem, Refusal};
use crate::register::{Register, Value};

/// Registers that a start-up reads, in this order.
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
/// Impedance mode in [`Register::MODE`].
pub const MIT_MODE: u32 = 1;
/// Units of [`Register::TIMEOUT`] \[s\].
pub const TIMEOUT_UNIT_S: f64 = 50e-6;
/// Difference of a gear ratio that is rounding or calibration: a calibrated motor of ratio 10 reads 10.01.
const GEAR_TOLERANCE: f64 = 0.02;
/// Difference of a range that is rounding.
const RANGE_TOLERANCE: f64 = 1e-4;
/// Greatest distance between the position in a feedback and in [`Register::SHAFT_POSITION`] \[rad\].
const POSITION_TOLERANCE_RAD: f64 = 0.01;

/// Replies to [`TO_READ`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Readings([Option<[u8; 4]>; TO_READ.len()]);

impl Readings {
    /// Nothing read.
    pub const fn new() -> Readings {
        Readings([None; TO_READ.len()])
    }

    /// Notes a reply; registers that are not in [`TO_READ`] are ignored.
    pub fn note(&mut self, register: Register, bytes: [u8; 4]) {
        if let Some(at) = TO_READ.iter().position(|known| *known == register) {
            self.0[at] = Some(bytes);
        }
    }

    /// Value of a register, if it was read.
    pub fn get(&self, register: Register) -> Option<Value> {
        let at = TO_READ.iter().position(|known| *known == register)?;
        let kind = register.info()?.kind;
        self.0[at].map(|bytes| Value::from_bytes(kind, bytes))
    }

    fn integer(&self, register: Register) -> Result<u32, Problem> {
        match self.get(register) {
            Some(Value::Integer(value)) => Ok(value),
            _ => Err(Problem::NotRead(register)),
        }
    }

    fn float(&self, register: Register) -> Result<f64, Problem> {
        match self.get(register) {
            Some(Value::Float(value)) => Ok(f64::from(value)),
            _ => Err(Problem::NotRead(register)),
        }
    }
}

/// What the arm's file states of one motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expectation<'a> {
    /// Id that it listens to.
    pub id: u8,
    /// Id of its replies.
    pub reply_id: u16,
    /// Gear ratio.
    pub gear_ratio: f64,
    /// PMAX \[rad\].
    pub position_range_rad: f64,
    /// VMAX \[rad/s\].
    pub velocity_range_rad_per_s: f64,
    /// TMAX \[N m\].
    pub torque_range_nm: f64,
    /// Beginning of the firmware version; `None` for any known series.
    pub firmware_series: Option<&'a str>,
    /// Silence of the host after which the motor disables itself \[s\].
    pub watchdog_s: f64,
    /// Whether the motor may lack a watchdog.
    pub without_watchdog: bool,
    /// Whether the bus carries FD frames.
    pub fd: bool,
}

/// A motor that fits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inspected {
    /// Its ranges.
    pub ranges: Ranges,
    /// Its firmware.
    pub firmware: Firmware,
    /// Whether its mode is to be written.
    pub write_mode: bool,
    /// Value of [`Register::TIMEOUT`] to write; `None` if it has it already.
    pub write_timeout: Option<u32>,
}

impl Expectation<'_> {
    /// Value of [`Register::TIMEOUT`] for the watchdog, at least 1.
    pub fn timeout(&self) -> u32 {
        ((self.watchdog_s / TIMEOUT_UNIT_S + 0.5) as u32).max(1)
    }

    /// Compares everything that was read. `feedback_rad` is the motor's position by its last feedback \[rad\], decoded
    /// with its own range; `None` to skip that comparison.
    ///
    /// # Errors
    /// The first [`Refusal`], in the order of [`TO_READ`].
    pub fn check(
        &self,
        readings: &Readings,
        feedback_rad: Option<f64>,
    ) -> Result<Inspected, Refusal> {
        self.compare(readings, feedback_rad)
            .map_err(|problem| self.refuse(problem))
    }

    /// A refusal of this motor.
    pub fn refuse(&self, problem: Problem) -> Refusal {
        Refusal {
            motor: self.id,
            problem,
        }
    }

    /// Checks the mode or the watchdog after it was written and read back.
    ///
    /// # Errors
    /// [`Problem::NotWritten`]; not for the watchdog of a motor that may lack one.
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
        Err(self.refuse(Problem::NotWritten {
            register,
            found,
            expected,
        }))
    }

    fn compare(
        &self,
        readings: &Readings,
        feedback_rad: Option<f64>,
    ) -> Result<Inspected, Problem> {
        for (register, expected) in [
            (Register::ID, u32::from(self.id)),
            (Register::REPLY_ID, u32::from(self.reply_id)),
        ] {
            let found = readings.integer(register)?;
            if found != expected {
                return Err(Problem::Integer {
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
                return Err(Problem::Number {
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
        .map_err(|error| Problem::Number {
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
                return Err(Problem::Position {
                    feedback_rad,
                    register_rad,
                });
            }
        }
        Ok(Inspected {
            ranges,
            firmware,
            write_mode: mode != MIT_MODE,
            write_timeout: (timeout != self.timeout()).then(|| self.timeout()),
        })
    }

    fn firmware(&self, readings: &Readings) -> Result<Firmware, Problem> {
        let Some(Value::Text(text)) = readings.get(Register::FIRMWARE) else {
            return Err(Problem::NotRead(Register::FIRMWARE));
        };
        let firmware = Firmware::parse(text).map_err(Problem::Firmware)?;
        firmware.check(self.fd).map_err(Problem::Firmware)?;
        if let Some(series) = self.firmware_series
            && !text.starts_with(series.as_bytes())
        {
            let mut expected = [b'?'; 2];
            for (to, from) in expected.iter_mut().zip(series.bytes()) {
                *to = from;
            }
            return Err(Problem::Series {
                found: firmware,
                expected,
            });
        }
        Ok(firmware)
    }
}
