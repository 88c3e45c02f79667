//! Configuration of emulated Damiao motors.

use supple_can_frame::BitRates;
use supple_model::{BusDescription, BusFormat, BusMotor};

/// Registers, mechanical data and initial state of one motor.
#[derive(Clone, Debug, PartialEq)]
pub struct MotorConfig {
    /// Id of the frames to the motor.
    pub id: u8,
    /// Id of the motor's replies.
    pub reply_id: u16,
    /// Firmware, four digits.
    pub firmware: [u8; 4],
    /// Serial number, four characters.
    pub serial: [u8; 4],
    /// Gear ratio.
    pub gear_ratio: f64,
    /// PMAX \[rad\].
    pub position_range_rad: f64,
    /// VMAX \[rad/s\].
    pub velocity_range_rad_per_s: f64,
    /// TMAX \[N m\].
    pub torque_range_nm: f64,
    /// Torque at the maximum current \[N m\]; 0.7 TMAX by default, about the peak torque of the data sheets.
    pub peak_torque_nm: f64,
    /// Pole pairs.
    pub pole_pairs: u32,
    /// Flux \[Wb\], as the motor identified it.
    pub flux_wb: f64,
    /// 1 if motor and joint turn in the same direction, otherwise -1.
    pub direction: f64,
    /// Angle of the joint at the zero position of the motor \[rad\].
    pub zero_offset_rad: f64,
    /// TIMEOUT in flash, in units of 50 us; 0 (the factory default) means no watchdog until a host sets it.
    pub timeout: u32,
    /// Whether the motor answers with FD frames (register can_br).
    pub fd: bool,
    /// Whether a disabled motor brakes through shorted phases. False by default: the maker does not
    /// publish this, and arms of this type are reported to fall.
    pub brakes_when_disabled: bool,
    /// Temperature at the start \[degrees Celsius\]; 30 by default.
    pub celsius: f64,
}

impl MotorConfig {
    /// Returns a motor that passes the checks of start-up against `[bus]`; values that the TOML does not give are assumed.
    pub fn expected(motor: &BusMotor, fd: bool) -> MotorConfig {
        let series = motor.firmware_series.as_deref();
        let series = series.unwrap_or(match &motor.model {
            model if model.contains("4340") => "51",
            model if model.contains("8009") => "64",
            _ => "50",
        });
        let mut firmware = *b"5017";
        for (to, from) in firmware.iter_mut().zip(series.bytes()) {
            *to = from;
        }
        let (pole_pairs, flux_wb) = match motor.gear_ratio < 9.5 {
            true => (21, 0.0035),
            false => (14, 0.0045),
        };
        MotorConfig {
            id: motor.id as u8,
            reply_id: motor.reply_id,
            firmware,
            serial: [b'T', b'0', b'0', b'0' + (motor.id % 10) as u8],
            gear_ratio: motor.gear_ratio,
            position_range_rad: motor.position_range_rad,
            velocity_range_rad_per_s: motor.velocity_range_rad_per_s,
            torque_range_nm: motor.torque_range_nm,
            peak_torque_nm: 0.7 * motor.torque_range_nm,
            pole_pairs,
            flux_wb,
            direction: motor.direction,
            zero_offset_rad: motor.zero_offset_rad,
            timeout: 0,
            fd,
            brakes_when_disabled: false,
            celsius: 30.0,
        }
    }
}

/// Configuration of an emulated arm.
#[derive(Clone, Debug, PartialEq)]
pub struct DamiaoConfig {
    /// Motors, in the order of the joints.
    pub motors: Vec<MotorConfig>,
    /// Bit rates of the bus.
    pub rates: BitRates,
    /// Whether a support holds the arm in its start pose until all motors are enabled; true by default. Without it the
    /// arm falls at once.
    pub supported: bool,
    /// Time between a frame's end and a motor's reply to it \[ns\]; 20 us by default, an assumption, because the
    /// maker does not publish it.
    pub latency_ns: u64,
    /// Maximum random addition to the latency \[ns\]; 10 us by default, an assumption.
    pub jitter_ns: u64,
    /// Time of the bus-off recovery \[ns\]; 100 ms by default.
    pub restart_ns: u64,
    /// Step of the physics \[ns\]; 0.2 ms by default.
    pub step_ns: u64,
    /// Whether frames that write flash are executed. False by default: such a frame ends the emulation with an error.
    pub allow_flash: bool,
    /// Seed of the jitter.
    pub seed: u64,
}

impl DamiaoConfig {
    /// Returns the motors that an arm's TOML expects, on its bus.
    pub fn expected(bus: &BusDescription) -> DamiaoConfig {
        let fd = bus.format == BusFormat::Fd;
        let motors = bus.motors.iter();
        DamiaoConfig {
            motors: motors
                .map(|motor| MotorConfig::expected(motor, fd))
                .collect(),
            rates: BitRates {
                nominal_bit_per_s: bus.bit_rate,
                data_bit_per_s: fd.then_some(bus.data_bit_rate),
            },
            supported: true,
            latency_ns: 20_000,
            jitter_ns: 10_000,
            restart_ns: 100_000_000,
            step_ns: 200_000,
            allow_flash: false,
            seed: 0,
        }
    }
}
