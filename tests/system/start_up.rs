//! Tests that idle, accepted while `supple up` starts a system, overrides the start-up: the drives are not activated, the arm does
//! not move, and the system keeps running.

use crate::running::{PREFIX, Up, stderr_of, supple, temporary_folder};
use core::time::Duration;
use supple_core::controller::Mode;
use supple_ipc::message::{Drives, Outcome};
use supple_ipc::{Domain, IdleAnswer, TelemetryReader, request_idle};
use supple_realtime::pause;

const TIMEOUT: Duration = Duration::from_secs(30);
/// Maximum number of cycles until the drives are idle after idle was accepted.
const LOWERED_CYCLES: u64 = 120;
/// Number of observed cycles; start-up takes about 400.
const WATCHED_CYCLES: u64 = 1000;
const WORDS: [&str; 3] = ["start-up ends here", "idle", "`supple mode gravity-hold`"];

struct Starting {
    up: Up,
    domain: Domain,
    reader: TelemetryReader,
}

/// Requests idle until the controller answers.
fn idle(domain: &Domain) -> IdleAnswer {
    for _ in 0..30_000 {
        let answer = request_idle(domain, TIMEOUT).expect("requested");
        if let Some(answer) = answer {
            assert_eq!(answer.outcome, Outcome::Accepted);
            return answer;
        }
        pause(Duration::from_millis(1));
    }
    panic!("no controller");
}

impl Starting {
    fn new(plant: &str, rest: &[&str]) -> Starting {
        let how = ["--plant", plant, "--no-log", "--no-realtime"];
        let up = Up::start(&[&how[..], rest].concat());
        let folder = up.folder.path().join("supple");
        let domain = Domain::in_folder(&folder, PREFIX).expect("a domain");
        let reader = TelemetryReader::new(&domain).expect("a reader");
        Starting { up, domain, reader }
    }

    fn wait_for(&mut self, mode: Mode) {
        while let Some(telemetry) = self.reader.wait(TIMEOUT).expect("read") {
            if telemetry.record().mode() == Some(mode) {
                return;
            }
        }
        panic!("the controller did not enter mode {}", mode.name());
    }

    /// Asserts that controller and drives stay idle; then the operator continues.
    fn assert_stays_idle(&mut self, since: u64) {
        loop {
            let telemetry = self.reader.wait(TIMEOUT).expect("read");
            let telemetry = telemetry.expect("the system keeps running");
            let Some(after) = telemetry.state.cycle.checked_sub(since) else {
                continue;
            };
            let mode = telemetry.record().mode();
            assert_eq!(mode, Some(Mode::Idle), "{after} cycles after idle");
            let active = telemetry.state.drives() == Drives::Active;
            assert!(!active || after < LOWERED_CYCLES, "{after} cycles after");
            if after > WATCHED_CYCLES {
                return;
            }
        }
    }

    fn assert_goes_on(self) {
        let held = self.up.run(&["mode", "gravity-hold"]);
        assert!(held.status.success(), "{}", stderr_of(&held));
        let output = self.up.end();
        let words = stderr_of(&output);
        assert!(output.status.success(), "{words}");
        for part in WORDS {
            assert!(words.contains(part), "{part}: {words}");
        }
        assert_eq!(words.matches(WORDS[0]).count(), 1, "{words}");
    }
}

/// Idle is requested as soon as the controller runs; the emulated arm has not sent a state yet.
#[test]
fn idle_as_early_as_possible_is_not_overridden() {
    for plant in ["sim", "emu"] {
        let mut starting = Starting::new(plant, &[]);
        let answer = idle(&starting.domain);
        starting.assert_stays_idle(answer.cycle);
        starting.assert_goes_on();
    }
}

/// The pendant is not pressed, and a run of limited duration also continues.
#[test]
fn idle_in_gravity_hold_is_not_overridden() {
    for (plant, rest) in [("sim", &[][..]), ("emu", &["--for", "60"][..])] {
        let mut starting = Starting::new(plant, rest);
        starting.wait_for(Mode::GravityHold);
        let answer = idle(&starting.domain);
        starting.assert_stays_idle(answer.cycle);
        if plant == "emu" {
            let record = starting.up.run(&["pendant", "record"]);
            let record = String::from_utf8_lossy(&record.stdout).into_owned();
            assert!(record.contains("Pressed(Idle)"), "{record}");
            assert!(!record.contains("Pressed(Activate)"), "{record}");
        }
        starting.assert_goes_on();
    }
}

/// A calibration that has just started its controller does not move the arm: it ends.
#[test]
fn idle_ends_a_calibration_that_starts() {
    let folder = temporary_folder();
    let how = ["calibrate", "--plant", "emu", "--yes", "--no-realtime"];
    let calibration = supple(folder.path(), &how).spawn().expect("it starts");
    let domain = Domain::in_folder(&folder.path().join("supple"), PREFIX).expect("a domain");
    let answer = idle(&domain);
    assert_eq!(answer.mode, Some(Mode::Idle));
    let output = calibration.wait_with_output().expect("it ends");
    let words = stderr_of(&output);
    assert_eq!(output.status.code(), Some(11), "{words}");
    assert!(
        words.contains("refused") && words.contains("idle"),
        "{words}"
    );
}
