//! `supple motors`: lists the motors of an arm on their bus and, on explicit request, sets registers.
//!
//! The command compares each motor with the arm's TOML, as start-up does. It never enables a motor, never commands a torque,
//! and fails if a motor is enabled. It writes flash only with `--store`, of one motor.

mod bus;
mod report;

use crate::cli::MotorsArgs;
use bus::MotorBus;
use report::{MotorReport, Report, describe};
use supple_bus::Address;
use supple_cli::arms;
use supple_cli::console::{print_json, print_line, print_status};
use supple_cli::exit::Failure;
use supple_damiao::register::{Access, Kind, REGISTERS, RegisterInfo};
use supple_damiao::{Problem, Refusal, Register, Status, Value};
use supple_ipc::Domain;
use supple_model::{BusDescription, BusMotor};

/// Runs `supple motors`.
///
/// # Errors
/// [`Failure`] if the arm has no `[bus]`, the bus cannot be used, a register was not set, or a motor does not match the arm.
pub fn run(args: &MotorsArgs) -> Result<(), Failure> {
    let description = arms::find(&args.urdf.name(&args.arm), args.strict)?;
    let Some(described) = description.bus() else {
        let problem = format!(
            "arm `{}` has no [bus] in its TOML; `supple motors` supports arms of Damiao motors, such as openarm and yam",
            description.name()
        );
        return Err(Failure::Motors { problem });
    };
    let selected = selected(described, args)?;
    let sets = args
        .set
        .iter()
        .map(|text| assignment(text))
        .collect::<Result<Vec<_>, _>>()?;
    let address = match &args.bus {
        Some(address) => address.clone(),
        None => {
            let domain = Domain::new(args.prefix.as_deref()).map_err(Failure::system)?;
            Address::of_system(domain.prefix()).map_err(Failure::system)?
        }
    };
    let mut bus = MotorBus::open(&address, described)?;
    if !args.json {
        print_status(&format!("{} on {address}", description.name()));
    }
    for motor in &described.motors {
        refuse_enabled(&mut bus, motor)?;
    }
    let changes = selected.first().filter(|_| args.motor.is_some());
    if let Some(motor) = changes {
        change(&mut bus, motor, &sets, args)?;
    }
    let mut report = Report::new(description.name(), &address);
    for motor in selected {
        report
            .motors
            .push(describe(&mut bus, described, motor, args.registers)?);
    }
    report.compare_equal_motors();
    match args.json {
        true => print_json(&report)?,
        false => report.print()?,
    }
    let problems: Vec<String> = report
        .motors
        .iter()
        .filter_map(|line: &MotorReport| line.problem.clone())
        .collect();
    match problems.is_empty() {
        true => Ok(()),
        false => Err(Failure::Motors {
            problem: problems.join("; "),
        }),
    }
}

/// Returns the motors to list: one, or all.
fn selected<'a>(
    described: &'a BusDescription,
    args: &MotorsArgs,
) -> Result<Vec<&'a BusMotor>, Failure> {
    let Some(id) = args.motor else {
        return Ok(described.motors.iter().collect());
    };
    let found = described.motors.iter().find(|motor| motor.id == id);
    let known = || {
        let ids = described.motors.iter().map(|motor| motor.id.to_string());
        ids.collect::<Vec<_>>().join(", ")
    };
    found
        .map(|motor| vec![motor])
        .ok_or_else(|| Failure::Motors {
            problem: format!("no motor of the arm has id {id}: use one of {}", known()),
        })
}

/// Parses NAME=VALUE with a register that may be written.
fn assignment(text: &str) -> Result<(&'static RegisterInfo, Value), Failure> {
    let wrong = |reason: String| Failure::Motors {
        problem: format!("--set {text}: {reason}"),
    };
    let (name, value) = text
        .split_once('=')
        .ok_or_else(|| wrong("give NAME=VALUE, as in TIMEOUT=400".to_owned()))?;
    let by_number = name.parse().ok().and_then(|number| Register(number).info());
    let info = by_number.or(Register::by_name(name)).ok_or_else(|| {
        let writable = REGISTERS
            .iter()
            .filter(|info| info.access == Access::Writable);
        let names: Vec<&str> = writable.map(|info| info.name).collect();
        wrong(format!(
            "no register has this name; the writable registers are {}",
            names.join(", ")
        ))
    })?;
    if info.access != Access::Writable {
        let reason = match info.access {
            Access::ReadOnly => "the motor alone writes it",
            _ => "host and motor must agree on it, so it is never written here",
        };
        return Err(wrong(format!("{} is not set: {reason}", info.register)));
    }
    let value = match info.kind {
        Kind::Integer => value.parse().ok().map(Value::Integer),
        Kind::Float => value
            .parse()
            .ok()
            .filter(|x: &f32| x.is_finite())
            .map(Value::Float),
        Kind::Text => None,
    };
    let value = value.ok_or_else(|| {
        let kind = match info.kind {
            Kind::Integer => "a whole number, 0 or more",
            _ => "a finite number",
        };
        wrong(format!("{} needs {kind}", info.register))
    })?;
    Ok((info, value))
}

/// Fails if a motor is enabled: another host may then be using the bus.
fn refuse_enabled(bus: &mut MotorBus, motor: &BusMotor) -> Result<(), Failure> {
    let answers = bus.feedback(motor.id as u8)?;
    let enabled = answers
        .iter()
        .any(|(_, feedback)| feedback.status == Status::Enabled);
    match enabled {
        false => Ok(()),
        true => Err(Failure::Motors {
            problem: Refusal {
                motor: motor.id as u8,
                problem: Problem::AlreadyEnabled,
            }
            .to_string(),
        }),
    }
}

/// Clears an error, sets registers and stores them, as requested.
fn change(
    bus: &mut MotorBus,
    motor: &BusMotor,
    sets: &[(&'static RegisterInfo, Value)],
    args: &MotorsArgs,
) -> Result<(), Failure> {
    let id = motor.id as u8;
    if args.clear {
        bus.clear_error(id)?;
    }
    for (info, value) in sets {
        let before = bus.read(id, info.register)?;
        let after = bus.write(id, info.register, *value)?;
        if after.map(Value::to_bytes) != Some(value.to_bytes()) {
            let found = after.map_or("no answer".to_owned(), |value| value.to_string());
            return Err(Failure::Motors {
                problem: format!(
                    "motor {id}: {} is {found} after {value} was written; its firmware may not allow it",
                    info.register
                ),
            });
        }
        let before = before.map_or("unknown".to_owned(), |value| value.to_string());
        print_status(&format!(
            "motor {id}: {} was {before}, is {value}{}",
            info.register,
            match args.store {
                true => "",
                false => " until its supply is switched off",
            }
        ));
    }
    if args.store {
        bus.store(id)?;
        print_status(&format!(
            "motor {id}: all registers are stored in its flash, which endures some 10000 writes"
        ));
    }
    if !args.json && !args.registers && (args.clear || args.store || !sets.is_empty()) {
        print_line("")?;
    }
    Ok(())
}
