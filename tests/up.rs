//! Whole systems as processes, by the real programs: `supple up` with a simulated arm, and the commands that
//! talk to it.

use serde_json::Value;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::OnceLock;
use tempfile::TempDir;

/// Folder of the programs, built once: as all tests are, so that nothing is left to do where all run.
fn programs() -> &'static Path {
    static PROGRAMS: OnceLock<PathBuf> = OnceLock::new();
    PROGRAMS.get_or_init(|| {
        let selection =
            "test --no-run --locked --workspace --exclude supple-python --lib --bins --tests";
        let built = Command::new(env!("CARGO"))
            .args(selection.split(' '))
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .output()
            .expect("cargo runs");
        assert!(
            built.status.success(),
            "{}",
            String::from_utf8_lossy(&built.stderr)
        );
        let test = std::env::current_exe().expect("this test");
        let deps = test.parent().expect("deps");
        deps.parent().expect("the profile's folder").to_owned()
    })
}

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

#[test]
fn virtual_time_gives_the_same_log_twice_and_it_replays() {
    let up = |name: &str| {
        let place = place();
        let log = format!("{name}.mcap");
        let seconds = ["--for", "6", "--json", "--virtual-time", "--log", &log];
        let output = run(
            place.path(),
            &[&["up", "--plant", "sim"], &seconds[..]].concat(),
        );
        assert!(output.status.success(), "{}", words(&output));
        let summary = json(&output);
        assert_eq!(summary["cycles"], 6000, "{summary}");
        for nothing in ["missed", "late", "tx_lost", "telemetry_lost"] {
            assert_eq!(summary[nothing], 0, "{nothing} in {summary}");
        }
        assert_eq!(summary["faults"], Value::Array(Vec::new()));
        assert!(
            summary["rms_error_m"]
                .as_f64()
                .is_some_and(|error_m| error_m < 0.02)
        );
        let replayed = run(place.path(), &["log", "replay", &log]);
        assert!(replayed.status.success(), "{}", words(&replayed));
        std::fs::read(place.path().join(&log)).expect("the log")
    };
    let (one, two) = (up("one"), up("two"));
    assert!(one.len() > 100_000);
    assert!(one == two, "two runs wrote different logs");
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
