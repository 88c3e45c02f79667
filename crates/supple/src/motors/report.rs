//! Report of `supple motors`.

use super::bus::MotorBus;
use comfy_table::{ContentArrangement, Table, presets};
use serde::Serialize;
use std::collections::BTreeMap;
use supple_bus::Address;
use supple_cli::console::print_line;
use supple_cli::exit::Failure;
use supple_damiao::inspection::{Expectation, RegisterReadings, TIMEOUT_UNIT_S, TO_READ};
use supple_damiao::register::REGISTERS;
use supple_damiao::{Problem, Ranges, Register, Value};
use supple_model::{BusDescription, BusFormat, BusMotor};

/// Relative difference of the flux between motors of one type above which a warning is printed.
const FLUX_TOLERANCE: f64 = 0.05;

/// Report of one motor.
#[derive(Debug, Serialize)]
pub(super) struct MotorReport {
    /// Id in the arm's TOML.
    pub id: u16,
    /// Joint.
    pub joint: String,
    /// Type in the arm's TOML.
    pub model: String,
    /// Status; `None` if the motor did not answer.
    pub state: Option<String>,
    /// Firmware, four digits.
    pub firmware: Option<String>,
    /// Gear ratio.
    pub gear_ratio: Option<f64>,
    /// Ranges of position, velocity and torque.
    pub ranges: Option<[f64; 3]>,
    /// Mode, 1 for impedance.
    pub mode: Option<u32>,
    /// Watchdog \[s\]; 0 for none.
    pub watchdog_s: Option<f64>,
    /// Position \[rad\].
    pub position_rad: Option<f64>,
    /// Temperature \[degrees Celsius\].
    pub celsius: Option<u8>,
    /// KT_Value, 0 if the torque constant follows from the flux \[N m/A\].
    pub torque_constant: Option<f64>,
    /// Pole pairs.
    pub pole_pairs: Option<u32>,
    /// Flux \[Wb\]; together with pole pairs and gear ratio, it determines the torque scale.
    pub flux_wb: Option<f64>,
    /// All registers by name, if requested.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub registers: BTreeMap<String, String>,
    /// Reason why start-up would refuse the motor.
    pub problem: Option<String>,
    /// Warning about the motor.
    pub warning: Option<String>,
}

/// Report of all motors.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    arm: String,
    bus: String,
    /// Motors, from the base to the tip.
    pub motors: Vec<MotorReport>,
}

/// Reads all properties of one motor and compares them with the arm's TOML.
pub(super) fn describe(
    bus: &mut MotorBus,
    described: &BusDescription,
    motor: &BusMotor,
    all_registers: bool,
) -> Result<MotorReport, Failure> {
    let id = motor.id as u8;
    let expectation = Expectation {
        id,
        reply_id: motor.reply_id,
        gear_ratio: motor.gear_ratio,
        position_range_rad: motor.position_range_rad,
        velocity_range_rad_per_s: motor.velocity_range_rad_per_s,
        torque_range_nm: motor.torque_range_nm,
        firmware_series: motor.firmware_series.as_deref(),
        watchdog_s: described.watchdog_s,
        without_watchdog: motor.without_watchdog,
        fd: described.format == BusFormat::Fd,
    };
    let mut line = MotorReport {
        id: motor.id,
        joint: motor.joint.clone(),
        model: motor.model.clone(),
        state: None,
        firmware: None,
        gear_ratio: None,
        ranges: None,
        mode: None,
        watchdog_s: None,
        position_rad: None,
        celsius: None,
        torque_constant: None,
        pole_pairs: None,
        flux_wb: None,
        registers: BTreeMap::new(),
        problem: None,
        warning: None,
    };
    let answers = bus.feedback(id)?;
    let refused = |problem| Some(expectation.refuse(problem).to_string());
    let (reply_id, feedback) = match answers.as_slice() {
        [] => {
            line.problem = refused(Problem::Silent);
            return Ok(line);
        }
        [one] => *one,
        _ => {
            line.problem = refused(Problem::TwoAnswers);
            return Ok(line);
        }
    };
    line.state = Some(feedback.status.to_string());
    let mut readings = RegisterReadings::new();
    for register in TO_READ {
        if let Some(value) = bus.read(id, register)? {
            readings.insert(register, value.to_bytes());
        }
    }
    let float = |register| match readings.get(register) {
        Some(Value::Float(value)) => Some(f64::from(value)),
        _ => None,
    };
    let integer = |register| match readings.get(register) {
        Some(Value::Integer(value)) => Some(value),
        _ => None,
    };
    line.firmware = readings
        .get(Register::FIRMWARE)
        .map(|value| value.to_string());
    line.gear_ratio = float(Register::GEAR_RATIO);
    let ranges = [
        float(Register::POSITION_RANGE),
        float(Register::VELOCITY_RANGE),
        float(Register::TORQUE_RANGE),
    ];
    if let [Some(p), Some(v), Some(t)] = ranges {
        line.ranges = Some([p, v, t]);
    }
    line.mode = integer(Register::MODE);
    let timeout = integer(Register::TIMEOUT);
    line.watchdog_s = timeout.map(|ticks| f64::from(ticks) * TIMEOUT_UNIT_S);
    line.torque_constant = float(Register::TORQUE_CONSTANT);
    line.pole_pairs = integer(Register::POLE_PAIRS);
    line.flux_wb = float(Register::FLUX);
    line.celsius = Some(
        bus.feedback(id)?
            .first()
            .map_or(0, |(_, f)| f.hottest_celsius()),
    );
    let own = line.ranges.and_then(|[p, v, t]| Ranges::new(p, v, t).ok());
    line.position_rad = own.map(|ranges| feedback.position_rad(&ranges));
    let problem = match feedback.status.is_error() {
        true => Some(Problem::MotorError(feedback.status)),
        false if reply_id != motor.reply_id => Some(Problem::ReplyIdMismatch {
            found: reply_id,
            expected: motor.reply_id,
        }),
        false => None,
    };
    line.problem = match problem {
        Some(problem) => refused(problem),
        None => expectation
            .check(&readings, line.position_rad)
            .err()
            .map(|refusal| refusal.to_string()),
    };
    if all_registers {
        for info in REGISTERS {
            let value = bus.read(id, info.register)?;
            let value = value.map_or("no answer".to_owned(), |value| value.to_string());
            let text = format!("{value} {}", info.unit).trim_end().to_owned();
            line.registers
                .insert(format!("{:02} {}", info.register.0, info.name), text);
        }
    }
    Ok(line)
}

impl Report {
    /// Creates a report without motors.
    pub fn new(arm: &str, address: &Address) -> Report {
        Report {
            arm: arm.to_owned(),
            bus: address.to_string(),
            motors: Vec::new(),
        }
    }

    /// Adds a warning to motors whose identified flux, and therefore torque per command, differs from others of their type.
    pub fn compare_equal_motors(&mut self) {
        let mut by_type: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        for line in &self.motors {
            if let Some(flux_wb) = line.flux_wb {
                by_type.entry(line.model.clone()).or_default().push(flux_wb);
            }
        }
        for line in &mut self.motors {
            let (Some(flux_wb), Some(all)) = (line.flux_wb, by_type.get_mut(&line.model)) else {
                continue;
            };
            all.sort_by(f64::total_cmp);
            let median = all[all.len() / 2];
            if (flux_wb / median - 1.0).abs() > FLUX_TOLERANCE {
                line.warning = Some(format!(
                    "motor {}: register 19 (Flux) is {flux_wb:.5}, others of its type have {median:.5} Wb: its torque per \
                     command differs by as much",
                    line.id
                ));
            }
        }
    }

    /// Prints a table, followed by problems and warnings.
    pub fn print(&self) -> Result<(), Failure> {
        let mut table = Table::new();
        table
            .load_style(presets::NOTHING)
            .set_content_arrangement(ContentArrangement::Disabled)
            .set_header([
                "id",
                "joint",
                "type",
                "state",
                "firmware",
                "ratio",
                "rad, rad/s, N m",
                "mode",
                "watchdog",
                "position",
                "temp.",
                "KT, pairs, flux",
            ]);
        let text = |value: Option<String>| value.unwrap_or_else(|| "-".to_owned());
        for line in &self.motors {
            table.add_row([
                line.id.to_string(),
                line.joint.clone(),
                line.model.clone(),
                text(line.state.clone()),
                text(line.firmware.clone()),
                text(line.gear_ratio.map(|ratio| format!("{ratio:.2}"))),
                text(line.ranges.map(|[p, v, t]| format!("{p}, {v}, {t}"))),
                text(line.mode.map(|mode| mode.to_string())),
                text(line.watchdog_s.map(|s| match s > 0.0 {
                    true => format!("{:.0} ms", s * 1e3),
                    false => "off".to_owned(),
                })),
                text(line.position_rad.map(|rad| format!("{rad:.4} rad"))),
                text(line.celsius.map(|celsius| format!("{celsius} C"))),
                text(
                    line.flux_wb
                        .zip(line.pole_pairs)
                        .zip(line.torque_constant)
                        .map(|((flux, pairs), kt)| format!("{kt}, {pairs}, {flux:.5}")),
                ),
            ]);
        }
        print_line(&table.trim_fmt())?;
        for line in &self.motors {
            for (name, value) in &line.registers {
                print_line(&format!("motor {}: {name} = {value}", line.id))?;
            }
        }
        for line in &self.motors {
            for note in line.problem.iter().chain(&line.warning) {
                print_line(note)?;
            }
        }
        Ok(())
    }
}
