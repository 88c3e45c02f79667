//! Tests of the program `supple-rt` with a scripted plant.

use crate::support::terminate;
use core::time::Duration;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use supple_core::controller::{Mode, Request};
use supple_core::{Controller, Input, State, step};
use supple_ipc::message::{ArmState, Drives, Outcome, PlantReport, TorqueCommand};
use supple_ipc::{Domain, OperatorClient, PlantLink, TelemetryReader};
use supple_model::Description;
use supple_realtime::pause;
use tempfile::TempDir;

const TIMEOUT: Duration = Duration::from_secs(20);

struct System {
    folder: TempDir,
    domain: Domain,
}

fn system() -> System {
    let folder = tempfile::tempdir().expect("a folder");
    let owner_only = std::fs::Permissions::from_mode(0o700);
    std::fs::set_permissions(folder.path(), owner_only).expect("changed");
    let domain = Domain::in_folder(&folder.path().join("supple"), "process").expect("a domain");
    System { folder, domain }
}

impl System {
    fn start(&self, arguments: &[&str]) -> Child {
        Command::new(env!("CARGO_BIN_EXE_supple-rt"))
            .args(["--prefix", "process"])
            .args(arguments)
            .env("XDG_RUNTIME_DIR", self.folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("it starts")
    }
}

fn home() -> [Option<f64>; 4] {
    let description = Description::asset("wam4").expect("built in");
    let home = description.home::<4>().expect("four joints");
    core::array::from_fn(|i| Some(home[i]))
}

fn state(cycle: u64) -> ArmState {
    let report = PlantReport::default();
    ArmState::new(
        cycle,
        cycle * 1_000_000,
        &home(),
        None,
        Drives::Active,
        report,
    )
}

/// Publishes until a controller is connected.
fn publish(plant: &PlantLink, state: &ArmState) {
    for _ in 0..20_000 {
        if plant.publish(state).expect("published") {
            return;
        }
        pause(Duration::from_millis(1));
    }
    panic!("no controller connected");
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn answers_equal_those_of_step() {
    let system = system();
    let mut telemetry = TelemetryReader::new(&system.domain).expect("a reader");
    let mut operator = OperatorClient::new(&system.domain).expect("an operator");
    let plant = PlantLink::new(&system.domain).expect("a plant");
    let mut child = system.start(&["--virtual-time"]);
    let sequence = loop {
        if let Some(sequence) = operator
            .send::<4>(&Request::GravityHold, Some(2))
            .expect("sent")
        {
            break sequence;
        }
        pause(Duration::from_millis(1));
    };
    // The pause gives the helper time to receive the request before the first state.
    pause(Duration::from_millis(50));
    let description = Description::asset("wam4").expect("built in");
    let controller = Controller::new(description.config::<4>().expect("valid")).expect("valid");
    let mut reference = State::new(&controller);
    for cycle in 0..20 {
        publish(&plant, &state(cycle));
        let received = plant.answer(cycle, TIMEOUT).expect("read");
        let input = Input {
            cycle,
            position_rad: home(),
            tip_force_n: None,
            drives_active: true,
            request: (cycle == 2).then_some(Request::GravityHold),
        };
        let output = step(&controller, &mut reference, &input);
        assert_eq!(received.answer, Some(TorqueCommand::new(&output, false)));
    }
    let first = telemetry.wait(TIMEOUT).expect("read").expect("some");
    assert_eq!((first.step(), first.record().mode()), (0, Some(Mode::Idle)));
    let reply = || -> (u64, Outcome) {
        for _ in 0..5000 {
            if let Some(reply) = operator.receive().expect("read") {
                return (reply.sequence, reply.outcome());
            }
            pause(Duration::from_millis(1));
        }
        panic!("no reply arrived");
    };
    assert_eq!(reply(), (sequence, Outcome::Queued));
    assert_eq!(reply(), (sequence, Outcome::Accepted));
    child.kill().expect("SIGKILL");
    child.wait().expect("the process ended");
}

#[test]
fn fault_writes_last_cycles_to_a_file_that_only_the_owner_can_read() {
    let system = system();
    let plant = PlantLink::new(&system.domain).expect("a plant");
    let child = system.start(&["--virtual-time"]);
    // States 6 to 8 are missing.
    for cycle in [0, 1, 2, 3, 4, 5, 9, 10] {
        publish(&plant, &state(cycle));
        assert!(plant.answer(cycle, TIMEOUT).expect("read").answer.is_some());
    }
    terminate(&child);
    let output = child.wait_with_output().expect("it ends");
    // A signal during a wait requests shutdown and is not an error.
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("no new arm state for 3 cycles"),
        "{}",
        stderr(&output)
    );
    let folder = system.domain.folder().join("faults");
    let files: Vec<_> = std::fs::read_dir(&folder)
        .expect("the file exists")
        .flatten()
        .collect();
    assert_eq!(files.len(), 1);
    let path = files[0].path();
    assert!(stderr(&output).contains(&path.display().to_string()));
    let mode = |path: &Path| {
        path.metadata()
            .expect("the file exists")
            .permissions()
            .mode()
            & 0o777
    };
    assert_eq!((mode(&folder), mode(&path)), (0o700, 0o600));
    let table = std::fs::read_to_string(&path).expect("readable");
    let rows: Vec<Vec<&str>> = table
        .lines()
        .map(|line| line.split(',').collect())
        .collect();
    assert_eq!(
        rows.len(),
        1 + 7,
        "the table has a header and the cycles up to the fault"
    );
    assert!(rows.iter().all(|row| row.len() == rows[0].len()), "{table}");
    let column = |name: &str| {
        rows[0]
            .iter()
            .position(|column| *column == name)
            .expect("there")
    };
    assert_eq!(rows[7][column("cycle")], "9");
    assert_eq!(rows[7][column("mode")], (Mode::Fault as u8).to_string());
    let home = home()[1].expect("there").to_string();
    assert_eq!(rows[1][column("measured_position_rad.1")], home);
}

#[test]
fn a_second_controller_is_refused_with_the_reason() {
    let system = system();
    let plant = PlantLink::new(&system.domain).expect("a plant");
    let mut first = system.start(&["--virtual-time"]);
    publish(&plant, &state(0));
    let second = system.start(&["--virtual-time"]);
    let output = second.wait_with_output().expect("it ends");
    assert_eq!(output.status.code(), Some(10), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("another process already writes"),
        "{}",
        stderr(&output)
    );
    first.kill().expect("SIGKILL");
    first.wait().expect("the process ended");
    // A new controller replaces the killed one.
    let mut third = system.start(&["--virtual-time"]);
    let mut cycle = 1;
    while plant
        .answer(cycle, Duration::from_millis(20))
        .expect("read")
        .answer
        .is_none()
    {
        assert!(third.try_wait().expect("looked at").is_none(), "it runs");
        cycle += 1;
        publish(&plant, &state(cycle));
    }
    third.kill().expect("SIGKILL");
    third.wait().expect("the process ended");
}

#[test]
fn unknown_arm_exits_with_code_3() {
    let output = system().start(&["--arm", "wam9"]).wait_with_output();
    let output = output.expect("it ends");
    assert_eq!(output.status.code(), Some(3));
    assert!(stderr(&output).contains("wam9"), "{}", stderr(&output));
}
