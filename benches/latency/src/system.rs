//! Measures a running system of two processes through its telemetry.

use crate::common::{Common, Failure, Measured};
use core::time::Duration;
use rustix::process::{Pid, Signal, kill_process};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use supple_core::controller::{Mode, Request};
use supple_ipc::message::{Drives, Telemetry};
use supple_ipc::{Domain, OperatorClient, TelemetryReader};
use supple_realtime::pause;

const PREFIX: &str = "latency";
/// Number of cycles in gravity hold before the measurement.
const WARM_UP: u64 = 1000;
const ANSWER_TIMEOUT: Duration = Duration::from_secs(10);

/// The processes, the controller first; they are ended in this order on drop.
struct Processes(Vec<Child>);

impl Drop for Processes {
    fn drop(&mut self) {
        for child in &mut self.0 {
            let id = i32::try_from(child.id()).ok().and_then(Pid::from_raw);
            // A process that has already ended needs no signal.
            if let Some(id) = id {
                let _ = kill_process(id, Signal::TERM);
            }
            let _ = child.wait();
        }
    }
}

fn start(program: &Path, common: &Common) -> Result<Child, Failure> {
    let mut command = Command::new(program);
    command
        .args(["--prefix", PREFIX, "--cpu", &common.cpu.to_string()])
        .stdout(Stdio::null());
    if common.no_realtime {
        command.arg("--no-realtime");
    }
    command
        .spawn()
        .map_err(|error| format!("{}: {error}", program.display()).into())
}

fn next(reader: &mut TelemetryReader) -> Result<Telemetry, Failure> {
    reader
        .wait(ANSWER_TIMEOUT)?
        .ok_or_else(|| "no telemetry: did supple-rt or supple-sim end?".into())
}

pub fn measure(programs: &Path, common: &Common) -> Result<Measured, Failure> {
    let domain = Domain::new(Some(PREFIX))?;
    let mut reader = TelemetryReader::new(&domain)?;
    let mut operator = OperatorClient::new(&domain)?;
    let _processes = Processes(vec![
        start(&programs.join("supple-rt"), common)?,
        start(&programs.join("supple-sim"), common)?,
    ]);
    next(&mut reader)?;
    while operator.send::<4>(&Request::GravityHold, None)?.is_none() {
        pause(Duration::from_millis(10));
    }
    let mut telemetry = next(&mut reader)?;
    while telemetry.state.drives() != Drives::Active {
        telemetry = next(&mut reader)?;
    }
    for _ in 0..WARM_UP {
        telemetry = next(&mut reader)?;
    }
    let missed = telemetry.state.plant.missed;
    let mut measured = Measured::with_capacity(common.cycles());
    for _ in 0..common.cycles() {
        telemetry = next(&mut reader)?;
        let plant = &telemetry.state.plant;
        measured.wake_ns.push(plant.wake_ns);
        // Zero if no reply arrived in time; such cycles are counted as missed.
        if plant.round_trip_ns > 0 {
            measured.round_trip_ns.push(plant.round_trip_ns);
        }
    }
    measured.missed = telemetry.state.plant.missed - missed;
    if telemetry.record().mode() != Some(Mode::GravityHold) {
        return Err(format!(
            "the controller left gravity hold: {}",
            telemetry.record().fault_text
        )
        .into());
    }
    match reader.lost() {
        0 => Ok(measured),
        lost => Err(format!("{lost} records of telemetry were lost").into()),
    }
}
