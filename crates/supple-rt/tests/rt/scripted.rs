//! Runs the program `supple-rt` with a scripted plant in real time, whose arm stands still.

use core::time::Duration;
use std::process::{Child, Command, Stdio};
use supple_core::controller::{Mode, Request};
use supple_ipc::message::{ArmState, Drives, Outcome, PlantReport};
use supple_ipc::{Domain, IdleAnswer, OperatorClient, PlantLink, request_idle};
use supple_model::Description;
use supple_realtime::pause;
use tempfile::TempDir;

/// Period of the scripted plant: longer than the arm's, so that the result depends on cycles and not on the load of the
/// machine.
pub const PERIOD: Duration = Duration::from_millis(2);
/// Maximum number of cycles until an idle request is answered: 20 ms at the arm's rate.
pub const MAX_CYCLES_TO_IDLE: u64 = 20;
/// Number of attempts: a blocked process fails all of them, a busy machine does not.
const ATTEMPTS: u32 = 5;

pub struct Bench {
    pub plant: PlantLink,
    pub child: Child,
    pub domain: Domain,
    pub cycle: u64,
    /// Angles that the plant reports \[rad\].
    pub position_rad: [f64; 4],
    pub drives: Drives,
    _folder: TempDir,
}

impl Bench {
    pub fn start(stderr: impl Into<Stdio>) -> Bench {
        let folder = tempfile::tempdir().expect("a folder");
        let domain = Domain::in_folder(&folder.path().join("supple"), "idle").expect("a domain");
        let plant = PlantLink::new(&domain).expect("a plant");
        let child = Command::new(env!("CARGO_BIN_EXE_supple-rt"))
            .args(["--prefix", "idle", "--no-realtime"])
            .env("XDG_RUNTIME_DIR", folder.path())
            .stdout(Stdio::null())
            .stderr(stderr)
            .spawn()
            .expect("it starts");
        let home = Description::asset("wam4").expect("built in").home::<4>();
        Bench {
            plant,
            child,
            domain,
            cycle: 0,
            drives: Drives::Active,
            position_rad: home.expect("four joints").into(),
            _folder: folder,
        }
    }

    /// Runs a cycle; returns the mode in the controller's answer.
    pub fn cycle(&mut self) -> Option<Mode> {
        let position = self.position_rad.map(Some);
        let report = PlantReport::default();
        let state = ArmState::new(self.cycle, 0, &position, None, self.drives, report);
        self.plant.publish(&state).expect("published");
        let received = self.plant.answer(self.cycle, PERIOD).expect("read");
        self.cycle += 1;
        pause(PERIOD);
        received.answer.and_then(|answer| answer.mode())
    }

    pub fn run(&mut self, cycles: u64) {
        for _ in 0..cycles {
            self.cycle();
        }
    }

    pub fn until(&mut self, mode: Mode) {
        for _ in 0..10_000 {
            if self.cycle() == Some(mode) {
                return;
            }
        }
        panic!("the controller did not enter mode {}", mode.name());
    }

    /// Requests idle while the plant runs; returns the answer and the number of cycles until it.
    pub fn idle(&mut self) -> (IdleAnswer, u64) {
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

    pub fn hold(&mut self, operator: &mut OperatorClient) {
        // Without a controller, `send` returns `None`.
        while operator
            .send::<4>(&Request::GravityHold, None)
            .expect("sent")
            .is_none()
        {
            pause(PERIOD);
        }
        for _ in 0..10_000 {
            match self.cycle() {
                Some(Mode::GravityHold) => return,
                // The machine was busy, and the states arrived late.
                Some(Mode::Fault) => {
                    self.reset(operator);
                    let sent = operator.send::<4>(&Request::GravityHold, None);
                    assert!(sent.expect("sent").is_some());
                }
                _ => {}
            }
        }
        panic!("the controller did not enter mode gravity_hold");
    }

    /// Requests idle in gravity hold, and asserts that it acts in time.
    pub fn assert_idle_acts(&mut self, operator: &mut OperatorClient) {
        let mut quickest = u64::MAX;
        for _ in 0..ATTEMPTS {
            self.hold(operator);
            let (answer, took) = self.idle();
            assert_eq!(answer.outcome, Outcome::Accepted);
            assert_eq!(answer.mode, Some(Mode::Idle));
            quickest = quickest.min(took);
            if quickest <= MAX_CYCLES_TO_IDLE {
                return;
            }
        }
        panic!("idle acted after {quickest} cycles, which is too late");
    }

    /// Omits states until a fault latches, then waits so that the writing threads can block.
    pub fn fault(&mut self) {
        self.cycle += 10;
        self.until(Mode::Fault);
        self.run(50);
    }

    /// Resets the fault.
    pub fn reset(&mut self, operator: &mut OperatorClient) {
        let reset = operator.send::<4>(&Request::Reset, None).expect("sent");
        assert!(reset.is_some(), "the helper is connected");
        for _ in 0..10_000 {
            if self.cycle().is_some_and(|mode| mode != Mode::Fault) {
                return;
            }
        }
        panic!("the fault was not reset");
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        // A failed test must not leave a running process.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
