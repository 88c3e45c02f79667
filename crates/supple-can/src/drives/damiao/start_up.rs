//! Start-up of Damiao motors: reads the registers of every motor, compares them with the arm's TOML and sets some of them,
//! before any motor is enabled.
//!
//! ```text
//! read feedback of each motor -> read registers -> compare -> set mode and watchdog in RAM, read back -> unwrap turns
//! ```
//!
//! Start-up stores nothing in flash and sets no zero position. A motor whose watchdog has tripped reports lost communication
//! until the error is cleared. Start-up clears this error and no other, also when it is repeated after the arm has lost its power; the
//! motor stays disabled.

use super::error::DamiaoError;
use super::host::{Host, MS};
use super::motor::Motor;
use supple_bus::Bus;
use supple_can_frame::{BitRates, FrameFormat};
use supple_damiao::inspection::{Expectation, MIT_MODE, RegisterReadings, TO_READ};
use supple_damiao::position::JointAngle;
use supple_damiao::refusal::Problem;
use supple_damiao::register::Register;
use supple_damiao::temperature::TemperatureLimits;
use supple_damiao::{Feedback, SpecialCommand, Status};
use supple_model::{BusDescription, BusFormat, BusMotor, Description};

/// Time before the first request in which replies to requests of an earlier process are discarded \[ns\].
const QUIET_NS: u64 = 5 * MS;
/// Maximum angle by which a joint may exceed its limits at start-up, because it may rest on its hard stop \[rad\].
const SLACK_RAD: f64 = 0.1;

/// Returns the bit rates of an arm's bus.
pub fn rates(bus: &BusDescription) -> BitRates {
    BitRates {
        nominal_bit_per_s: bus.bit_rate,
        data_bit_per_s: (bus.format == BusFormat::Fd).then_some(bus.data_bit_rate),
    }
}

/// Reads and checks the registers of every motor, writes control mode and watchdog timeout to RAM, and returns the motors. No
/// motor is enabled; a motor that is already enabled is refused.
///
/// # Errors
/// [`DamiaoError`]; [`DamiaoError::Refused`] has register, value found, value expected and remedy.
pub fn start_up<const N: usize, B: Bus>(
    bus: &mut B,
    description: &Description,
    stop: &dyn Fn() -> bool,
) -> Result<[Motor; N], DamiaoError> {
    let no_motors = || DamiaoError::NoMotors {
        arm: description.name().to_owned(),
    };
    let bus_description = description.bus().ok_or_else(no_motors)?;
    let config = description.config::<N>()?;
    let format = rates(bus_description).fastest_format();
    let fd = matches!(format, FrameFormat::Fd { .. });
    if fd && !bus.carries_fd() {
        return Err(DamiaoError::NoFd {
            arm: description.name().to_owned(),
        });
    }
    let thermal = TemperatureLimits::new(
        bus_description.warning_celsius,
        bus_description.derating_celsius,
        bus_description.fault_celsius,
    );
    // The description has already checked that these ascend.
    let thermal = thermal.ok_or_else(no_motors)?;
    let mut host = Host { bus, format, stop };
    host.discard(QUIET_NS)?;
    let mut motors = Vec::with_capacity(N);
    for (joint, motor) in bus_description.motors.iter().enumerate() {
        let expectation = expectation(bus_description, motor, fd);
        let refused_for = |problem| DamiaoError::Refused {
            joint: motor.joint.clone(),
            refusal: expectation.refuse(problem),
        };
        let feedback = feedback_of_disabled(&mut host, &expectation)?.map_err(refused_for)?;
        let mut readings = RegisterReadings::new();
        for register in TO_READ {
            let bytes = host.read(expectation.id, expectation.reply_id, register)?;
            readings.insert(
                register,
                bytes.ok_or_else(|| refused_for(Problem::RegisterNotRead(register)))?,
            );
        }
        let refused = |refusal| DamiaoError::Refused {
            joint: motor.joint.clone(),
            refusal,
        };
        let ranges = expectation.check(&readings, None).map_err(refused)?.ranges;
        let motor_rad = feedback.position_rad(&ranges);
        let inspected = expectation
            .check(&readings, Some(motor_rad))
            .map_err(refused)?;
        let mode = inspected.write_mode.then_some(MIT_MODE);
        for (register, value) in [
            (Register::MODE, mode),
            (Register::TIMEOUT, inspected.write_timeout),
        ] {
            let Some(value) = value else {
                continue;
            };
            let (id, reply_id) = (expectation.id, expectation.reply_id);
            host.write(id, reply_id, register, value)?;
            let bytes = host.read(id, reply_id, register)?;
            let bytes = bytes.ok_or_else(|| refused_for(Problem::RegisterNotRead(register)))?;
            let found = u32::from_le_bytes(bytes);
            let written = expectation.check_written(register, value, found);
            written.map_err(refused)?;
        }
        let limits = &config.limits;
        let angle = JointAngle::new(motor.direction, motor.zero_offset_rad).unwrapped(
            motor_rad,
            limits.position_lower_rad[joint],
            limits.position_upper_rad[joint],
            SLACK_RAD,
        );
        motors.push(Motor {
            id: expectation.id,
            reply_id: expectation.reply_id,
            ranges,
            angle: angle.map_err(|source| DamiaoError::Position {
                joint: motor.joint.clone(),
                source,
            })?,
            torque_scale: motor.torque_scale,
            torque_limit_nm: limits.joint_torque_nm[joint],
            thermal,
            torque_registers: readings.torque_registers().ok_or_else(no_motors)?,
        });
    }
    motors.try_into().map_err(|_| no_motors())
}

/// Relative difference between the torque constants of two motors of one model that is reported.
const CONSTANT_TOLERANCE: f64 = 0.05;

/// Returns the motors whose torque constant differs by more than 5 % from that of the first motor of the same model, as pairs of
/// indices: the motor and that first one.
pub fn differing_torque_constants<const N: usize>(
    motors: &[Motor; N],
    bus: &BusDescription,
) -> Vec<(usize, usize)> {
    let first_of = |joint: usize| {
        let model = &bus.motors[joint].model;
        bus.motors.iter().position(|motor| motor.model == *model)
    };
    let differs = |joint: &usize| {
        let first = first_of(*joint)?;
        let [own, other] =
            [*joint, first].map(|index| motors[index].torque_registers.torque_constant_nm_per_a());
        ((own - other).abs() > CONSTANT_TOLERANCE * other).then_some((*joint, first))
    };
    (0..N).filter_map(|joint| differs(&joint)).collect()
}

fn expectation<'a>(bus: &BusDescription, motor: &'a BusMotor, fd: bool) -> Expectation<'a> {
    Expectation {
        id: motor.id as u8,
        reply_id: motor.reply_id,
        gear_ratio: motor.gear_ratio,
        position_range_rad: motor.position_range_rad,
        velocity_range_rad_per_s: motor.velocity_range_rad_per_s,
        torque_range_nm: motor.torque_range_nm,
        firmware_series: motor.firmware_series.as_deref(),
        watchdog_s: bus.watchdog_s,
        without_watchdog: motor.without_watchdog,
        fd,
    }
}

/// Requests the feedback of a motor, and clears the error of lost communication. The motor must be disabled and have no
/// other error.
fn feedback_of_disabled<B: Bus>(
    host: &mut Host<'_, B>,
    of: &Expectation<'_>,
) -> Result<Result<Feedback, Problem>, DamiaoError> {
    let mut found = host.feedback(of.id, of.reply_id)?;
    if let Ok(feedback) = &found
        && feedback.status == Status::CommunicationLost
    {
        found = host.special(of.id, of.reply_id, SpecialCommand::ClearError)?;
        if found.is_ok() {
            found = host.feedback(of.id, of.reply_id)?;
        }
    }
    Ok(found.and_then(|feedback| match feedback.status {
        Status::Disabled => Ok(feedback),
        Status::Enabled => Err(Problem::AlreadyEnabled),
        error => Err(Problem::MotorError(error)),
    }))
}
