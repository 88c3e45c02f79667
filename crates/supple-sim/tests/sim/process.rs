//! The real program against a scripted controller.

use core::time::Duration;
use std::os::unix::fs::PermissionsExt;
use std::process::{Child, Command, Stdio};
use supple_core::controller::{Controller, Request, State};
use supple_core::drive_guard::{DriveCommand, DriveGuard};
use supple_core::{Vector, step};
use supple_ipc::message::{ArmState, Drives, TorqueCommand};
use supple_ipc::{ControllerLink, Domain};
use supple_model::Description;
use supple_plant::{Plant, PlantConfig};
use tempfile::TempDir;

const TIMEOUT: Duration = Duration::from_secs(20);

struct System {
    folder: TempDir,
    domain: Domain,
}

fn system() -> System {
    let folder = tempfile::tempdir().expect("a folder");
    let owner = std::fs::Permissions::from_mode(0o700);
    std::fs::set_permissions(folder.path(), owner).expect("changed");
    let domain = Domain::in_folder(&folder.path().join("supple"), "process").expect("a domain");
    System { folder, domain }
}

impl System {
    fn start(&self, arguments: &[&str]) -> Child {
        Command::new(env!("CARGO_BIN_EXE_supple-sim"))
            .args(["--prefix", "process"])
            .args(arguments)
            .env("XDG_RUNTIME_DIR", self.folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("it starts")
    }
}

/// A controller that holds the arm.
struct Holding {
    controller: Controller<4>,
    state: State<4>,
}

impl Holding {
    fn new() -> Holding {
        let description = Description::asset("wam4").expect("built in");
        let controller = Controller::new(description.config().expect("valid")).expect("valid");
        Holding {
            state: State::new(&controller),
            controller,
        }
    }

    fn answer(&mut self, arm: &ArmState) -> TorqueCommand {
        let input = arm.input(Some(Request::GravityHold)).expect("four joints");
        TorqueCommand::new(&step(&self.controller, &mut self.state, &input), false)
    }
}

#[test]
fn in_virtual_time_it_equals_the_plant_bit_for_bit() {
    let system = system();
    let link = ControllerLink::new(&system.domain).expect("a controller");
    let child = system.start(&["--virtual-time", "--cycles", "200"]);
    let description = Description::asset("wam4").expect("built in");
    let config = PlantConfig::<4>::from_description(&description).expect("valid");
    let home = description.home().expect("four joints");
    let mut plant = Plant::new(config, home, Vector::zeros()).expect("valid");
    let mut controller = Holding::new();
    for cycle in 0..200 {
        let arm = link.wait(TIMEOUT).expect("read").expect("a state");
        let measured = plant.measurement();
        let input = arm.input::<4>(None).expect("four joints");
        assert_eq!((arm.cycle, arm.stamp_ns), (cycle, cycle * 1_000_000));
        assert_eq!(
            Vector::from(input.position_rad.map(Option::unwrap_or_default)),
            measured.position_rad
        );
        assert_eq!(input.tip_force_n, Some(measured.force_n));
        let drives = if cycle == 0 {
            Drives::Idle
        } else {
            Drives::Active
        };
        assert_eq!(
            (arm.drives(), arm.plant.missed, arm.plant.wake_ns),
            (drives, 0, 0)
        );
        let command = controller.answer(&arm);
        link.answer(&command).expect("answered");
        plant.cycle(&command.torque().expect("four joints"));
    }
    let output = child.wait_with_output().expect("it ends by itself");
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{text}");
    assert!(text.contains("200 cycles, 0 missed"), "{text}");
}

#[test]
fn in_real_time_it_continues_without_answers_and_counts_them() {
    let system = system();
    let link = ControllerLink::new(&system.domain).expect("a controller");
    let child = system.start(&["--cycles", "600"]);
    let mut controller = Holding::new();
    let mut last = None;
    let mut answered = 0;
    while let Some(arm) = link.wait(Duration::from_secs(10)).expect("read") {
        if let Some(last) = last {
            assert!(arm.cycle > last, "time does not advance");
        }
        last = Some(arm.cycle);
        if arm.drives() == Drives::Active {
            answered += 1;
        }
        if answered < 100 {
            link.answer(&controller.answer(&arm)).expect("answered");
        }
        if arm.cycle == 599 {
            // The drives became idle long before: 10 ms after the first missing answer.
            assert_eq!(arm.drives(), Drives::Idle);
            assert!(arm.plant.missed >= 10, "{arm:?}");
            break;
        }
    }
    assert_eq!(last, Some(599));
    let output = child.wait_with_output().expect("it ends by itself");
    assert!(output.status.success());
}

#[test]
fn a_second_plant_is_refused_with_the_reason() {
    let system = system();
    let mut first = system.start(&[]);
    let link = ControllerLink::new(&system.domain).expect("a controller");
    assert!(link.wait(TIMEOUT).expect("read").is_some());
    let output = system.start(&[]).wait_with_output().expect("it ends");
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(10), "{text}");
    assert!(text.contains("another process already writes"), "{text}");
    first.kill().expect("SIGKILL");
    first.wait().expect("it is gone");
    // A new plant replaces the killed one, and the controller receives its states.
    while link.receive().expect("read").is_some() {}
    let mut third = system.start(&[]);
    assert!(link.wait(TIMEOUT).expect("read").is_some());
    third.kill().expect("SIGKILL");
    third.wait().expect("it is gone");
}

/// An injected fault shows in the reported states from the first one on.
#[test]
fn injected_faults_show_in_the_published_states() {
    let system = system();
    let link = ControllerLink::new(&system.domain).expect("a controller");
    let arguments = [
        "--virtual-time",
        "--cycles",
        "30",
        "--inject",
        "encoder-offset:joint=3,offset-rad=0.25",
        "--inject",
        "reply-lost:every=2,joint=0",
    ];
    let child = system.start(&arguments);
    let description = Description::asset("wam4").expect("built in");
    let home_rad = description.home::<4>().expect("four joints");
    let mut holding = Holding::new();
    for cycle in 0..30 {
        let state = link.wait(TIMEOUT).expect("read").expect("a state");
        assert!((state.position_rad[3] - home_rad[3] - 0.25).abs() < 0.01);
        let present = state.position_present & 1 != 0;
        assert_eq!(present, cycle % 2 == 0, "cycle {cycle}");
        link.answer(&holding.answer(&state)).expect("answered");
    }
    let output = child.wait_with_output().expect("it ends");
    assert!(output.status.success());
}

/// A command for another arm, or with a torque that is not finite, counts as a missing answer: the last fallback torque
/// acts, the command is counted and reported, and the next command is accepted.
#[test]
fn invalid_command_counts_as_missing_answer() {
    let system = system();
    let link = ControllerLink::new(&system.domain).expect("a controller");
    let child = system.start(&["--virtual-time", "--cycles", "40"]);
    let description = Description::asset("wam4").expect("built in");
    let config = PlantConfig::<4>::from_description(&description).expect("valid");
    let home = description.home().expect("four joints");
    let mut plant = Plant::new(config, home, Vector::zeros()).expect("valid");
    let mut controller = Holding::new();
    let mut guard = DriveGuard::<4>::new(&description.config().expect("valid"));
    let mut fallback_nm = Vector::zeros();
    let mut unusable = 0;
    for cycle in 0..40 {
        let arm = link.wait(TIMEOUT).expect("read").expect("a state");
        let measured = arm.input::<4>(None).expect("four joints").position_rad;
        let expected = plant.measurement().position_rad;
        assert_eq!(
            Vector::from(measured.map(Option::unwrap_or_default)),
            expected
        );
        assert_eq!((arm.plant.unusable, arm.plant.missed), (unusable, unusable));
        let command = controller.answer(&arm);
        let spoilt = match cycle {
            10 => TorqueCommand {
                torque_nm: [f64::NAN; 7],
                ..command
            },
            20 => TorqueCommand { dof: 7, ..command },
            30 => TorqueCommand {
                fallback_torque_nm: [f64::INFINITY; 7],
                ..command
            },
            _ => command,
        };
        link.answer(&spoilt).expect("answered");
        let answer = spoilt.is_usable::<4>().then_some(&spoilt);
        unusable += u64::from(answer.is_none());
        guard.observe(&measured, 1);
        let drive = answer.map(|command| DriveCommand {
            torque_nm: command.torque().expect("four joints"),
            mode: command.mode(),
            fault: false,
        });
        if cycle == 0 {
            guard.reset_rate_limit(&drive.expect("valid").torque_nm);
        }
        assert_eq!(guard.check_command(drive.as_ref(), true), Ok(()));
        if let Some(command) = answer {
            fallback_nm = command.fallback_torque().expect("four joints");
        }
        let wanted_nm = drive.map_or(fallback_nm, |drive| drive.torque_nm);
        let torque_nm = guard.limited_nm(&wanted_nm, drive.is_none());
        if answer.is_none() {
            // The torque does not drop to zero at once.
            assert!(torque_nm.amax() > 0.1, "{torque_nm}");
        }
        plant.cycle(&torque_nm);
    }
    let output = child.wait_with_output().expect("it ends by itself");
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{text}");
    assert!(text.contains("40 cycles, 3 missed"), "{text}");
}
