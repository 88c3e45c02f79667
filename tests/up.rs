//! Whole systems as processes, by the real programs: `supple up` with a simulated arm, and the commands that
//! talk to it.

mod support;

use serde_json::Value;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use support::programs;
use tempfile::TempDir;

/// A place of its own for a system.
fn place() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let owner = std::fs::Permissions::from_mode(0o700);
    std::fs::set_permissions(folder.path(), owner).expect("changed");
    folder
}

fn supple(place: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(programs().join("supple"));
    command
        .args(arguments)
        .current_dir(place)
        .env("XDG_RUNTIME_DIR", place)
        .env("SUPPLE_PREFIX", "whole")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

fn run(place: &Path, arguments: &[&str]) -> Output {
    supple(place, arguments).output().expect("it runs")
}

fn json(output: &Output) -> Value {
    let text = String::from_utf8_lossy(&output.stdout);
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}{}", words(output)))
}

fn words(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Twice in virtual time: the same log, which replays. Gives the summary and the log.
fn in_virtual_time(arguments: &[&str], seconds: &str, cycles: u64) -> (Value, TempDir) {
    let up = |name: &str| {
        let place = place();
        let log = format!("{name}.mcap");
        let how = ["--for", seconds, "--json", "--virtual-time", "--log", &log];
        let output = run(place.path(), &[&["up"], arguments, &how[..]].concat());
        assert!(output.status.success(), "{}", words(&output));
        let summary = json(&output);
        let counted = summary["cycles"].as_u64();
        // An arm on a bus is lowered to idle at the end, which takes it some cycles.
        let lowering = if arguments.contains(&"emu") { 20 } else { 0 };
        assert!(
            counted.is_some_and(|n| (cycles..=cycles + lowering).contains(&n)),
            "{summary}"
        );
        for nothing in ["missed", "late", "tx_lost", "telemetry_lost"] {
            assert_eq!(summary[nothing], 0, "{nothing} in {summary}");
        }
        assert_eq!(summary["faults"], Value::Array(Vec::new()));
        let replayed = run(place.path(), &["log", "replay", &log]);
        assert!(replayed.status.success(), "{}", words(&replayed));
        let bytes = std::fs::read(place.path().join(&log)).expect("the log");
        (summary, bytes, place)
    };
    let (summary, one, place) = up("one");
    let (_, two, _place) = up("two");
    assert!(one.len() > 100_000);
    assert!(one == two, "two runs wrote different logs");
    (summary, place)
}

fn rms_error_m(summary: &Value) -> f64 {
    let error_m = summary["rms_error_m"].as_f64();
    error_m.unwrap_or_else(|| panic!("nothing was tracked: {summary}"))
}

#[test]
fn virtual_time_gives_the_same_log_twice_and_it_replays() {
    let (summary, _place) = in_virtual_time(&["--plant", "sim"], "6", 6000);
    assert!(rms_error_m(&summary) < 0.02, "{summary}");
    assert_eq!(summary["bus_load"], 0.0);
}

/// From power-up over the pendant to tracking, through every process there is.
#[test]
fn the_emulated_arm_starts_up_is_activated_and_tracks() {
    let (summary, place) = in_virtual_time(&["--plant", "emu"], "7", 7000);
    assert!(rms_error_m(&summary) < 0.02, "{summary}");
    let bus_load = summary["bus_load"].as_f64().expect("a share");
    assert!((0.45..0.64).contains(&bus_load), "{bus_load}");
    let events = ["log", "export", "one.mcap", "--channel", "/arm_events"];
    let output = run(place.path(), &events);
    let events = String::from_utf8_lossy(&output.stdout).into_owned();
    let at = |what: &str| {
        let found = events.find(what);
        found.unwrap_or_else(|| panic!("{what}: {events}{}", words(&output)))
    };
    assert!(at("Pressed(Idle)") < at("Pressed(Activate)"));
    assert!(at("Pressed(Activate)") < at("motor 1 Torque"));
}

/// Seven joints: at 1 kHz on shared memory; on the bus at the rate that it carries, and not above it.
#[test]
fn seven_joints_run_as_processes() {
    let seven = ["--arm", "wam7"];
    let of = |plant: &'static str, rest: &[&'static str]| {
        [&["--plant", plant], &seven[..], rest].concat()
    };
    let (summary, _place) = in_virtual_time(&of("sim", &[]), "6", 6000);
    assert!(rms_error_m(&summary) < 0.02, "{summary}");
    let (summary, _place) = in_virtual_time(&of("emu", &["--rate-hz", "700"]), "8", 5600);
    assert!(rms_error_m(&summary) < 0.02, "{summary}");

    let place = place();
    let too_fast = ["--virtual-time", "--for", "1", "--no-log"];
    let output = run(place.path(), &[&["up"], &of("emu", &too_fast)[..]].concat());
    assert_eq!(output.status.code(), Some(10));
    for part in ["positions 660 us", "1335 us", "749 Hz", "--rate-hz"] {
        assert!(words(&output).contains(part), "{part}: {}", words(&output));
    }
}

/// `supple up` in the background.
struct Up {
    place: TempDir,
    child: Option<Child>,
}

impl Up {
    fn start() -> Up {
        let place = place();
        let child = supple(place.path(), &["up", "--plant", "sim", "--json"]).spawn();
        Up {
            child: Some(child.expect("it starts")),
            place,
        }
    }

    fn ask(&self, arguments: &[&str]) -> Output {
        run(self.place.path(), arguments)
    }

    /// Looks until the status is as it should be; very many looks without it are a failure.
    fn until(&self, what: &str, is_so: impl Fn(&Value) -> bool) -> Value {
        let mut last = String::new();
        for _ in 0..100 {
            let output = self.ask(&["status", "--json"]);
            if output.status.success() {
                let status = json(&output);
                if is_so(&status) {
                    return status;
                }
                last = status.to_string();
            }
        }
        panic!("{what} did not come about: {last}");
    }
}

impl Drop for Up {
    fn drop(&mut self) {
        if let Some(child) = &mut self.child {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

#[test]
fn a_running_system_is_asked_and_answers() {
    let mut up = Up::start();
    up.until("tracking", |status| {
        status["mode"] == "track" && status["drives"] == "active"
    });

    let output = up.ask(&[
        "gains",
        "--stiffness",
        "25",
        "--damping",
        "3,3,4",
        "--ramp",
        "0.1",
        "--json",
    ]);
    assert!(output.status.success(), "{}", words(&output));
    assert_eq!(json(&output)["accepted"], true);
    up.until("other gains", |status| {
        status["stiffness_n_per_m"] == serde_json::json!([25.0, 25.0, 25.0])
            && status["damping_n_s_per_m"] == serde_json::json!([3.0, 3.0, 4.0])
    });

    let refused = up.ask(&["gains", "--stiffness", "5000", "--json"]);
    assert_eq!(refused.status.code(), Some(11));
    let message = json(&refused)["error"]["message"].to_string();
    assert!(message.contains("stiffness_n_per_m is 5000"), "{message}");

    let refused = up.ask(&["reset"]);
    assert_eq!(
        refused.status.code(),
        Some(11),
        "there is no fault to reset"
    );

    for (mode, drives) in [
        ("gravity-hold", "active"),
        ("idle", "idle"),
        ("gravity-hold", "active"),
    ] {
        let output = up.ask(&["mode", mode]);
        assert!(output.status.success(), "{}", words(&output));
        let name = mode.replace('-', "_");
        up.until(mode, |status| {
            status["mode"] == name && status["drives"] == drives
        });
    }
    let second = up.ask(&["up", "--plant", "sim", "--no-log"]);
    assert_eq!(second.status.code(), Some(10), "{}", words(&second));

    let output = up.ask(&["track", "arc"]);
    assert!(output.status.success(), "{}", words(&output));
    up.until("the arc", |status| status["mode"] == "track");

    let output = up.ask(&["stop"]);
    assert!(output.status.success(), "{}", words(&output));
    let output = up.child.take().expect("running").wait_with_output();
    let output = output.expect("it ends");
    assert!(output.status.success(), "{}", words(&output));
    let log = up.place.path().join("out/up.mcap");
    let replayed = up.ask(&["log", "replay", log.to_str().expect("a name")]);
    assert!(replayed.status.success(), "{}", words(&replayed));
}

#[test]
fn without_a_system_every_command_says_so() {
    let place = place();
    for command in [
        &["status"][..],
        &["mode", "idle"],
        &["reset"],
        &["stop"],
        &["gains", "--stiffness", "5"],
    ] {
        let output = run(place.path(), command);
        assert_eq!(
            output.status.code(),
            Some(10),
            "{command:?}: {}",
            words(&output)
        );
        assert!(words(&output).contains("supple up"), "{}", words(&output));
    }
}

#[test]
fn a_missing_program_is_named_with_the_way_to_build_it() {
    let place = place();
    let alone = place.path().join("alone");
    std::fs::create_dir(&alone).expect("a folder");
    let alone = alone.join("supple");
    std::fs::copy(programs().join("supple"), &alone).expect("copied");
    let output = Command::new(&alone)
        .args(["up", "--plant", "sim", "--no-log"])
        .env("XDG_RUNTIME_DIR", place.path())
        .output()
        .expect("it runs");
    assert_eq!(output.status.code(), Some(10));
    assert!(
        words(&output).contains("cargo build --release -p supple-rt"),
        "{}",
        words(&output)
    );
}
