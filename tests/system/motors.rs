//! Tests of `supple motors` with emulated Damiao motors.

use crate::running::{PREFIX, json, run, stderr_of, temporary_folder};
use crate::support::programs;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use supple_realtime::pause;
use tempfile::TempDir;

/// An emulated arm in a temporary folder.
struct Emulated {
    folder: TempDir,
    child: Child,
}

impl Emulated {
    fn start(arguments: &[&str]) -> Emulated {
        let folder = temporary_folder();
        let child = Command::new(programs().join("supple-emu"))
            .args(arguments)
            .current_dir(folder.path())
            .env("XDG_RUNTIME_DIR", folder.path())
            .env("SUPPLE_PREFIX", PREFIX)
            .stderr(Stdio::null())
            .spawn();
        let child = child.expect("it starts");
        Emulated { folder, child }
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Runs `supple motors` until the emulator has opened its sockets.
    fn motors(&self, arguments: &[&str]) -> Output {
        let arguments = [&["motors"], arguments].concat();
        for _ in 0..200 {
            let output = run(self.path(), &arguments);
            if !stderr_of(&output).contains("start the emulator first") {
                return output;
            }
            pause(core::time::Duration::from_millis(20));
        }
        panic!("the emulated arm does not answer");
    }
}

impl Drop for Emulated {
    fn drop(&mut self) {
        // After SIGTERM, the emulator would wait for a host that disables its motors.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn motors_are_listed_and_compared() {
    let arm = Emulated::start(&["--arm", "yam"]);
    let output = arm.motors(&["--arm", "yam", "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr_of(&output));
    let report = json(&output);
    let motors = report["motors"].as_array().expect("motors");
    assert_eq!(motors.len(), 6);
    for motor in motors {
        assert_eq!(motor["state"], "disabled");
        assert_eq!(motor["problem"], serde_json::Value::Null);
        assert_eq!(
            (motor["mode"].as_u64(), motor["watchdog_s"].as_f64()),
            (Some(1), Some(0.0))
        );
    }
    assert_eq!(motors[0]["ranges"], serde_json::json!([12.5, 10.0, 28.0]));
}

#[test]
fn a_register_is_set_only_when_asked_and_never_a_range() {
    let arm = Emulated::start(&["--arm", "yam"]);
    let set = |assignment: &str| {
        arm.motors(&[
            "--arm", "yam", "--motor", "3", "--set", assignment, "--json",
        ])
    };
    let output = set("TIMEOUT=400");
    assert_eq!(output.status.code(), Some(0), "{}", stderr_of(&output));
    assert!(
        stderr_of(&output)
            .contains("register 9 (TIMEOUT) was 0, is 400 until its supply is switched off")
    );
    assert_eq!(json(&output)["motors"][0]["watchdog_s"], 0.02);
    for (assignment, words) in [
        ("TMAX=20", "host and motor must agree on it"),
        ("can_br=9", "host and motor must agree on it"),
        ("Flux=0.1", "the motor alone writes it"),
        ("TIMEOUT=-1", "a whole number"),
        ("TIME=1", "no register has this name"),
        ("TIMEOUT", "give NAME=VALUE"),
    ] {
        let refused = set(assignment);
        assert_eq!(refused.status.code(), Some(10));
        assert!(
            stderr_of(&refused).contains(words),
            "{}",
            stderr_of(&refused)
        );
    }
    let unknown = arm.motors(&["--arm", "yam", "--motor", "9"]);
    assert!(stderr_of(&unknown).contains("use one of 1, 2, 3, 4, 5, 6"));
    let alone = arm.motors(&["--arm", "yam", "--store"]);
    assert_eq!(alone.status.code(), Some(2));
}

#[test]
fn motors_that_do_not_match_are_reported_with_a_remedy() {
    let arm = Emulated::start(&[
        "--arm",
        "yam",
        "--misbehave",
        "silent:motor=2",
        "--misbehave",
        "register:motor=3,number=22,value=8",
        "--misbehave",
        "error:motor=5,code=C",
        "--misbehave",
        "register:motor=6,number=19,value=0.004",
    ]);
    let output = arm.motors(&["--arm", "yam"]);
    assert_eq!(output.status.code(), Some(10));
    let text = stderr_of(&output);
    for words in [
        "motor 2 does not answer; check its supply",
        "motor 3 register 22 (VMAX) is 8, expected 10; check that the motor is the right one, then correct the arm's file",
        "motor 5 reports: winding too hot; remove the cause",
    ] {
        assert!(text.contains(words), "{text}");
    }
    let listed = String::from_utf8_lossy(&output.stdout);
    assert!(
        listed.contains("motor 6: register 19 (Flux) is 0.00400"),
        "{listed}"
    );
    let cleared = arm.motors(&["--arm", "yam", "--motor", "5", "--clear", "--json"]);
    assert_eq!(cleared.status.code(), Some(0), "{}", stderr_of(&cleared));
    assert_eq!(json(&cleared)["motors"][0]["state"], "disabled");
}

#[test]
fn registers_are_neither_read_nor_written_while_a_motor_is_enabled() {
    let arm = Emulated::start(&["--arm", "yam", "--misbehave", "enabled:motor=4"]);
    let output = arm.motors(&["--arm", "yam", "--motor", "1", "--set", "TIMEOUT=400"]);
    assert_eq!(output.status.code(), Some(10));
    assert!(
        stderr_of(&output).contains("motor 4 is already enabled"),
        "{}",
        stderr_of(&output)
    );
}

#[test]
fn an_arm_without_a_bus_and_a_bus_without_an_arm_are_errors() {
    let folder = temporary_folder();
    let output = run(folder.path(), &["motors", "--arm", "wam4"]);
    assert_eq!(output.status.code(), Some(10));
    assert!(stderr_of(&output).contains("has no [bus] in its TOML"));
    let output = run(folder.path(), &["motors", "--bus", "can:nocan7"]);
    assert_eq!(output.status.code(), Some(10));
    assert!(
        stderr_of(&output).contains("nocan7"),
        "{}",
        stderr_of(&output)
    );
}
