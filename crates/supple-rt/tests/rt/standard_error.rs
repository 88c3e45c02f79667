//! The real program with a standard error that has no reader: full, or closed.

use crate::support::terminate;
use core::time::Duration;
use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use std::io::{PipeReader, PipeWriter, Write, pipe};
use std::process::{Child, Command, Stdio};
use supple_core::controller::{Mode, Request};
use supple_ipc::message::{ArmState, Drives, Outcome, PlantReport};
use supple_ipc::{Domain, IdleAnswer, OperatorClient, PlantLink, request_idle};
use supple_model::Description;
use supple_realtime::pause;
use tempfile::TempDir;

/// Period of the scripted plant: longer than the arm's, so that the result depends on cycles and not on the load of the
/// machine.
const PERIOD: Duration = Duration::from_millis(2);
/// Maximum number of cycles until an idle request is answered.
const MAX_CYCLES_TO_IDLE: u64 = 20;
/// A blocked process fails every attempt, a busy machine does not.
const ATTEMPTS: u32 = 5;

/// A full pipe.
fn full() -> (PipeReader, PipeWriter) {
    let (reader, mut writer) = pipe().expect("a pipe");
    let flags = fcntl_getfl(&writer).expect("flags");
    fcntl_setfl(&writer, flags | OFlags::NONBLOCK).expect("set");
    while writer.write(&[b'.'; 4096]).is_ok() {}
    while writer.write(b".").is_ok() {}
    fcntl_setfl(&writer, flags).expect("set");
    (reader, writer)
}

struct Bench {
    plant: PlantLink,
    child: Child,
    domain: Domain,
    cycle: u64,
    _folder: TempDir,
}

impl Bench {
    fn start(stderr: PipeWriter) -> Bench {
        let folder = tempfile::tempdir().expect("a folder");
        let domain = Domain::in_folder(&folder.path().join("supple"), "stderr").expect("a domain");
        let plant = PlantLink::new(&domain).expect("a plant");
        let child = Command::new(env!("CARGO_BIN_EXE_supple-rt"))
            .args(["--prefix", "stderr", "--no-realtime"])
            .env("XDG_RUNTIME_DIR", folder.path())
            .stdout(Stdio::null())
            .stderr(stderr)
            .spawn()
            .expect("it starts");
        Bench {
            plant,
            child,
            domain,
            cycle: 0,
            _folder: folder,
        }
    }

    /// Runs a cycle; returns the mode in the controller's answer.
    fn cycle(&mut self) -> Option<Mode> {
        let home = Description::asset("wam4").expect("built in").home::<4>();
        let home = home.expect("four joints");
        let position: [_; 4] = core::array::from_fn(|i| Some(home[i]));
        let report = PlantReport::default();
        let state = ArmState::new(self.cycle, 0, &position, None, Drives::Active, report);
        self.plant.publish(&state).expect("published");
        let received = self.plant.answer(self.cycle, PERIOD).expect("read");
        self.cycle += 1;
        pause(PERIOD);
        received.answer.and_then(|answer| answer.mode())
    }

    fn until(&mut self, mode: Mode) {
        for _ in 0..10_000 {
            if self.cycle() == Some(mode) {
                return;
            }
        }
        panic!("mode {} did not come", mode.name());
    }

    /// Requests idle while the plant runs; returns the answer and the number of cycles until it.
    fn idle(&mut self) -> (IdleAnswer, u64) {
        let domain = self.domain.clone();
        let requested_at = self.cycle;
        let client = std::thread::spawn(move || request_idle(&domain, Duration::from_secs(30)));
        while !client.is_finished() {
            self.cycle();
        }
        let answer = client.join().expect("no panic").expect("requested");
        let answer = answer.expect("an answer");
        let took = answer.cycle.saturating_sub(requested_at);
        (answer, took)
    }

    fn hold(&mut self, operator: &mut OperatorClient) {
        // Without a controller, `send` returns `None`.
        while operator
            .send::<4>(&Request::GravityHold, None)
            .expect("sent")
            .is_none()
        {
            pause(PERIOD);
        }
        self.until(Mode::GravityHold);
    }

    fn run(mut self) {
        let mut operator = OperatorClient::new(&self.domain).expect("an operator");
        let mut quickest = u64::MAX;
        for _ in 0..ATTEMPTS {
            self.hold(&mut operator);
            let (answer, took) = self.idle();
            assert_eq!(answer.outcome, Outcome::Accepted);
            assert_eq!(answer.mode, Some(Mode::Idle));
            quickest = quickest.min(took);
            if quickest <= MAX_CYCLES_TO_IDLE {
                break;
            }
        }
        assert!(quickest <= MAX_CYCLES_TO_IDLE, "{quickest} cycles");
        self.hold(&mut operator);
        // Missing states cause a fault, which writes to standard error.
        self.cycle += 10;
        self.until(Mode::Fault);
        // Leaves the writing thread time to block.
        for _ in 0..50 {
            self.cycle();
        }
        let (answer, _) = self.idle();
        assert_eq!(
            (answer.outcome, answer.mode),
            (Outcome::Accepted, Some(Mode::Fault))
        );
        let reset = operator.send::<4>(&Request::Reset, None).expect("sent");
        assert!(reset.is_some(), "the helper is there");
        self.until(Mode::Idle);
        terminate(&self.child);
        let status = self.child.wait().expect("it ends");
        assert_eq!(status.code(), Some(0), "{status}");
    }
}

#[test]
fn full_standard_error_delays_neither_requests_nor_shutdown() {
    let (_reader, writer) = full();
    Bench::start(writer).run();
}

#[test]
fn closed_standard_error_does_not_end_the_process() {
    let (reader, writer) = pipe().expect("a pipe");
    drop(reader);
    Bench::start(writer).run();
}
