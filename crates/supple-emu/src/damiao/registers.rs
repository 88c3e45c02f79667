//! One bank of motor registers; a motor has one bank in RAM and one in flash.

use super::config::MotorConfig;
use supple_damiao::register::REGISTERS;
use supple_damiao::{Ranges, Register, Value};

/// Number of registers.
const COUNT: usize = 128;
/// Values of can_br for classic frames at 1 Mbit/s and for FD frames at 5 Mbit/s.
const BIT_RATES: [u32; 2] = [4, 9];

/// All registers, four bytes each; a register that the firmware does not have is zero.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Registers([[u8; 4]; COUNT]);

impl Registers {
    /// Returns the registers of a configured motor. Ids, timeout, ranges, gear ratio, pole pairs, flux and bit rates are taken from
    /// `config`, all other registers from the maker's parameter file for a DM4310.
    pub fn new(config: &MotorConfig) -> Registers {
        let mut registers = Registers([[0; 4]; COUNT]);
        let float = |value: f64| Value::Float(value as f32);
        for (register, value) in [
            (Register::UNDER_VOLTAGE, float(15.0)),
            (Register::OVER_TEMPERATURE, float(100.0)),
            (Register::OVER_CURRENT, float(0.8)),
            (Register::ACCELERATION, float(2.0)),
            (Register::DECELERATION, float(-2.0)),
            (Register::MAX_SPEED, float(600.0)),
            (
                Register::REPLY_ID,
                Value::Integer(u32::from(config.reply_id)),
            ),
            (Register::ID, Value::Integer(u32::from(config.id))),
            (Register::TIMEOUT, Value::Integer(config.timeout)),
            (Register::MODE, Value::Integer(1)),
            (Register::ROTOR_INERTIA, float(1.8e-5)),
            (Register::HARDWARE, Value::Text(*b"V003")),
            (Register::FIRMWARE, Value::Text(config.firmware)),
            (Register::SERIAL, Value::Text(config.serial)),
            (Register::POLE_PAIRS, Value::Integer(config.pole_pairs)),
            (Register::RESISTANCE, float(0.85)),
            (Register::INDUCTANCE, float(345e-6)),
            (Register::FLUX, float(config.flux_wb)),
            (Register::GEAR_RATIO, float(config.gear_ratio)),
            (Register::POSITION_RANGE, float(config.position_range_rad)),
            (
                Register::VELOCITY_RANGE,
                float(config.velocity_range_rad_per_s),
            ),
            (Register::TORQUE_RANGE, float(config.torque_range_nm)),
            (Register::CURRENT_BANDWIDTH, float(1000.0)),
            (Register::OVER_VOLTAGE, float(32.0)),
            (Register::GEAR_EFFICIENCY, float(1.0)),
            (Register::SPEED_DAMPING, float(4.0)),
            (Register::VELOCITY_BANDWIDTH, float(40.0)),
            (
                Register::BIT_RATE,
                Value::Integer(BIT_RATES[usize::from(config.fd)]),
            ),
        ] {
            registers.set(register, value);
        }
        registers
    }

    /// Whether the firmware has the register.
    pub fn has(register: Register) -> bool {
        REGISTERS.iter().any(|info| info.register == register)
    }

    /// Bytes of a register.
    pub fn bytes(&self, register: Register) -> [u8; 4] {
        let found = self.0.get(usize::from(register.0));
        found.copied().unwrap_or_default()
    }

    /// Sets a register.
    pub fn set(&mut self, register: Register, value: Value) {
        self.set_bytes(register, value.to_bytes());
    }

    /// Sets the bytes of a register.
    pub fn set_bytes(&mut self, register: Register, bytes: [u8; 4]) {
        if let Some(entry) = self.0.get_mut(usize::from(register.0)) {
            *entry = bytes;
        }
    }

    /// An integer register.
    pub fn integer(&self, register: Register) -> u32 {
        u32::from_le_bytes(self.bytes(register))
    }

    /// A register in single precision.
    pub fn float(&self, register: Register) -> f64 {
        f64::from(f32::from_le_bytes(self.bytes(register)))
    }

    /// Returns the motor's ranges, or the ranges of a 4310 if the registers are not valid.
    pub fn ranges(&self) -> Ranges {
        let ranges = Ranges::new(
            self.float(Register::POSITION_RANGE),
            self.float(Register::VELOCITY_RANGE),
            self.float(Register::TORQUE_RANGE),
        );
        ranges.unwrap_or_else(|_| Ranges::new(12.5, 30.0, 10.0).expect("positive ranges"))
    }

    /// Whether replies are FD frames.
    pub fn is_fd(&self) -> bool {
        self.integer(Register::BIT_RATE) > BIT_RATES[0]
    }
}
